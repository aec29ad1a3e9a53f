"""Line data of other programs: CSV with a header, or Geosoft's XYZ."""

import csv
import lzma
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import cKDTree

from estimators.errors import EstimatorError
from estimators.survey.map_values import LATITUDES, LONGITUDES, chosen

__all__ = ["gridded", "line_data"]

Array = NDArray[np.float64]

_LINE_NAMES: Final = ("line", "tie")
_COLUMNS: Final = "longitude,latitude,total_field_nt"
_LEAST_POINTS: Final = 10
_GAPS: Final = 2.0  # of the line spacing: no data farther from a reading


def line_data(path: Path, column: str | None) -> tuple[Array, Array, Array]:
    """Places x, y (n,) of readings in the table's coordinates, and their values, nT.

    Args:
        path: the table.
        column: name of the value's column; None: the only one that can be it.

    Raises:
        EstimatorError: the file can't be read, or has no such columns or too few values.
    """
    names, rows = _table(path)
    table = np.array(rows, dtype=np.float64).reshape(-1, len(names))
    columns = {name: table[:, k] for k, name in enumerate(names)}
    x, y = (_coordinate(path, columns, accepted) for accepted in (LONGITUDES, LATITUDES))
    others = {name: values for name, values in columns.items() if name not in (*LONGITUDES, *LATITUDES)}
    values = chosen(path, others, column)
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


def _table(path: Path) -> tuple[list[str], list[list[float]]]:
    """Column names, in lower case, and rows of numbers."""
    opened = lzma.open if path.suffix == ".xz" else open
    rows: list[list[float]] = []
    names: list[str] = []
    try:
        with opened(path, "rt", encoding="utf-8-sig") as file:
            for number, text in enumerate(file, 1):
                line = text.strip()
                words = next(csv.reader([line])) if "," in line else line.lstrip("/ ").split()
                if not words or _begins_line(line, words):
                    continue
                if not names:
                    names = [word.strip().lower() for word in words]
                    if _is_number(names[0]):
                        raise EstimatorError(
                            f"{path} has no header; accepted are columns with names, such as {_COLUMNS}"
                        )
                    continue
                if line.startswith("/"):
                    continue
                if len(words) != len(names):
                    raise EstimatorError(
                        f"{path}, line {number}: {len(words)} values for {len(names)} columns"
                    )
                rows.append([_number(word) for word in words])
    except (OSError, UnicodeDecodeError, lzma.LZMAError, EOFError) as error:
        raise EstimatorError(f"{path} can't be read: {error}") from None
    if not names:
        raise EstimatorError(f"{path} is empty; accepted are columns with names, such as {_COLUMNS}")
    return names, rows


def _begins_line(line: str, words: Sequence[str]) -> bool:
    """Whether a row is Geosoft's header of a survey line, such as `Line 12`."""
    return len(words) == 2 and "," not in line and words[0].lower() in _LINE_NAMES


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return math.nan  # text, or `*` for no value


def _is_number(word: str) -> bool:
    return not math.isnan(_number(word)) or word == "nan"


def _coordinate(path: Path, columns: dict[str, Array], accepted: Sequence[str]) -> Array:
    for name in accepted:
        if name in columns:
            return columns[name]
    raise EstimatorError(f"{path} has the columns {', '.join(columns)}; none is {', '.join(accepted)}")
