"""What is true in the world of a search for a tag, and the mission does not know."""

from dataclasses import dataclass

from flightsim.foundation.options import option
from missions.base.options import PlanOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class TagTarget(PlanOptions):
    """The target: a vehicle with a tag on top.

    Attributes:
        free_m: side of the square around the centre in which it does not start (paper: 10 m).
    """

    speed_m_s: float = option(
        0.3, least=0.0, most=15.0, name="target-speed", help="Speed of the target's random walk; 0: it stays."
    )
    size_m: float = option(
        0.3, least=0.01, most=100.0, name="tag-size", help="Side of the tag's black square."
    )
    free_m: float = option(10.0, least=0.0)
