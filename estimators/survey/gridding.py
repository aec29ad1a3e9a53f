"""From lines to a map: readings between and along lines interpolated onto a regular grid.

Thin-plate splines are the surface of minimum curvature through the data (Briggs 1974, "Machine contouring
using minimum curvature", Geophysics 39); scipy fits one to the nearest points of each grid point.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from estimators.errors import EstimatorError

__all__ = ["SurveyGrid", "block_means", "grid_axes", "grid_lines"]

Array = NDArray[np.float64]

_NEIGHBOURS: Final = 48
_MAX_POINTS: Final = 1_000_000
_LEAST_POINTS: Final = 12
_ONE_LINE: Final = 0.1  # of a line spacing: places with a smaller spread (root mean square) are on one line
_REACH: Final = 0.75  # of a line spacing: farthest that a grid point with a value is from data


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurveyGrid:
    """Values on a grid.

    Attributes:
        north_m, east_m: (rows,), (columns,) grid lines, evenly spaced.
        values_nt: (rows, columns); NaN farther from all data than 0.75 line spacings.
    """

    north_m: Array
    east_m: Array
    values_nt: Array


def block_means(places_m: Array, values_nt: Array, block_m: float) -> tuple[Array, Array]:
    """Means of places (n, 2) and values (n,) of successive readings over so much of the track."""
    if not len(places_m):
        return places_m, values_nt
    steps = np.hypot(*np.diff(places_m, axis=0).T)
    block = np.floor(np.concatenate(([0.0], np.cumsum(steps))) / block_m).astype(np.int64)
    count = np.maximum(np.bincount(block), 1)
    kept = np.bincount(block) > 0
    means = [np.bincount(block, weights=column) / count for column in (*places_m.T, values_nt)]
    return np.column_stack(means[:2])[kept], means[2][kept]


def grid_axes(places_m: Array, cell_m: float) -> tuple[Array, Array]:
    """The lines (rows,), (columns,) of the grid around places (n, 2), north and east.

    Args:
        places_m: north and east.
        cell_m: distance of the grid lines.

    Raises:
        EstimatorError: there are too many grid points.
    """
    low = np.floor(places_m.min(axis=0) / cell_m)
    high = np.ceil(places_m.max(axis=0) / cell_m)
    rows, columns = (int(n) + 1 for n in high - low)
    if rows * columns > _MAX_POINTS:
        raise EstimatorError(
            f"`grid_m` {cell_m:g} m makes {rows} x {columns} grid points; up to {_MAX_POINTS} are accepted: "
            "choose a larger one"
        )
    return cell_m * (low[0] + np.arange(rows)), cell_m * (low[1] + np.arange(columns))


def grid_lines(places_m: Array, values_nt: Array, *, line_spacing_m: float, cell_m: float) -> SurveyGrid:
    """Grid block means of lines.

    Args:
        places_m: (n, 2) north and east.
        values_nt: (n,).
        line_spacing_m: distance of the lines; grid points farther than 0.75 of it from all data have no
            value.
        cell_m: distance of the grid lines.

    Raises:
        EstimatorError: too few places, all places on one line, or too many grid points.
    """
    if len(places_m) < _LEAST_POINTS:
        raise EstimatorError(f"{len(places_m)} places make no grid; {_LEAST_POINTS} or more do")
    across_m = float(np.linalg.svd(places_m - places_m.mean(axis=0), compute_uv=False)[1])
    if across_m < _ONE_LINE * line_spacing_m * math.sqrt(len(places_m)):
        raise EstimatorError("all places are on one line; two lines or more make a grid")
    north_m, east_m = grid_axes(places_m, cell_m)
    points = np.column_stack([axis.ravel() for axis in np.meshgrid(north_m, east_m, indexing="ij")])
    near = cKDTree(places_m).query(points)[0] <= _REACH * line_spacing_m
    values = np.full(len(points), math.nan)
    try:
        values[near] = interpolated(places_m, values_nt, points[near])
    except np.linalg.LinAlgError:
        raise EstimatorError(
            f"the lines are too far apart for a line spacing of {line_spacing_m:g} m; give their distance as "
            "line_spacing_m"
        ) from None
    return SurveyGrid(north_m=north_m, east_m=east_m, values_nt=values.reshape(len(north_m), len(east_m)))


def interpolated(places_m: Array, values_nt: Array, at_m: Array) -> Array:
    """The thin-plate spline through values (n,) at places (n, 2), at other places (m, 2)."""
    if not len(at_m):
        return np.zeros(0)
    level = float(np.median(values_nt))
    spline = RBFInterpolator(
        places_m, values_nt - level, neighbors=min(_NEIGHBOURS, len(places_m)), kernel="thin_plate_spline"
    )
    found: Array = spline(at_m) + level
    return found
