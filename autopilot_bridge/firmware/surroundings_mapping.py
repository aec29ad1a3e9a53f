"""Parameters of following, precision landing and avoidance, of both firmwares."""

import math
from typing import Final

from autopilot_bridge.firmware.mapping import integer
from autopilot_bridge.flight.surroundings_parameters import (
    AvoidanceParameters,
    FollowHeight,
    FollowParameters,
    FollowYaw,
    Precision,
    PrecisionParameters,
    TargetLost,
)
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
    distance_m = store.limited("FLW_TGT_DST")
    angle_rad = math.radians(store.get("FLW_TGT_FA"))
    height_m = store.limited("FLW_TGT_HT")
    return FollowParameters(
        offset_m=(distance_m * math.cos(angle_rad), distance_m * math.sin(angle_rad), -height_m),
        height=_HEIGHTS.get(integer(store, "FLW_TGT_ALT_M"), FollowHeight.HOME),
        timeout_s=_PX4_TIMEOUT_S,
        smoothing_s=_SMOOTHING_S * store.limited("FLW_TGT_RS"),
        swing_speed_m_s=store.limited("FLW_TGT_MAX_VEL"),
    )


def ardupilot_follow(store: ParameterStore) -> FollowParameters:
    """FOLL_*. A distance of 0 for FOLL_DIST_MAX is any."""
    farthest_m = store.get("FOLL_DIST_MAX")
    x, y, z = (store.limited(f"FOLL_OFS_{axis}") for axis in "XYZ")
    return FollowParameters(
        enabled=integer(store, "FOLL_ENABLE") != 0,
        system_id=max(0, integer(store, "FOLL_SYSID")),
        offset_m=(x, y, z),
        along_course=integer(store, "FOLL_OFS_TYPE") == 1,
        height=FollowHeight.TARGET,
        relative_altitude=integer(store, "FOLL_ALT_TYPE") == 1,
        max_distance_m=farthest_m if farthest_m > 0.0 else math.inf,
        timeout_s=_ARDUPILOT_TIMEOUT_S,
        gain_1_s=store.limited("FOLL_POS_P"),
        yaw=_YAWS.get(integer(store, "FOLL_YAW_BEHAVE"), FollowYaw.FACE_TARGET),
    )


def px4_precision(store: ParameterStore) -> PrecisionParameters:
    """PLD_*."""
    return PrecisionParameters(
        wait_s=store.limited("PLD_BTOUT"),
        align_m=store.limited("PLD_HACC_RAD"),
        final_m=store.limited("PLD_FAPPR_ALT"),
        search_m=store.limited("PLD_SRCH_ALT"),
        search_s=store.limited("PLD_SRCH_TOUT"),
        searches=int(store.limited("PLD_MAX_SRCH")),
        lost=TargetLost.SEARCH,
    )


def px4_return_precision(store: ParameterStore) -> Precision:
    """RTL_PLD_MD."""
    mode = integer(store, "RTL_PLD_MD")
    return Precision(mode) if mode in tuple(Precision) else Precision.NONE


def ardupilot_precision(store: ParameterStore) -> PrecisionParameters:
    """PLND_*; a retry goes up to where the target was lost."""
    lowest_m = store.limited("PLND_ALT_MIN")
    return PrecisionParameters(
        enabled=integer(store, "PLND_ENABLED") != 0 and integer(store, "PLND_TYPE") != 0,
        wait_s=store.limited("PLND_TIMEOUT"),
        align_m=store.limited("PLND_XY_DIST_MAX"),
        final_m=lowest_m,
        greatest_m=max(lowest_m, store.limited("PLND_ALT_MAX")),
        search_m=math.nan,
        search_s=store.limited("PLND_TIMEOUT"),
        searches=int(store.limited("PLND_RET_MAX")),
        lost=_STRICT.get(integer(store, "PLND_STRICT"), TargetLost.SEARCH),
    )


def px4_avoidance(store: ParameterStore) -> AvoidanceParameters:
    """CP_*: a negative CP_DIST switches it off."""
    return AvoidanceParameters(
        enabled=store.get("CP_DIST") >= 0.0,
        margin_m=max(0.0, store.limited("CP_DIST")),
        delay_s=store.limited("CP_DELAY"),
        guard_rad=math.radians(store.limited("CP_GUIDE_ANG")),
        go_without_data=integer(store, "CP_GO_NO_DATA") != 0,
        deceleration_m_s2=store.limited("MPC_ACC_HOR"),
    )


def ardupilot_avoidance(store: ParameterStore) -> AvoidanceParameters:
    """AVOID_*, with a proximity sensor by MAVLink (PRX1_TYPE 2)."""
    by_messages = integer(store, "PRX1_TYPE") == _MAVLINK
    enabled = by_messages and bool(integer(store, "AVOID_ENABLE") & _PROXIMITY)
    return AvoidanceParameters(
        enabled=enabled,
        guided=enabled,
        margin_m=store.limited("AVOID_MARGIN"),
        slide=integer(store, "AVOID_BEHAVE") == 0,
        deceleration_m_s2=store.limited("AVOID_ACCEL_MAX"),
    )
