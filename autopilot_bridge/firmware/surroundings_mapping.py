"""Parameters of following, precision landing and avoidance, of both firmwares."""

import math
from typing import Final

from autopilot_bridge.firmware.mapping import clamp, integer, number
from autopilot_bridge.flight.avoidance_parameters import AvoidanceParameters
from autopilot_bridge.flight.follow_parameters import FollowHeight, FollowParameters, FollowYaw
from autopilot_bridge.flight.precision_parameters import Precision, PrecisionParameters, TargetLost
from autopilot_bridge.parameters import ParameterStore

_SMOOTHING_S: Final = 5.0  # of FLW_TGT_RS 1
_PX4_TIMEOUT_S: Final = 2.5
_ARDUPILOT_TIMEOUT_S: Final = 3.0
_MAVLINK: Final = 2  # PRX1_TYPE
_PROXIMITY: Final = 2  # bit of AVOID_ENABLE
_HEIGHTS: Final = {0: FollowHeight.HOME, 1: FollowHeight.GROUND, 2: FollowHeight.TARGET}  # FLW_TGT_ALT_M
_YAWS: Final = {
    0: FollowYaw.KEEP,
    1: FollowYaw.FACE_TARGET,
    2: FollowYaw.AS_TARGET,
    3: FollowYaw.ALONG_TRACK,
}  # FOLL_YAW_BEHAVE
_STRICT: Final = {0: TargetLost.LAND, 1: TargetLost.SEARCH, 2: TargetLost.HOVER}  # PLND_STRICT


def px4_follow(store: ParameterStore) -> FollowParameters:
    """FLW_TGT_*. The angle is clockwise from the target's course: 0 in front of it, 180 behind it."""
    distance_m = clamp(number(store, "FLW_TGT_DST", 8.0), 1.0, 1000.0)
    angle_rad = math.radians(number(store, "FLW_TGT_FA", 180.0))
    height_m = clamp(number(store, "FLW_TGT_HT", 8.0), 1.0, 1000.0)
    return FollowParameters(
        offset_m=(distance_m * math.cos(angle_rad), distance_m * math.sin(angle_rad), -height_m),
        height=_HEIGHTS.get(integer(store, "FLW_TGT_ALT_M", 0), FollowHeight.HOME),
        timeout_s=_PX4_TIMEOUT_S,
        smoothing_s=_SMOOTHING_S * clamp(number(store, "FLW_TGT_RS", 0.1), 0.0, 1.0),
        swing_speed_m_s=clamp(number(store, "FLW_TGT_MAX_VEL", 5.0), 0.1, 20.0),
    )


def ardupilot_follow(store: ParameterStore) -> FollowParameters:
    """FOLL_*. A distance of 0 for FOLL_DIST_MAX is any."""
    farthest_m = number(store, "FOLL_DIST_MAX", 100.0)
    x, y, z = (clamp(number(store, f"FOLL_OFS_{axis}", 0.0), -1000.0, 1000.0) for axis in "XYZ")
    return FollowParameters(
        enabled=integer(store, "FOLL_ENABLE", 0) != 0,
        system_id=max(0, integer(store, "FOLL_SYSID", 0)),
        offset_m=(x, y, z),
        along_course=integer(store, "FOLL_OFS_TYPE", 0) == 1,
        height=FollowHeight.TARGET,
        relative_altitude=integer(store, "FOLL_ALT_TYPE", 0) == 1,
        max_distance_m=farthest_m if farthest_m > 0.0 else math.inf,
        timeout_s=_ARDUPILOT_TIMEOUT_S,
        gain_1_s=clamp(number(store, "FOLL_POS_P", 0.1), 0.01, 1.0),
        yaw=_YAWS.get(integer(store, "FOLL_YAW_BEHAVE", 1), FollowYaw.FACE_TARGET),
    )


def px4_precision(store: ParameterStore) -> PrecisionParameters:
    """PLD_*."""
    return PrecisionParameters(
        wait_s=clamp(number(store, "PLD_BTOUT", 5.0), 0.0, 50.0),
        align_m=clamp(number(store, "PLD_HACC_RAD", 0.2), 0.05, 10.0),
        final_m=clamp(number(store, "PLD_FAPPR_ALT", 0.1), 0.0, 10.0),
        search_m=clamp(number(store, "PLD_SRCH_ALT", 10.0), 0.0, 100.0),
        search_s=clamp(number(store, "PLD_SRCH_TOUT", 10.0), 0.0, 100.0),
        searches=max(0, min(100, integer(store, "PLD_MAX_SRCH", 3))),
        lost=TargetLost.SEARCH,
    )


def px4_return_precision(store: ParameterStore) -> Precision:
    """RTL_PLD_MD."""
    mode = integer(store, "RTL_PLD_MD", 0)
    return Precision(mode) if mode in tuple(Precision) else Precision.NONE


def ardupilot_precision(store: ParameterStore) -> PrecisionParameters:
    """PLND_*; a retry goes up to where the target was lost."""
    lowest_m = clamp(number(store, "PLND_ALT_MIN", 0.75), 0.0, 5.0)
    return PrecisionParameters(
        enabled=integer(store, "PLND_ENABLED", 0) != 0 and integer(store, "PLND_TYPE", 0) != 0,
        wait_s=clamp(number(store, "PLND_TIMEOUT", 4.0), 0.0, 20.0),
        align_m=clamp(number(store, "PLND_XY_DIST_MAX", 2.5), 0.1, 10.0),
        final_m=lowest_m,
        greatest_m=clamp(number(store, "PLND_ALT_MAX", 8.0), lowest_m, 50.0),
        search_m=math.nan,
        search_s=clamp(number(store, "PLND_TIMEOUT", 4.0), 0.0, 20.0),
        searches=max(0, min(10, integer(store, "PLND_RET_MAX", 4))),
        lost=_STRICT.get(integer(store, "PLND_STRICT", 1), TargetLost.SEARCH),
    )


def px4_avoidance(store: ParameterStore) -> AvoidanceParameters:
    """CP_*: a negative CP_DIST switches it off."""
    margin_m = number(store, "CP_DIST", -1.0)
    return AvoidanceParameters(
        enabled=margin_m >= 0.0,
        margin_m=clamp(margin_m, 0.0, 15.0),
        delay_s=clamp(number(store, "CP_DELAY", 0.4), 0.0, 1.0),
        guard_rad=math.radians(clamp(number(store, "CP_GUIDE_ANG", 30.0), 5.0, 85.0)),
        go_without_data=integer(store, "CP_GO_NO_DATA", 0) != 0,
        deceleration_m_s2=clamp(number(store, "MPC_ACC_HOR", 3.0), 0.5, 15.0),
    )


def ardupilot_avoidance(store: ParameterStore) -> AvoidanceParameters:
    """AVOID_*, with a proximity sensor by MAVLink (PRX1_TYPE 2)."""
    told = integer(store, "PRX1_TYPE", 0) == _MAVLINK
    enabled = told and bool(integer(store, "AVOID_ENABLE", 3) & _PROXIMITY)
    return AvoidanceParameters(
        enabled=enabled,
        guided=enabled,
        margin_m=clamp(number(store, "AVOID_MARGIN", 2.0), 0.5, 10.0),
        slide=integer(store, "AVOID_BEHAVE", 0) == 0,
        deceleration_m_s2=clamp(number(store, "AVOID_ACCEL_MAX", 3.0), 0.5, 9.0),
    )
