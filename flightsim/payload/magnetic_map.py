"""A magnetic map: total field on a regular grid, as a survey publishes it.

`flightsim.foundation.magnetic_map_file` describes its file. The grid lines of a map in a world are evenly
spaced. Between grid points it is interpolated bilinearly.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.file_content import FileError, read_text
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.kernels import kernel
from flightsim.foundation.magnetic_map_file import (
    MagneticMapError,
    MapContents,
    map_file_bytes,
    read_map_file,
)
from flightsim.home import Home

__all__ = ["MagneticMap", "MagneticMapError", "bilinear"]

Array = NDArray[np.float64]

_CSV_HEADER: Final = "north_m,east_m,total_field_nt"
_MAX_CSV_BYTES: Final = 64 << 20
_MAX_POINTS: Final = 4_000_000


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
        self.contents()

    def contents(self) -> MapContents:
        """The map as the contents of a file.

        Raises:
            MagneticMapError: the grid is not one, or has no data.
        """
        return MapContents(
            north_m=self.north_m,
            east_m=self.east_m,
            total_field_nt=self.total_field_nt,
            vertical_gradient_nt_m=self.vertical_gradient_nt_m,
            height_m=self.height_m,
            home=GeodeticPosition(
                lat_deg=self.home.lat_deg, lon_deg=self.home.lon_deg, alt_m=self.home.alt_m
            ),
            error_nt=self.error_nt,
            line_spacing_m=self.line_spacing_m,
        )

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
        """Write the map to a file."""
        path.write_bytes(map_file_bytes(self.contents()))

    @classmethod
    def load(cls, path: Path) -> "MagneticMap":
        """Read a map that `save` has written.

        Raises:
            MagneticMapError: no such file, or not such a file.
        """
        found = read_map_file(path)
        try:
            return cls(
                north_m=found.north_m,
                east_m=found.east_m,
                total_field_nt=found.total_field_nt,
                vertical_gradient_nt_m=found.vertical_gradient_nt_m,
                height_m=found.height_m,
                home=Home(lat_deg=found.home.lat_deg, lon_deg=found.home.lon_deg, alt_m=found.home.alt_m),
                error_nt=found.error_nt,
                line_spacing_m=found.line_spacing_m,
            )
        except ValueError as error:
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
            header, *lines = read_text(path, max_bytes=_MAX_CSV_BYTES).splitlines()
        except FileError as error:
            raise MagneticMapError(str(error)) from None
        if header.strip() != _CSV_HEADER:
            raise MagneticMapError(
                f"{path} begins with {header[:60]!r}; accepted is the header {_CSV_HEADER!r}"
            )
        for number, line in enumerate(lines, 2):
            if line.strip():
                rows_of_text.append(_csv_row(line, path, number))
        if not rows_of_text:
            raise MagneticMapError(f"{path} has a header and no lines")
        table = np.array(rows_of_text)
        north_m, rows = np.unique(table[:, 0], return_inverse=True)
        east_m, columns = np.unique(table[:, 1], return_inverse=True)
        if north_m.size * east_m.size > _MAX_POINTS:
            raise MagneticMapError(f"{path}: its points are no grid; give a row for each point of one")
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
