"""The published magnetic map of a survey, read from a file.

The file is a numpy `.npz` archive, in the format "flightstack-magnetic-map-1": grid lines `north_m` (rows,)
and `east_m` (columns,) from the map's home, `total_field_nt` (rows, columns) with NaN where there is no data,
`height_m`, the height above home at which the map is valid, its home (`home_lat_deg`, `home_lon_deg`,
`home_alt_m`), and, if they are known, `vertical_gradient_nt_m` (rows, columns), the change with height,
`error_nt`, the standard deviation of the field stated by the survey, and `line_spacing_m`, the distance
between its lines.
"""

import math
import tokenize
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from estimators.occupancy.detection import MapError
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

Array = NDArray[np.float64]

FORMAT: Final = "flightstack-magnetic-map-1"
# errors that zipfile, zlib and numpy's reader of array headers raise for damaged files
_UNREADABLE: Final = (
    *(EOFError, zipfile.BadZipFile, zlib.error, RuntimeError, MemoryError),
    *(ValueError, TypeError, SyntaxError, tokenize.TokenError),
)
_NEEDED: Final = (
    "format",
    "north_m",
    "east_m",
    "total_field_nt",
    "height_m",
    "home_lat_deg",
    "home_lon_deg",
    "home_alt_m",
)
_STATED: Final = ("error_nt", "line_spacing_m")
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
        row = np.interp(north_m, self.north_m, np.arange(self.north_m.size), left=np.nan, right=np.nan)
        column = np.interp(east_m, self.east_m, np.arange(self.east_m.size), left=np.nan, right=np.nan)
        if not math.isfinite(row + column):
            return math.nan
        i = min(int(row), self.north_m.size - 2)
        j = min(int(column), self.east_m.size - 2)
        v, u = float(row) - i, float(column) - j
        weights = np.array([[(1.0 - v) * (1.0 - u), (1.0 - v) * u], [v * (1.0 - u), v * u]])
        corners = np.s_[i : i + 2, j : j + 2]
        gradient = float(np.sum(weights * self.vertical_gradient_nt_m[corners]))
        return float(np.sum(weights * self.total_field_nt[corners])) + gradient * (height_m - self.height_m)

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
        # not np.load, which treats a file that is not an archive as a pickle, and advises to trust it
        with zipfile.ZipFile(path) as archive:
            found = {}
            for name in archive.namelist():
                with archive.open(name) as file:
                    found[name.removesuffix(".npy")] = np.lib.format.read_array(file, allow_pickle=False)
    except OSError as error:
        raise EstimatorError(f"`map_file` {path} can't be read: {error.strerror or error}") from None
    except _UNREADABLE as error:
        why = str(error) or type(error).__name__
        raise EstimatorError(
            f"`map_file` {path} is not a magnetic map (a numpy .npz archive): {why}"
        ) from None
    missing = [name for name in _NEEDED if name not in found]
    if missing:
        raise EstimatorError(f"`map_file` {path} is not a magnetic map: it has no {', '.join(missing)}")
    if str(found["format"]) != FORMAT:
        raise EstimatorError(f"`map_file` {path} has the format {found['format']}; accepted is {FORMAT}")
    north_m, east_m, total_nt = (
        _numbers(path, name, found[name]) for name in ("north_m", "east_m", "total_field_nt")
    )
    gradient = _numbers(
        path, "vertical_gradient_nt_m", found.get("vertical_gradient_nt_m", np.zeros(total_nt.shape))
    )
    height_m, lat_deg, lon_deg, alt_m = (_number(path, name, found[name]) for name in _NEEDED[4:])
    stated = {name: _number(path, name, found[name]) for name in _STATED if name in found}
    for name, value in stated.items():
        if not (math.isfinite(value) and value > 0.0):
            raise EstimatorError(f"`map_file` {path}: {name} {value:g} is not accepted; more than 0 is")
    shape = (north_m.size, east_m.size)
    rising = all(
        lines.ndim == 1 and lines.size >= 2 and bool(np.all(np.diff(lines) > 0.0))
        for lines in (north_m, east_m)
    )
    if not rising or total_nt.shape != shape or gradient.shape != shape:
        raise EstimatorError(
            f"`map_file` {path}: its grid of {total_nt.shape} does not fit {north_m.size} rising lines "
            "north and "
            f"{east_m.size} east"
        )
    if not np.any(np.isfinite(total_nt)) or np.any(np.isinf(total_nt)):
        raise EstimatorError(f"`map_file` {path} has no data: total_field_nt needs finite numbers")
    if not np.all(np.isfinite(gradient[np.isfinite(total_nt)])):
        raise EstimatorError(
            f"`map_file` {path}: vertical_gradient_nt_m has no number at places where total_field_nt has "
            "one; "
            "leave it out, or fill it"
        )
    if not (math.isfinite(height_m + alt_m) and abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0):
        raise EstimatorError(
            f"`map_file` {path}: height {height_m}, home {lat_deg}, {lon_deg}, {alt_m} are not a place"
        )
    return SurveyMap(
        north_m=north_m,
        east_m=east_m,
        total_field_nt=total_nt,
        vertical_gradient_nt_m=gradient,
        height_m=height_m,
        home=GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m),
        **stated,
    )


def _numbers(path: Path, name: str, values: Array) -> Array:
    """Read an array of the file as real numbers."""
    if values.dtype.kind not in "iuf":
        raise EstimatorError(f"`map_file` {path}: {name} holds {values.dtype} and no real numbers")
    return values.astype(np.float64)


def _number(path: Path, name: str, values: Array) -> float:
    """Read a single number of the file."""
    if values.size != 1:
        raise EstimatorError(
            f"`map_file` {path}: {name} has the shape {values.shape}; it is to be one number"
        )
    return float(_numbers(path, name, values).reshape(()))
