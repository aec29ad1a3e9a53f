"""Parameters of planners that look some steps ahead."""

import math
from dataclasses import dataclass
from enum import StrEnum

from flightsim.foundation.options import option
from missions.base.options import PlanOptions


class Exploration(StrEnum):
    """What the exploration of a scan is."""

    VIEW = "view"
    """The expected number of targets that it detects for the first time."""
    PLACE = "place"
    """The exploration map at the place of the vehicle (the paper's equation 14)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerParameters(PlanOptions):
    """Parameters of the exploring planner. The defaults are the paper's."""

    step_m: float = option(9.0, above=0.0, help="Distance to the next scan, also along the diagonals.")
    alpha: float = option(1.0, least=0.0, help="Weight of exploration against information, nats.")
    exploration: Exploration = option(
        Exploration.PLACE, help="Exploration of a scan: targets that it detects first, or the map's (paper)."
    )
    horizon: int = option(1, least=1, most=8, help="Number of steps that are planned; 1: greedy.")
    beam: int = option(6, least=1, most=100, help="Sequences of steps that are kept at each depth.")
    discount: float = option(0.9, above=0.0, most=1.0, help="Weight of a step against the one before it.")
    turn_limit_rad: float = option(
        math.pi, least=0.25 * math.pi, most=math.pi, help="Largest change of direction in a step."
    )
