"""Landing at a target that is seen: PX4's PLD_*, ArduPilot's PLND_*."""

import math
from dataclasses import dataclass
from enum import IntEnum

from flightsim.checks import check_fields, require_not_negative


class Precision(IntEnum):
    """Whether a landing looks for a target (PRECISION_LAND_MODE)."""

    NONE = 0
    OPPORTUNISTIC = 1  # when it is seen; else a plain landing
    REQUIRED = 2  # it is searched


class TargetLost(IntEnum):
    """What is done when the target isn't seen (PLND_STRICT; PX4 searches)."""

    LAND = 0  # where the vehicle is
    SEARCH = 1  # climb, look for it a few times, then land
    HOVER = 2  # stay above, until it is seen


@dataclass(frozen=True, slots=True, kw_only=True)
class PrecisionParameters:
    """How a precision landing goes.

    Attributes:
        enabled: LAND looks for a target by itself (PLND_ENABLED); PX4 only where a mode or an item asks.
        wait_s: the target not seen for this long while going down: lost (PLD_BTOUT, PLND_TIMEOUT).
        align_m: nearer than this above the target the vehicle goes down (PLD_HACC_RAD, PLND_XY_DIST_MAX).
        final_m: below this height it goes down whatever is seen (PLD_FAPPR_ALT, PLND_ALT_MIN).
        greatest_m: above this height no target is looked for (PLND_ALT_MAX).
        search_m: height over home from which it is searched (PLD_SRCH_ALT); NaN: the height it was lost at.
        search_s: how long (PLD_SRCH_TOUT).
        searches: how often (PLD_MAX_SRCH, PLND_RET_MAX).
        lost: what follows when it isn't seen.
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
