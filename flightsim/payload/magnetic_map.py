"""A magnetic map: total field on a regular grid, as a survey publishes it.

The file is a numpy `.npz` archive that needs nothing of this package to be read:

    format                  "flightstack-magnetic-map-1"
    north_m  (rows,)        grid lines, metres north of home, evenly spaced, rising
    east_m   (columns,)     metres east of home, likewise
    total_field_nt          (rows, columns) float64; NaN: no data there
    vertical_gradient_nt_m  (rows, columns) change of the total field with height, upwards; absent: not known
    height_m                height above home that the map is valid at
    home_lat_deg, home_lon_deg, home_alt_m   the home whose local frame it is in
    error_nt                stated standard deviation of total_field_nt; absent: not stated
    line_spacing_m          distance of the survey's lines, across which the error changes; absent: not stated

Between grid points it is interpolated bilinearly in both arrays. A reading at a height h compares with
total_field_nt + vertical_gradient_nt_m * (h - height_m).
"""

import math
import tokenize
import zipfile
import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel
from flightsim.home import Home

Array = NDArray[np.float64]

FORMAT: Final = "flightstack-magnetic-map-1"
# What zipfile, zlib and numpy's reader of array headers raise for spoiled bytes.
_UNREADABLE: Final = (
    *(OSError, EOFError, zipfile.BadZipFile, zlib.error, RuntimeError, MemoryError),
    *(ValueError, TypeError, SyntaxError, tokenize.TokenError),
)
_STATED: Final = ("error_nt", "line_spacing_m")
_CSV_HEADER: Final = "north_m,east_m,total_field_nt"


