"""The published magnetic map of a survey, read from a file (`flightsim.foundation.magnetic_map_file`)."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from estimators.occupancy.detection import MapError
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.kernels import kernel
from flightsim.foundation.magnetic_map_file import MagneticMapError, read_map_file

Array = NDArray[np.float64]

_USUAL_ERROR_NT: Final = 1.0  # error of a map that states none
_USUAL_LINES_M: Final = 200.0
_SHARE_OF_LINES: Final = 0.5  # of the line spacing: correlation distance of a map's error


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurveyMap:
    """Total field on a grid.

    Attributes:
        north_m, east_m: (rows,), (columns,) grid lines from the map's home, ascending.
        total_field_nt: (rows, columns); NaN where there is no data.
        vertical_gradient_nt_m: (rows, columns), upwards; zeros if it is not known.
        height_m: height above home at which the map is valid.
        home: origin of the map's frame.
        error_nt: standard deviation stated by the survey; None: not stated.
        line_spacing_m: distance between the survey's lines; None: not stated.
    """

    north_m: Array
    east_m: Array
    total_field_nt: Array
    vertical_gradient_nt_m: Array
    height_m: float
    home: GeodeticPosition
    error_nt: float | None = None
    line_spacing_m: float | None = None

    def total_nt(self, north_m: float, east_m: float, height_m: float) -> float:
        """Field at a place and height from the map's home, bilinear; NaN without data."""
        above_m = height_m - self.height_m
        return float(
            _total_nt(
                *(self.north_m, self.east_m, self.total_field_nt, self.vertical_gradient_nt_m),
                *(north_m, east_m, above_m),
            )
        )

    def totals_nt(self, north_m: Array, east_m: Array, height_m: Array) -> Array:
        """Field (n,) at places and heights (n,) from the map's home, bilinear; NaN without data."""
        row, column = (
            np.interp(place, lines, np.arange(lines.size), left=np.nan, right=np.nan)
            for place, lines in ((north_m, self.north_m), (east_m, self.east_m))
        )
        inside = np.isfinite(row + column)
        i = np.minimum(np.where(inside, row, 0.0).astype(np.int64), self.north_m.size - 2)
        j = np.minimum(np.where(inside, column, 0.0).astype(np.int64), self.east_m.size - 2)
        v, u = row - i, column - j

        def between(grid: Array) -> Array:
            south = (1.0 - u) * grid[i, j] + u * grid[i, j + 1]
            north = (1.0 - u) * grid[i + 1, j] + u * grid[i + 1, j + 1]
            found: Array = (1.0 - v) * south + v * north
            return found

        return between(self.total_field_nt) + between(self.vertical_gradient_nt_m) * (
            height_m - self.height_m
        )

    def frame(self) -> LocalFrame:
        """The map's local frame."""
        return LocalFrame(self.home)

    def require_data(
        self, *, south_m: float, north_m: float, west_m: float, east_m: float, what: str
    ) -> None:
        """Refuse an area that the map doesn't cover completely.

        Raises:
            EstimatorError: names the area that the map covers.
        """
        inside = (
            self.north_m[0] <= south_m
            and north_m <= self.north_m[-1]
            and self.west_m <= west_m
            and east_m <= self.east_m[-1]
        )
        if inside:
            rows = slice(
                int(np.searchsorted(self.north_m, south_m, "right")) - 1,
                int(np.searchsorted(self.north_m, north_m, "left")) + 1,
            )
            columns = slice(
                int(np.searchsorted(self.east_m, west_m, "right")) - 1,
                int(np.searchsorted(self.east_m, east_m, "left")) + 1,
            )
            if np.all(np.isfinite(self.total_field_nt[rows, columns])):
                return
        why = "has no data in part of it" if inside else "does not cover it"
        raise EstimatorError(
            f"{what}, north {south_m:.0f} to {north_m:.0f} m and east {west_m:.0f} to {east_m:.0f} m: the "
            f"magnetic map {why}; it reaches from north {self.north_m[0]:.0f} to {self.north_m[-1]:.0f} m, "
            f"east {self.east_m[0]:.0f} to {self.east_m[-1]:.0f} m. Give a smaller `width_m, height_m` or "
            "another `map_file`"
        )

    @property
    def west_m(self) -> float:
        """Western edge."""
        return float(self.east_m[0])


@kernel
def _total_nt(
    rows_m: Array,
    columns_m: Array,
    total_field_nt: Array,
    gradient_nt_m: Array,
    north_m: float,
    east_m: float,
    above_m: float,
) -> float:
    """`SurveyMap.total_nt` at a height above that of the map."""
    row, column = _place_on(rows_m, north_m), _place_on(columns_m, east_m)
    if not math.isfinite(row + column):
        return math.nan
    i = min(int(row), rows_m.size - 2)
    j = min(int(column), columns_m.size - 2)
    v, u = row - i, column - j
    weights = ((1.0 - v) * (1.0 - u), (1.0 - v) * u, v * (1.0 - u), v * u)
    total = gradient = 0.0
    for k in range(4):
        total += weights[k] * total_field_nt[i + k // 2, j + k % 2]
        gradient += weights[k] * gradient_nt_m[i + k // 2, j + k % 2]
    return total + gradient * above_m


@kernel
def _place_on(lines_m: Array, place_m: float) -> float:
    """Broken number of the grid line (n,) at a place; NaN beyond the lines."""
    last = lines_m.size - 1
    if not lines_m[0] <= place_m <= lines_m[last]:
        return math.nan
    k = np.searchsorted(lines_m, place_m, "right") - 1
    return float(last) if k == last else k + (place_m - lines_m[k]) * (1.0 / (lines_m[k + 1] - lines_m[k]))


def map_error_of(survey_map: SurveyMap, given_nt: float | None = None) -> MapError:
    """Error of a published map: as given, else as the map states it, else that of a careful survey."""
    stated_nt = survey_map.error_nt if given_nt is None else given_nt
    spacing_m = survey_map.line_spacing_m or _USUAL_LINES_M
    return MapError(
        sigma_nt=_USUAL_ERROR_NT if stated_nt is None else stated_nt,
        correlation_m=_SHARE_OF_LINES * spacing_m,
    )


def load_survey_map(path: Path) -> SurveyMap:
    """Read a published map.

    Raises:
        EstimatorError: the file does not exist or is not a map, or the map has no data.
    """
    try:
        found = read_map_file(path)
    except MagneticMapError as error:
        raise EstimatorError(f"`map_file` {error}") from None
    gradient = found.vertical_gradient_nt_m
    return SurveyMap(
        north_m=found.north_m,
        east_m=found.east_m,
        total_field_nt=found.total_field_nt,
        vertical_gradient_nt_m=np.zeros(found.total_field_nt.shape) if gradient is None else gradient,
        height_m=found.height_m,
        home=found.home,
        error_nt=found.error_nt,
        line_spacing_m=found.line_spacing_m,
    )
