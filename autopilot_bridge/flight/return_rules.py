"""The parameters that define the target of a return."""

import math
from dataclasses import dataclass
from enum import IntEnum


class ReturnDestination(IntEnum):
    """The possible targets of a return: PX4 RTL_TYPE | ArduPilot RTL_AUTOLAND. Rally points are
    `RallyRule`'s.
    """

    HOME = 0  # circle over home; land by `return_loiter_time_s` (RTL_TYPE 0)
    LANDING_SEQUENCE = 1  # straight to the plan's landing sequence (RTL_AUTOLAND 2)
    HOME_THEN_LANDING_SEQUENCE = 2  # over home first (RTL_AUTOLAND 1)
    CLOSEST = 3  # home or the landing sequence, whichever is closer (RTL_TYPE 3)
    ALONG_PLAN = 4  # along the plan to its landing, or back along it to home (RTL_TYPE 2)
    ALONG_PLAN_SHORTER = 5  # whichever way along the plan has fewer waypoints (RTL_TYPE 4)
    LANDING_OR_RALLY = 6  # the landing sequence or a rally point, home only without either (RTL_TYPE 1)


ALONG_PLAN = (ReturnDestination.ALONG_PLAN, ReturnDestination.ALONG_PLAN_SHORTER)


@dataclass(frozen=True, slots=True, kw_only=True)
class RallyRule:
    """Which rally points a return considers.

    Attributes:
        used: rally points are considered at all.
        home_competes: home is used when it is closer (PX4 RTL_TYPE 0 and 3 | RALLY_INCL_HOME).
        limit_m: points farther away are not used (RALLY_LIMIT_KM); infinite: no limit.
        within_fence: only those inside the geofence (ArduCopter).
        altitude_is_ground: a point's altitude is that of its ground, and the return's heights are over it
            (PX4); else it is the return altitude (ArduPilot).
    """

    used: bool = True
    home_competes: bool = True
    limit_m: float = math.inf
    within_fence: bool = False
    altitude_is_ground: bool = True

    def __post_init__(self) -> None:
        if not self.limit_m > 0.0:
            raise ValueError(f"limit_m = {self.limit_m} is not positive")
