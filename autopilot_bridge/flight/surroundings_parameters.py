"""Following a target (FLW_TGT_*, FOLL_*), obstacles (CP_*, AVOID_*), landing at a target (PLD_*, PLND_*)."""

import math
from dataclasses import dataclass
from enum import IntEnum

from flightsim.foundation.checks import NotNegative, NotNegativeOrInf, NotNegativeOrNan, Positive, Whole
from flightsim.foundation.options import Options


class FollowHeight(IntEnum):
    """The reference of the height."""

    HOME = 0  # FLW_TGT_ALT_M 0
    GROUND = 1  # FLW_TGT_ALT_M 1
    TARGET = 2  # FLW_TGT_ALT_M 2 | FOLL_OFS_Z


class FollowYaw(IntEnum):
    """Where the nose points (FOLL_YAW_BEHAVE; PX4 faces the target)."""

    KEEP = 0
    FACE_TARGET = 1
    AS_TARGET = 2
    ALONG_TRACK = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowParameters(Options):
    """The position relative to the target.

    Attributes:
        enabled: the mode can be selected (FOLL_ENABLE).
        system_id: the system to follow; 0: the first one received (FOLL_SYSID).
        offset_m: forward, right (or north, east) from the target, and down from the height's reference.
        along_course: the offset turns with the target's course (FOLL_OFS_TYPE 1).
        height: the reference of the height.
        relative_altitude: the target's altitudes are over its home, and ours over ours (FOLL_ALT_TYPE 1).
        max_distance_m: a target farther away is not followed; infinite: always (FOLL_DIST_MAX).
        timeout_s: the vehicle stops when no message was received for this time.
        gain_1_s: of the distance from the wanted position (FOLL_POS_P).
        smoothing_s: time constant of the turn with the target's course (FLW_TGT_RS).
        swing_speed_m_s: greatest speed around the target (FLW_TGT_MAX_VEL).
        yaw: where the nose points.
    """

    enabled: bool = True
    system_id: Whole = 0
    offset_m: tuple[float, float, float] = (-8.0, 0.0, -8.0)
    along_course: bool = True
    height: FollowHeight = FollowHeight.HOME
    relative_altitude: bool = False
    max_distance_m: NotNegativeOrInf = math.inf
    timeout_s: NotNegative = 2.5
    gain_1_s: Positive = 0.5
    smoothing_s: NotNegative = 0.5
    swing_speed_m_s: NotNegative = 5.0
    yaw: FollowYaw = FollowYaw.FACE_TARGET

    def check_together(self) -> None:
        if len(self.offset_m) != 3 or not all(abs(part) <= 1e4 for part in self.offset_m):
            raise ValueError(f"offset_m {self.offset_m} is not accepted: three numbers within 10 km are")


@dataclass(frozen=True, slots=True, kw_only=True)
class AvoidanceParameters(Options):
    """Distance from obstacles.

    Attributes:
        enabled: for pilots (CP_DIST not negative; AVOID_ENABLE bit 1 with PRX1_TYPE).
        guided: for streamed velocities too (ArduPilot).
        margin_m: distance from obstacles (CP_DIST, AVOID_MARGIN).
        delay_s: of sensor and control (CP_DELAY).
        guard_rad: obstacles within this angle of the direction of flight count (PX4).
        go_without_data: fly also in directions without a sensor (CP_GO_NO_DATA; ArduPilot always).
        slide: along obstacles (AVOID_BEHAVE 0).
        timeout_s: older measurements are not used.
        deceleration_m_s2: deceleration of the stop (AVOID_ACCEL_MAX).
    """

    enabled: bool = False
    guided: bool = False
    margin_m: NotNegative = 2.0
    delay_s: NotNegative = 0.4
    guard_rad: NotNegative = math.radians(30.0)
    go_without_data: bool = True
    slide: bool = False
    timeout_s: NotNegative = 0.5
    deceleration_m_s2: Positive = 2.0


class Precision(IntEnum):
    """Whether a landing uses a target (PRECISION_LAND_MODE)."""

    NONE = 0
    OPPORTUNISTIC = 1  # when it is seen; else a normal landing
    REQUIRED = 2  # the vehicle searches for it


class TargetLost(IntEnum):
    """The action when the target is not seen (PLND_STRICT; PX4 searches)."""

    LAND = 0  # where the vehicle is
    SEARCH = 1  # climb and search for it a few times, then land
    HOVER = 2  # stay above, until it is seen


@dataclass(frozen=True, slots=True, kw_only=True)
class PrecisionParameters(Options):
    """Parameters of a precision landing.

    Attributes:
        enabled: LAND always uses a target (PLND_ENABLED); PX4 only when a mode or an item requires it.
        wait_s: a target not seen for this time during the descent is lost (PLD_BTOUT, PLND_TIMEOUT).
        align_m: horizontal distance from the target below which the vehicle descends (PLD_HACC_RAD,
            PLND_XY_DIST_MAX).
        final_m: below this height it descends without a target too (PLD_FAPPR_ALT, PLND_ALT_MIN).
        greatest_m: above this height no target is used (PLND_ALT_MAX).
        search_m: height over home of the search (PLD_SRCH_ALT); NaN: the height at which it was lost.
        search_s: duration of a search (PLD_SRCH_TOUT).
        searches: number of searches (PLD_MAX_SRCH, PLND_RET_MAX).
        lost: the action when it is not seen.
    """

    enabled: bool = False
    wait_s: NotNegative = 5.0
    align_m: NotNegative = 0.2
    final_m: NotNegative = 0.1
    greatest_m: NotNegative = 1e4
    search_m: NotNegativeOrNan = 10.0
    search_s: NotNegative = 10.0
    searches: Whole = 3
    lost: TargetLost = TargetLost.SEARCH
