"""PX4's parameters of a multicopter (`parameters.toml`)."""

from importlib.resources import files
from typing import Final

from autopilot_bridge.parameter_tables import load_table
from autopilot_bridge.parameters import ParameterDefinition

PX4_PARAMETERS: Final[tuple[ParameterDefinition, ...]] = tuple(
    sorted(
        load_table(files("autopilot_bridge.firmware.px4.copter").joinpath("parameters.toml")),
        key=lambda definition: definition.name,
    )
)
"""What a multicopter user of PX4 1.16 touches, half of the firmware's table, sorted by name as in PX4."""
