"""ArduPlane's parameters (`parameters.toml` and what the copter's table shares)."""

from importlib.resources import files
from typing import Final

from autopilot_bridge.firmware.ardupilot.copter.parameters import ARDUPILOT_PARAMETERS
from autopilot_bridge.parameter_tables import combined, load_table
from autopilot_bridge.parameters import ParameterDefinition

_COPTER_ONLY: Final = (
    "PLND_",
    "PRX1_",
    "VISO_",
    "ACRO_BAL_ROLL",
    "ACRO_BAL_PITCH",
    "ACRO_TRAINER",
    "ACRO_RP_RATE",
    "ACRO_RP_EXPO",
    "ACRO_Y_RATE",
    "ANGLE_MAX",
    "ARMING_NEED_LOC",
    "ATC_",
    "AVOID_",
    "CIRCLE_",
    "DISARM_DELAY",
    "ESC_CALIBRATION",
    "FOLL_",
    "FRAME_",
    "FS_CRASH_CHECK",
    "FS_DR_",
    "FS_EKF_ACTION",
    "FS_EKF_FILT",
    "FS_GCS_ENABLE",
    "FS_GCS_TIMEOUT",
    "FS_OPTIONS",
    "FS_THR_",
    "FS_VIBE_ENABLE",
    "GPS_HDOP_GOOD",
    "GUID_",
    "LAND_ALT_LOW",
    "LAND_REPOSITION",
    "LAND_SPEED",
    "LAND_SPEED_HIGH",
    "LOIT_",
    "MOT_",
    "PHLD_",
    "PILOT_",
    "PSC_",
    "RC_FS_TIMEOUT",
    "RC_SPEED",
    "RTL_ALT",
    "RTL_ALT_FINAL",
    "RTL_ALT_TYPE",
    "RTL_CONE_SLOPE",
    "RTL_LOIT_TIME",
    "RTL_OPTIONS",
    "RTL_SPEED",
    "SIMPLE",
    "SUPER_SIMPLE",
    "THR_DZ",
    "TKOFF_SLEW_TIME",
    "TUNE",
    "WPNAV_",
    "WP_YAW_BEHAVIOR",
)

ARDUPILOT_PLANE_PARAMETERS: Final[tuple[ParameterDefinition, ...]] = combined(
    ARDUPILOT_PARAMETERS,
    load_table(files("autopilot_bridge.firmware.ardupilot.plane").joinpath("parameters.toml")),
    without=_COPTER_ONLY,
)
"""What a user of ArduPlane 4.6 touches, group by group."""
