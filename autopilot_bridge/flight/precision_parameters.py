"""Parameters of a landing at a detected target: PX4's PLD_*, ArduPilot's PLND_*."""

import math
from dataclasses import dataclass
from enum import IntEnum

from flightsim.foundation.checks import check_fields, require_not_negative


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
class PrecisionParameters:
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
    wait_s: float = 5.0
    align_m: float = 0.2
    final_m: float = 0.1
    greatest_m: float = 1e4
    search_m: float = 10.0
    search_s: float = 10.0
    searches: int = 3
    lost: TargetLost = TargetLost.SEARCH

    def __post_init__(self) -> None:
        unchecked = ("search_m",) if math.isnan(self.search_m) else ()
        check_fields(self, require_not_negative, unchecked=unchecked)
