"""The searched rectangle."""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, Protocol

from flightsim.foundation.geodetic_position import NorthEast
from flightsim.foundation.options import Shown
from missions.errors import PlanError

if TYPE_CHECKING:
    from estimators.scene_items import Line

EDGES: Final = Shown(
    fields=("south_m", "west_m", "north_m", "east_m"),
    together=True,
    metavar="SOUTH,WEST,NORTH,EAST",
    help="Edges of the searched area, m from the first vehicle's home.",
)
"""The edges of an area that an estimator's parameters have, as one option."""


def edges(area_m: tuple[float, float, float, float]) -> dict[str, Any]:
    """The edges south, west, north and east as fields of an estimator's parameters."""
    return dict(zip(EDGES.fields, area_m, strict=True))


class Edges(Protocol):
    """Parameters that have the edges of an area."""

    @property
    def south_m(self) -> float: ...
    @property
    def west_m(self) -> float: ...
    @property
    def north_m(self) -> float: ...
    @property
    def east_m(self) -> float: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Area:
    """The searched rectangle, metres from the origin."""

    south_m: float
    west_m: float
    north_m: float
    east_m: float

    def __post_init__(self) -> None:
        edges = (self.south_m, self.west_m, self.north_m, self.east_m)
        if not (all(map(math.isfinite, edges)) and self.north_m > self.south_m and self.east_m > self.west_m):
            raise PlanError(
                f"`area_m` {','.join(f'{edge:g}' for edge in edges)} is not an area; "
                "give SOUTH,WEST,NORTH,EAST"
            )

    @classmethod
    def of(cls, edges: Edges) -> "Area":
        """The area of parameters that have its edges."""
        return cls(south_m=edges.south_m, west_m=edges.west_m, north_m=edges.north_m, east_m=edges.east_m)

    @property
    def shown(self) -> "Line":
        """The area for viewers."""
        from estimators.scene_items import Line  # imports NumPy, which help texts do without

        return Line.rectangle(
            south_m=self.south_m,
            west_m=self.west_m,
            north_m=self.north_m,
            east_m=self.east_m,
            label="searched area",
        )

    def check_sides(self, largest_m: float) -> None:
        """Refuse sides that are longer."""
        for side_m in (self.height_m, self.width_m):
            if not side_m <= largest_m:
                raise PlanError(f"`area_m` has a side of {side_m:g} m; accepted: up to {largest_m:g} m")

    def contains(self, north_m: float, east_m: float) -> bool:
        """Whether a place is inside, edges included."""
        return self.south_m <= north_m <= self.north_m and self.west_m <= east_m <= self.east_m

    def nearest(self, north_m: float, east_m: float) -> NorthEast:
        """The place inside that is nearest to a place."""
        return (min(max(north_m, self.south_m), self.north_m), min(max(east_m, self.west_m), self.east_m))

    def strip(self, index: int, count: int) -> "Area":
        """One of `count` equal strips of the longer side, from the south or from the west."""
        if self.height_m >= self.width_m:
            side_m = self.height_m / count
            south_m = self.south_m + index * side_m
            return replace(self, south_m=south_m, north_m=south_m + side_m)
        side_m = self.width_m / count
        west_m = self.west_m + index * side_m
        return replace(self, west_m=west_m, east_m=west_m + side_m)

    @property
    def centre_ne_m(self) -> NorthEast:
        return 0.5 * (self.south_m + self.north_m), 0.5 * (self.west_m + self.east_m)

    @property
    def height_m(self) -> float:
        return self.north_m - self.south_m

    @property
    def width_m(self) -> float:
        return self.east_m - self.west_m
