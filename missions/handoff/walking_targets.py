"""What is true in the world of a handoff, and the aircraft do not know."""

from dataclasses import dataclass
from enum import StrEnum

from flightsim.foundation.options import option
from missions.base.options import PlanOptions
from missions.errors import PlanError


class PointSource(StrEnum):
    """Where the moving points of a camera come from."""

    POINTS = "points"
    """From a model."""
    PIXELS = "pixels"
    """Found in rendered pictures, in which the targets are persons."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkingTargets(PlanOptions):
    """The targets as they truly are, and how the cameras see them.

    Attributes:
        area_m: sides of the area in which they walk, north and east (paper: 140 m by 270 m), around the place
            that the operator has reported.
        walk_m_s: least and greatest speed.
    """

    count: int = option(5, least=1, most=50, name="targets", help="Number of walking targets (paper: 5).")
    area_m: tuple[float, float] = option((140.0, 270.0), least=10.0, most=10_000.0)
    walk_m_s: tuple[float, float] = (0.8, 2.0)
    camera: PointSource = option(
        PointSource.POINTS, help="Source of the moving points: a model, or rendered pictures; slow."
    )
    film: bool = option(
        False, help="Lossless videos of the cameras' pictures, for `flightstack vision`; large."
    )

    def check_together(self) -> None:
        if self.film and self.camera is not PointSource.PIXELS:
            raise PlanError("`film` keeps pictures, and the cameras take none; ask for `camera=pixels`")
