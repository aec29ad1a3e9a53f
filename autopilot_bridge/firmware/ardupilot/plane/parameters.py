"""ArduPlane's parameters (`parameters.toml` and what the copter's table shares)."""

from importlib.resources import files
from typing import Final

from autopilot_bridge.firmware.ardupilot.copter.parameters import ARDUPILOT_PARAMETERS
from autopilot_bridge.parameter_tables import load_table
from autopilot_bridge.parameters import ParameterDefinition

ARDUPILOT_PLANE_PARAMETERS: Final[tuple[ParameterDefinition, ...]] = load_table(
    files("autopilot_bridge.firmware.ardupilot.plane").joinpath("parameters.toml"), base=ARDUPILOT_PARAMETERS
)
"""What a user of ArduPlane 4.6 touches, group by group."""
