"""The height of a survey over terrain: the drape, a surface that an aircraft can follow.

The drape is the lowest surface that is nowhere nearer to the ground than the survey height, and nowhere
steeper than the aircraft climbs: the upper envelope of cones on the ground's points. As it is a surface,
lines and tie lines have the same height where they cross, as survey practice demands.
"""

import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.file_content import FileError, read_text
from flightsim.foundation.npz_file import NpzFileError, read_npz
from missions.errors import PlanError

__all__ = ["Drape", "TerrainModel", "load_terrain"]

Array = NDArray[np.float64]

_NAMES: Final = ("north_m", "east_m", "ground_m")
_HEADER: Final = ",".join(_NAMES)
_MAX_POINTS: Final = 4_000_000
_MAX_BYTES: Final = 128 << 20


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TerrainModel:
    """Heights of the ground on a grid, metres from home; edges continue.

    Attributes:
        north_m, east_m: (rows,), (columns,) grid lines, rising.
        ground_m: (rows, columns) height above home.
    """

    north_m: Array
    east_m: Array
    ground_m: Array

    def __post_init__(self) -> None:
        for name, lines in (("north_m", self.north_m), ("east_m", self.east_m)):
            if lines.ndim != 1 or lines.size < 2 or not np.all(np.diff(lines) > 0.0):
                raise PlanError(f"{name} of a terrain: accepted are two or more rising numbers")
        if self.ground_m.shape != (self.north_m.size, self.east_m.size):
            raise PlanError(
                f"ground_m of a terrain has the shape {self.ground_m.shape}; its grid lines make "
                f"{self.north_m.size} x {self.east_m.size}"
            )
        if self.ground_m.size > _MAX_POINTS:
            raise PlanError(f"a terrain of {self.ground_m.size} points; up to {_MAX_POINTS} are accepted")
        if not np.all(np.isfinite(self.ground_m)):
            missing = int(np.count_nonzero(~np.isfinite(self.ground_m)))
            raise PlanError(
                f"the terrain has {missing} points without a height; the ground must be known everywhere"
            )

    def covers(self, north_m: Array, east_m: Array) -> bool:
        """Whether all places are inside its edges."""
        return bool(
            np.all((north_m >= self.north_m[0]) & (north_m <= self.north_m[-1]))
            and np.all((east_m >= self.east_m[0]) & (east_m <= self.east_m[-1]))
        )

    def at(self, north_m: Array, east_m: Array) -> Array:
        """Height of the ground (n,) at places, bilinear."""
        return _bilinear(self.north_m, self.east_m, self.ground_m, north_m, east_m)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drape:
    """A surface to fly on.

    Attributes:
        terrain: the ground; None: it is level, at home's height.
        altitude_m: survey height above the ground.
        climb: steepest slope.
    """

    terrain: TerrainModel | None
    altitude_m: float
    climb: float
    _surface_m: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        ground = self.terrain
        surface = np.zeros((0, 0)) if ground is None else surface_m(ground, self.altitude_m, self.climb)
        object.__setattr__(self, "_surface_m", surface)

    def heights_m(self, north_m: Array, east_m: Array) -> Array:
        """Height (n,) at places, above the level of the terrain's zero."""
        if self.terrain is None:
            return np.full(np.shape(north_m), self.altitude_m)
        return _bilinear(self.terrain.north_m, self.terrain.east_m, self._surface_m, north_m, east_m)