class MagneticMapError(ValueError):
    """A map that can't be used; the message gives the reason."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MagneticMap:
    """Total field on a grid in the local frame of a home.

    Attributes:
        north_m, east_m: (rows,), (columns,) grid lines, evenly spaced and rising.
        total_field_nt: (rows, columns); NaN where there is no data.
        vertical_gradient_nt_m: (rows, columns) upward derivative; None: not known, taken as zero.
        height_m: above home, what the map is valid at.
        home: origin of its frame.
        error_nt: standard deviation of `total_field_nt` as the survey states it; None: not stated.
        line_spacing_m: distance of the survey's lines; None: not stated.
    """

    north_m: Array
    east_m: Array
    total_field_nt: Array
    height_m: float
    home: Home
    vertical_gradient_nt_m: Array | None = None
    error_nt: float | None = None
    line_spacing_m: float | None = None

    def __post_init__(self) -> None:
        for name, lines in (("north_m", self.north_m), ("east_m", self.east_m)):
            steps = np.diff(lines)
            if lines.ndim != 1 or lines.size < 2 or not np.all(steps > 0.0):
                raise MagneticMapError(f"{name} of a magnetic map: accepted are two or more rising numbers")
            if not np.allclose(steps, steps.mean(), rtol=1e-6):
                raise MagneticMapError(
                    f"{name} of a magnetic map is spaced {steps.min():g} to {steps.max():g} m; "
                    "accepted is even spacing"
                )
        shape = (self.north_m.size, self.east_m.size)
        for name, grid in (
            ("total_field_nt", self.total_field_nt),
            ("vertical_gradient_nt_m", self.vertical_gradient_nt_m),
        ):
            if grid is not None and grid.shape != shape:
                raise MagneticMapError(
                    f"{name} of a magnetic map has shape {grid.shape}; its grid lines make {shape}"
                )
        if np.any(np.isinf(self.total_field_nt)) or not np.any(np.isfinite(self.total_field_nt)):
            raise MagneticMapError("a magnetic map without data: total_field_nt needs finite numbers")
        gradient = self.vertical_gradient_nt_m
        if gradient is not None and not np.all(np.isfinite(gradient[np.isfinite(self.total_field_nt)])):
            raise MagneticMapError(
                "vertical_gradient_nt_m of a magnetic map has no number at places where the total field has"
            )
        if not math.isfinite(self.height_m):
            raise MagneticMapError(f"height_m = {self.height_m} of a magnetic map is not finite")
        for name, value in (("error_nt", self.error_nt), ("line_spacing_m", self.line_spacing_m)):
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise MagneticMapError(f"{name} = {value} of a magnetic map is not accepted: more than 0 is")

    @property
    def spacing_m(self) -> tuple[float, float]:
        """Distance of the grid lines, north and east."""
        return (
            float(self.north_m[-1] - self.north_m[0]) / (self.north_m.size - 1),
            float(self.east_m[-1] - self.east_m[0]) / (self.east_m.size - 1),
        )

    def contains(self, north_m: float, east_m: float) -> bool:
        """Whether the map has data at a place: inside its edges, and no corner of the cell missing."""
        return math.isfinite(self.total_at_nt(north_m, east_m))

    def require_inside(self, what: str, north_m: float, east_m: float) -> None:
        """Refuse a position without data in the map.

        Raises:
            MagneticMapError: it names `what`, the place and what the map covers.
        """
        if not self.contains(north_m, east_m):
            raise MagneticMapError(
                f"{what} at north {north_m:g} m, east {east_m:g} m is outside the magnetic map, which covers "
                f"north {self.north_m[0]:g} to {self.north_m[-1]:g} m, "
                f"east {self.east_m[0]:g} to {self.east_m[-1]:g} m where it has data"
            )

    def total_at_nt(self, north_m: float, east_m: float) -> float:
        """Total field at a place, at the map's height; NaN where there is no data."""
        return float(
            bilinear(
                self.total_field_nt,
                (north_m - float(self.north_m[0])) / self.spacing_m[0],
                (east_m - float(self.east_m[0])) / self.spacing_m[1],
            )
        )

    def interpolate(self, north_m: Array, east_m: Array, height_m: float | None = None) -> Array:
        """Total field at places of any shape; NaN where there is no data.

        Args:
            north_m, east_m: local NED of home.
            height_m: above home; None: the map's height.
        """
        total = self._bilinear(self.total_field_nt, north_m, east_m)
        if height_m is None or self.vertical_gradient_nt_m is None:
            return total
        gradient = self._bilinear(self.vertical_gradient_nt_m, north_m, east_m)
        return total + gradient * (height_m - self.height_m)

    def _bilinear(self, grid: Array, north_m: Array, east_m: Array) -> Array:
        row_step_m, column_step_m = self.spacing_m
        rows, columns = np.broadcast_arrays(
            (np.asarray(north_m, dtype=np.float64) - self.north_m[0]) / row_step_m,
            (np.asarray(east_m, dtype=np.float64) - self.east_m[0]) / column_step_m,
        )
        out = np.empty(rows.size)
        _bilinear_many(grid, rows.ravel(), columns.ravel(), out)
        return out.reshape(rows.shape)

    def without_holes(self) -> "MagneticMap":
        """The same map with missing points filled from their nearest neighbours, for a field without end."""
        if np.all(np.isfinite(self.total_field_nt)):
            return self
        gradient = self.vertical_gradient_nt_m
        return replace(
            self,
            total_field_nt=_fill(self.total_field_nt),
            vertical_gradient_nt_m=None if gradient is None else _fill(gradient),
        )

    def save(self, path: Path) -> None:
        """Write the map; the file's contents are described at the head of this module."""
        contents: dict[str, Any] = {
            "format": FORMAT,
            "north_m": self.north_m,
            "east_m": self.east_m,
            "total_field_nt": self.total_field_nt,
            "height_m": self.height_m,
            "home_lat_deg": self.home.lat_deg,
            "home_lon_deg": self.home.lon_deg,
            "home_alt_m": self.home.alt_m,
        }
        if self.vertical_gradient_nt_m is not None:
            contents["vertical_gradient_nt_m"] = self.vertical_gradient_nt_m
        for name in _STATED:
            if getattr(self, name) is not None:
                contents[name] = getattr(self, name)
        # Like numpy.savez_compressed, but without the time of day: the same map gives the same bytes.
        with zipfile.ZipFile(path, "w", compression=zipfile.ZIP_DEFLATED) as archive:
            for name, value in contents.items():
                member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
                member.compress_type = zipfile.ZIP_DEFLATED
                with archive.open(member, "w", force_zip64=True) as file:
                    np.lib.format.write_array(file, np.asanyarray(value), allow_pickle=False)

    @classmethod
    def load(cls, path: Path) -> "MagneticMap":
        """Read a map that `save` has written.

        Raises:
            MagneticMapError: no such file, or not such a file.
        """
        try:
            with zipfile.ZipFile(path) as archive:
                found = {}
                for name in archive.namelist():
                    with archive.open(name) as file:
                        found[name.removesuffix(".npy")] = np.lib.format.read_array(file, allow_pickle=False)
        except _UNREADABLE as error:
            raise MagneticMapError(f"{path} is not a magnetic map (.npz): {error}") from None
        needed = (
            *("format", "north_m", "east_m", "total_field_nt", "height_m"),
            *("home_lat_deg", "home_lon_deg", "home_alt_m"),
        )
        missing = [name for name in needed if name not in found]
        if missing or str(found["format"]) != FORMAT:
            raise MagneticMapError(
                f"{path} is not a magnetic map: "
                + (f"it has no {', '.join(missing)}" if missing else f"its format is {found['format']}")
                + f"; accepted is format {FORMAT}"
            )
        gradient = found.get("vertical_gradient_nt_m")
        try:
            return cls(
                north_m=found["north_m"].astype(np.float64),
                east_m=found["east_m"].astype(np.float64),
                total_field_nt=found["total_field_nt"].astype(np.float64),
                vertical_gradient_nt_m=None if gradient is None else gradient.astype(np.float64),
                height_m=float(found["height_m"]),
                **{name: float(found[name]) for name in _STATED if name in found},
                home=Home(
                    lat_deg=float(found["home_lat_deg"]),
                    lon_deg=float(found["home_lon_deg"]),
                    alt_m=float(found["home_alt_m"]),
                ),
            )
        except (TypeError, ValueError) as error:
            raise MagneticMapError(f"{path}: {error}") from None

    @classmethod
    def load_csv(cls, path: Path, *, home: Home, height_m: float) -> "MagneticMap":
        """Read a grid from a table with the header `north_m,east_m,total_field_nt`, in any order of lines.

        Points of the grid that have no line, or an empty or nan value, have no data.

        Raises:
            MagneticMapError: no such file, or not such a table.
        """
        rows_of_text: list[tuple[float, float, float]] = []
        try:
            with path.open(encoding="utf-8") as file:
                header = file.readline().strip()
                if header != _CSV_HEADER:
                    raise MagneticMapError(
                        f"{path} begins with {header[:60]!r}; accepted is the header {_CSV_HEADER!r}"
                    )
                for number, line in enumerate(file, 2):
                    if line.strip():
                        rows_of_text.append(_csv_row(line, path, number))
        except (OSError, UnicodeDecodeError) as error:
            raise MagneticMapError(f"{path}: {error}") from None
        if not rows_of_text:
            raise MagneticMapError(f"{path} has a header and no lines")
        table = np.array(rows_of_text)
        north_m, rows = np.unique(table[:, 0], return_inverse=True)
        east_m, columns = np.unique(table[:, 1], return_inverse=True)
        total = np.full((north_m.size, east_m.size), np.nan)
        total[rows, columns] = table[:, 2]
        try:
            return cls(north_m=north_m, east_m=east_m, total_field_nt=total, height_m=height_m, home=home)
        except MagneticMapError as error:
            raise MagneticMapError(f"{path}: {error}") from None


