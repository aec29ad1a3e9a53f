"""PX4's parameters of a fixed wing (`parameters.toml` and what the multicopter's table shares)."""

from importlib.resources import files
from typing import Final

from autopilot_bridge.firmware.px4.copter.parameters import PX4_PARAMETERS
from autopilot_bridge.parameter_tables import load_table
from autopilot_bridge.parameters import ParameterDefinition

PX4_PLANE_PARAMETERS: Final[tuple[ParameterDefinition, ...]] = tuple(
    sorted(
        load_table(
            files("autopilot_bridge.firmware.px4.plane").joinpath("parameters.toml"), base=PX4_PARAMETERS
        ),
        key=lambda definition: definition.name,
    )
)
"""What a user of PX4 1.16 touches on an aircraft, sorted by name as in PX4."""
