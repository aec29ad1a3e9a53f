"""How a vehicle follows a target: PX4's FLW_TGT_*, ArduPilot's FOLL_*."""

import math
from dataclasses import dataclass
from enum import IntEnum

from flightsim.foundation.checks import check_fields, require_not_negative, require_positive


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
class FollowParameters:
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
    system_id: int = 0
    offset_m: tuple[float, float, float] = (-8.0, 0.0, -8.0)
    along_course: bool = True
    height: FollowHeight = FollowHeight.HOME
    relative_altitude: bool = False
    max_distance_m: float = math.inf
    timeout_s: float = 2.5
    gain_1_s: float = 0.5
    smoothing_s: float = 0.5
    swing_speed_m_s: float = 5.0
    yaw: FollowYaw = FollowYaw.FACE_TARGET

    def __post_init__(self) -> None:
        if len(self.offset_m) != 3 or not all(abs(part) <= 1e4 for part in self.offset_m):
            raise ValueError(f"offset_m {self.offset_m} is not accepted: three numbers within 10 km are")
        check_fields(
            self,
            require_not_negative,
            but={"gain_1_s": require_positive},
            unlimited=("max_distance_m",),
            unchecked=("offset_m",),
        )
