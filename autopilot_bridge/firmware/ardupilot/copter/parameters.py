"""ArduPilot's parameters of a copter (`parameters.toml`)."""

from importlib.resources import files
from typing import Final

from autopilot_bridge.parameter_tables import load_table
from autopilot_bridge.parameters import ParameterDefinition

ARDUPILOT_PARAMETERS: Final[tuple[ParameterDefinition, ...]] = load_table(
    files("autopilot_bridge.firmware.ardupilot.copter").joinpath("parameters.toml")
)
"""What a user of ArduCopter 4.6 touches, about a third of the firmware's table, about in its group order."""
