"""What is true in the world of a vision search, and the mission does not know."""

import math
from dataclasses import dataclass

from flightsim.foundation.options import option
from missions.base.options import PlanOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class HiddenTag(PlanOptions):
    """The true target, and what is wrong with the cameras."""

    place_ne_m: tuple[float, float] | None = option(
        None, name="target", metavar="NORTH,EAST", varies="drawn", help="True place of the target, m."
    )
    speed_m_s: float = option(
        0.0, least=0.0, most=15.0, name="target-speed", help="Speed of the target's random walk; 0: it stays."
    )
    misalignment_rad: float = option(
        math.radians(0.3),
        least=0.0,
        most=math.radians(10.0),
        help="Standard deviation of the cameras' true angles on their mounts.",
    )
    film: bool = option(
        False, help="Lossless video of each camera's pictures, for `flightstack vision`; slow and large."
    )
