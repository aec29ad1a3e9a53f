"""Line data of other programs: places and values of a table, and a grid of them."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import cKDTree

from estimators.errors import EstimatorError
from estimators.survey.map_table import read_table
from estimators.survey.map_values import LATITUDES, LONGITUDES, chosen

__all__ = ["gridded", "line_data"]

Array = NDArray[np.float64]

_LEAST_POINTS: Final = 10
_GAPS: Final = 2.0  # of the line spacing: no data farther from a reading


def line_data(path: Path, column: str | None, check: Callable[[Array], Array]) -> tuple[Array, Array, Array]:
    """Places x, y (n,) of readings in the table's coordinates, and their values, nT.

    Args:
        path: the table.
        column: name of the value's column; None: the only one that can be it.
        check: returns the values with NaN for those that stand for no data, and refuses impossible ones.

    Raises:
        EstimatorError: the file can't be read, or has no such columns or too few values.
    """
    columns = read_table(path)
    x, y = (_coordinate(path, columns, accepted) for accepted in (LONGITUDES, LATITUDES))
    others = {name: values for name, values in columns.items() if name not in (*LONGITUDES, *LATITUDES)}
    values = check(chosen(path, others, column))
    kept = np.isfinite(x) & np.isfinite(y) & np.isfinite(values)
    if int(kept.sum()) < _LEAST_POINTS:
        raise EstimatorError(
            f"{path} has {int(kept.sum())} places with a value; {_LEAST_POINTS} or more make a map"
        )
    return x[kept], y[kept], values[kept]


def gridded(
    path: Path,
    places_ne_m: Array,
    values: Array,
    north_m: Array,
    east_m: Array,
    *,
    spacing_m: float,
    line_spacing_m: float,
) -> Array:
    """Values (rows, columns) at grid lines, linear on triangles of the places; NaN: no data.

    Args:
        path: the file, for errors.
        places_ne_m: (n, 2) of the readings, metres north and east.
        values: (n,) there.
        north_m, east_m: (rows,), (columns,) grid lines.
        spacing_m: their distance.
        line_spacing_m: distance of the survey's lines.

    Raises:
        EstimatorError: the places are on one line or at one place.
    """
    # several readings of one cell are one: triangles between them would be slivers
    _, cell = np.unique(np.floor(places_ne_m / (0.5 * spacing_m)), axis=0, return_inverse=True)
    cell = cell.ravel()
    count = np.bincount(cell)
    north, east, value = (np.bincount(cell, weights=w) / count for w in (*places_ne_m.T, values))
    means = np.column_stack((north, east))
    width_m = _width(means)
    if width_m < 0.5 * spacing_m:
        raise EstimatorError(
            f"{path}: its places are {width_m:.2g} m wide across their direction, which makes no area; a map "
            "needs several lines"
        )
    at = np.column_stack([axis.ravel() for axis in np.meshgrid(north_m, east_m, indexing="ij")])
    near = cKDTree(means).query(at)[0] <= _GAPS * line_spacing_m
    grid = np.full(len(at), np.nan)
    grid[near] = LinearNDInterpolator(means, value)(at[near])
    return grid.reshape(north_m.size, east_m.size)


def _width(places_ne_m: Array) -> float:
    """Extent of places (n, 2) across the direction in which they are spread most."""
    centred = places_ne_m - places_ne_m.mean(axis=0)
    directions = np.linalg.svd(centred, full_matrices=False)[2]
    return float(np.ptp(centred @ directions[-1]))


def _coordinate(path: Path, columns: dict[str, Array], accepted: Sequence[str]) -> Array:
    for name in accepted:
        if name in columns:
            return columns[name]
    raise EstimatorError(f"{path} has the columns {', '.join(columns)[:200]}; none is {', '.join(accepted)}")
