"""Parameters of planners that look some steps ahead."""

import math
from dataclasses import dataclass
from enum import StrEnum

from missions.errors import PlanError


class Exploration(StrEnum):
    """What the exploration of a scan is."""

    VIEW = "view"
    """The expected number of targets that it detects for the first time."""
    PLACE = "place"
    """The exploration map at the place of the vehicle (the paper's equation 14)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerParameters:
    """Parameters of the exploring planner.

    Attributes:
        step_m: distance to the next scan; also along the diagonals (paper: 9 m).
        alpha: weight of the exploration against the information, nats (not given in the paper).
        exploration: what the exploration of a scan is.
        horizon: number of steps that are planned; the first one is flown.
        beam: number of sequences of steps that are kept at each depth.
        discount: weight of a step against the one before it.
        turn_limit_rad: largest change of the direction of flight in a step; pi: any.
    """

    step_m: float = 9.0
    alpha: float = 1.0
    exploration: Exploration = Exploration.PLACE
    horizon: int = 1
    beam: int = 6
    discount: float = 0.9
    turn_limit_rad: float = math.pi

    def __post_init__(self) -> None:
        if not (math.isfinite(self.step_m) and self.step_m > 0.0):
            raise PlanError(f"`step_m` {self.step_m:g} is not possible; ask for more than 0")
        if not (math.isfinite(self.alpha) and self.alpha >= 0.0):
            raise PlanError(f"`alpha` {self.alpha:g} is not possible; ask for 0 or more")
        if not 1 <= self.horizon <= 8:
            raise PlanError(f"`horizon` {self.horizon} is not in 1..8")
        if not 1 <= self.beam <= 100:
            raise PlanError(f"`beam` {self.beam} is not in 1..100")
        if not 0.0 < self.discount <= 1.0:
            raise PlanError(f"discount {self.discount:g} is not in 0..1, or is 0")
        if not 0.25 * math.pi <= self.turn_limit_rad <= math.pi:
            raise PlanError(
                f"turn_limit_rad {math.degrees(self.turn_limit_rad):g} degrees is not in 45..180 degrees"
            )