def _csv_row(line: str, path: Path, number: int) -> tuple[float, float, float]:
    cells = line.split(",")
    try:
        north_m, east_m = float(cells[0]), float(cells[1])
        total_nt = float(cells[2]) if cells[2].strip() else math.nan
    except (ValueError, IndexError):
        total_nt = math.inf
    if len(cells) != 3 or math.isinf(total_nt) or not (math.isfinite(north_m) and math.isfinite(east_m)):
        raise MagneticMapError(
            f"{path}, line {number}: {line.strip()[:60]!r}; accepted are three numbers or two and nothing"
        )
    return north_m, east_m, total_nt


@kernel
def bilinear(grid: Array, row: float, column: float) -> float:
    """Value at a broken row and column of a grid; NaN outside or beside missing data."""
    last_row, last_column = grid.shape[0] - 1, grid.shape[1] - 1
    # A hair of slack at the edges: places come out of divisions.
    if not (-1e-9 <= row <= last_row + 1e-9 and -1e-9 <= column <= last_column + 1e-9):
        return math.nan
    i = max(0, min(last_row - 1, math.floor(row)))
    j = max(0, min(last_column - 1, math.floor(column)))
    v, u = row - i, column - j
    low = grid[i, j] * (1.0 - u) + grid[i, j + 1] * u
    high = grid[i + 1, j] * (1.0 - u) + grid[i + 1, j + 1] * u
    return low * (1.0 - v) + high * v


@kernel
def _bilinear_many(grid: Array, rows: Array, columns: Array, out: Array) -> None:
    for n in range(out.size):
        out[n] = bilinear(grid, rows[n], columns[n])


def _fill(grid: Array) -> Array:
    """Grow the data into its holes, one ring of grid points at a time, each the mean of its neighbours."""
    filled = grid.copy()
    while True:
        known = np.isfinite(filled)
        if np.all(known):
            return filled
        padded = np.pad(np.where(known, filled, 0.0), 1)
        weight = np.pad(known.astype(np.float64), 1)
        around = padded[:-2, 1:-1] + padded[2:, 1:-1] + padded[1:-1, :-2] + padded[1:-1, 2:]
        count = weight[:-2, 1:-1] + weight[2:, 1:-1] + weight[1:-1, :-2] + weight[1:-1, 2:]
        reached = ~known & (count > 0.0)
        filled[reached] = around[reached] / count[reached]