def surface_m(terrain: TerrainModel, altitude_m: float, climb: float) -> Array:
    """The drape on the terrain's grid (rows, columns).

    Each point is raised to its neighbours' heights less the slope to them, until nothing rises any more. The
    eight neighbours make octagons of the cones, which are up to 8 % higher than round ones.
    """
    drape = terrain.ground_m + altitude_m
    north_step = np.diff(terrain.north_m)
    east_step = np.diff(terrain.east_m)
    while True:
        before = drape.copy()
        for rows in (range(1, len(drape)), range(len(drape) - 2, -1, -1)):
            for row in rows:
                other = row - 1 if rows.step > 0 else row + 1
                step = north_step[min(row, other)]
                drape[row] = np.maximum(drape[row], drape[other] - climb * step)
                diagonal = np.hypot(step, east_step) * climb
                drape[row, 1:] = np.maximum(drape[row, 1:], drape[other, :-1] - diagonal)
                drape[row, :-1] = np.maximum(drape[row, :-1], drape[other, 1:] - diagonal)
        for column in range(1, drape.shape[1]):
            drape[:, column] = np.maximum(
                drape[:, column], drape[:, column - 1] - climb * east_step[column - 1]
            )
        for column in range(drape.shape[1] - 2, -1, -1):
            drape[:, column] = np.maximum(drape[:, column], drape[:, column + 1] - climb * east_step[column])
        if not np.any(drape > before + 1e-9):
            return drape


def load_terrain(path: Path) -> TerrainModel:
    """Read heights of the ground: a table with the header `north_m,east_m,ground_m`, a row for each point of
    a grid in any order, or an `.npz` with arrays of these names.

    Raises:
        PlanError: no such file, or not such a file.
    """
    try:
        return _terrain_of_arrays(path) if path.suffix == ".npz" else _terrain_of_table(path)
    except FileError as error:
        raise PlanError(f"`terrain_file` {error}") from None
    except PlanError as error:
        raise PlanError(f"`terrain_file` {path}: {error}") from None


def _terrain_of_arrays(path: Path) -> TerrainModel:
    try:
        found = read_npz(path)
    except NpzFileError as error:
        raise PlanError(
            f"it is no numpy .npz archive ({error}); accepted is one with the arrays {', '.join(_NAMES)}"
        ) from None
    missing = [name for name in _NAMES if name not in found]
    if missing:
        raise PlanError(f"it has no {', '.join(missing)}; accepted are the arrays {', '.join(_NAMES)}")
    for name in _NAMES:
        if found[name].dtype.kind not in "iuf":
            raise PlanError(f"{name} holds {found[name].dtype}; accepted are real numbers")
    return TerrainModel(**{name: found[name].astype(np.float64) for name in _NAMES})


def _terrain_of_table(path: Path) -> TerrainModel:
    try:
        header, *rows = read_text(path, max_bytes=_MAX_BYTES).splitlines()
        if header.strip() != _HEADER:
            raise PlanError(f"it begins with {header[:60]!r}; accepted is the header {_HEADER!r}")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that there are no rows, which is an error here
            table = np.loadtxt(rows, delimiter=",", ndmin=2)
    except (PlanError, FileError):
        raise
    except ValueError as error:
        raise PlanError(f"{error}; accepted are rows of three numbers, {_HEADER}") from None
    if not table.size:
        raise PlanError(f"it has a header and no rows; give a row {_HEADER} for each point of a grid")
    if table.shape[1] != len(_NAMES):
        raise PlanError(f"it has rows of {table.shape[1]} numbers; accepted are three, {_HEADER}")
    north_m, row = np.unique(table[:, 0], return_inverse=True)
    east_m, column = np.unique(table[:, 1], return_inverse=True)
    if north_m.size * east_m.size > _MAX_POINTS:
        raise PlanError("its points are no grid; give a row for each point of one")
    ground = np.full((north_m.size, east_m.size), np.nan)
    ground[row, column] = table[:, 2]
    return TerrainModel(north_m=north_m, east_m=east_m, ground_m=ground)


def _bilinear(lines_n: Array, lines_e: Array, grid: Array, north_m: Array, east_m: Array) -> Array:
    row = np.interp(north_m, lines_n, np.arange(lines_n.size))
    column = np.interp(east_m, lines_e, np.arange(lines_e.size))
    i = np.minimum(row.astype(np.int64), lines_n.size - 2)
    j = np.minimum(column.astype(np.int64), lines_e.size - 2)
    v, u = row - i, column - j
    south = (1.0 - u) * grid[i, j] + u * grid[i, j + 1]
    north = (1.0 - u) * grid[i + 1, j] + u * grid[i + 1, j + 1]
    found: Array = (1.0 - v) * south + v * north
    return found
