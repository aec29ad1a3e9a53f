"""The grid over an area for which a map or terrain is made."""

import math
from dataclasses import dataclass
from typing import Final

from flightsim.foundation.checks import Positive
from flightsim.foundation.options import Options

_MAX_POINTS: Final = 4_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class AreaGrid(Options):
    """Points at equal distances. Edges are local NED of home.

    Attributes:
        south_m, west_m, north_m, east_m: edges; the northern and eastern ones are moved out to the next line.
        spacing_m: distance of the grid lines.
    """

    south_m: float
    west_m: float
    north_m: float
    east_m: float
    spacing_m: Positive

    def check_together(self) -> None:
        for low, high, names in (
            (self.south_m, self.north_m, "south_m and north_m"),
            (self.west_m, self.east_m, "west_m and east_m"),
        ):
            if not high - low >= self.spacing_m:
                raise ValueError(
                    f"{names} = {low}, {high} are not accepted: apart by {self.spacing_m} m or more is"
                )
        rows, columns = self.shape
        if rows * columns > _MAX_POINTS:
            raise ValueError(
                f"spacing_m = {self.spacing_m} is not accepted: it makes {rows} x {columns} points; "
                f"up to {_MAX_POINTS} are"
            )

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return (
            math.ceil((self.north_m - self.south_m) / self.spacing_m - 1e-9) + 1,
            math.ceil((self.east_m - self.west_m) / self.spacing_m - 1e-9) + 1,
        )
