"""Magnetic maps from other programs' files: grids as GeoTIFF and netCDF, and line data as tables.

A grid is sampled, and line data are interpolated linearly on the triangles of their points (Delaunay), at the
points of a regular grid in the local frame of a home. Places in other coordinate reference systems and datums
than WGS84 are transformed by PROJ. The libraries are an extra: `pip install 'flightstack[maps]'`.
"""

import csv
import importlib
import lzma
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator, RegularGridInterpolator
from scipy.spatial import cKDTree

from estimators.errors import EstimatorError
from estimators.survey.map_values import VALUES, Values, with_main_field
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.magnetic_map_file import MagneticMapError, MapContents

__all__ = ["GRIDS", "TABLES", "MapImport", "imported_map"]

Array = NDArray[np.float64]

GRIDS: Final = (".tif", ".tiff", ".nc", ".grd")
TABLES: Final = (".csv", ".xyz", ".txt", ".csv.xz")
_GEOGRAPHIC: Final = "EPSG:4326"
_MAX_POINTS: Final = 4_000_000
_LONGITUDES: Final = ("longitude", "lon", "long", "longitude_deg", "lon_deg", "x", "easting")
_LATITUDES: Final = ("latitude", "lat", "latitude_deg", "lat_deg", "y", "northing")
_LINE_NAMES: Final = ("line", "tie")
_FARTHEST_M: Final = 100_000.0  # of the data from home
_LEAST_POINTS: Final = 10
_EDGE_POINTS: Final = 50
_GAPS: Final = 2.0  # of the line spacing: no data farther from a reading


@dataclass(frozen=True, slots=True, kw_only=True)
class MapImport:
    """How a file becomes a map.

    Attributes:
        home: origin of the map's frame; None: the middle of the data, at sea level.
        height_m: height above home at which the map is valid.
        spacing_m: distance of its grid lines.
        values: whether the file has total field, or an anomaly that a main field is to be added to.
        decimal_year: date of the main field.
        crs: coordinate reference system of the places ("EPSG:32723"); None: that of the file, and WGS84
            degrees for tables.
        column: name of the value's column or variable; None: the only one that can be it.
        line_spacing_m: distance of the survey's lines; needed for line data.
        error_nt: standard deviation that the survey states.
    """

    home: GeodeticPosition | None = None
    height_m: float = 100.0
    spacing_m: float = 100.0
    values: Values = Values.TOTAL
    decimal_year: float = 2026.0
    crs: str | None = None
    column: str | None = None
    line_spacing_m: float | None = None
    error_nt: float | None = None

    def __post_init__(self) -> None:
        for name in ("spacing_m", "line_spacing_m", "error_nt"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise EstimatorError(f"`{name}` {value:g} is not possible; ask for more than 0")
        if not math.isfinite(self.height_m):
            raise EstimatorError(f"`height_m` {self.height_m} is not a height; give metres above home")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Source:
    """Values over the plane of a coordinate reference system.

    Attributes:
        crs: its name.
        x, y: (n,) places around the data, in its coordinates.
        sample: values at places x, y; NaN without data.
    """

    crs: str
    x: Array
    y: Array
    sample: Callable[[Array, Array], Array]


def imported_map(path: Path, how: MapImport) -> MapContents:
    """Read a file as a map.

    Raises:
        EstimatorError: the file can't be read, has no or another coordinate reference system, no data, or
            values that are no magnetic field; or a library is not installed.
    """
    name = path.name.lower()
    if not path.is_file():
        raise EstimatorError(f"{path} does not exist; give a file")
    if name.endswith((".tif", ".tiff")):
        source = _geotiff(path, how)
    elif name.endswith((".nc", ".grd")):
        source = _netcdf(path, how)
    elif name.endswith(TABLES):
        return _from_lines(path, how)
    else:
        raise EstimatorError(
            f"{path} is no kind of file that is known; accepted are {', '.join((*GRIDS, *TABLES))}"
        )
    lon, lat = _transformed(source.crs, _GEOGRAPHIC, source.x, source.y)
    home, north_m, east_m = _grid_over(path, lat, lon, how)
    lat_deg, lon_deg = _places(home, north_m, east_m)
    x, y = _transformed(_GEOGRAPHIC, source.crs, lon_deg.ravel(), lat_deg.ravel())
    return _made(path, how, home, north_m, east_m, source.sample(x, y).reshape(lat_deg.shape))


def _made(
    path: Path, how: MapImport, home: GeodeticPosition, north_m: Array, east_m: Array, values: Array
) -> MapContents:
    try:
        return MapContents(
            north_m=north_m,
            east_m=east_m,
            total_field_nt=with_main_field(
                path, values, how.values, home, north_m, east_m, how.height_m, how.decimal_year
            ),
            height_m=how.height_m,
            home=home,
            error_nt=how.error_nt,
            line_spacing_m=how.line_spacing_m,
        )
    except MagneticMapError as error:
        raise EstimatorError(f"{path}: {error}") from None


def _grid_over(
    path: Path, lat_deg: Array, lon_deg: Array, how: MapImport
) -> tuple[GeodeticPosition, Array, Array]:
    """Home, and grid lines north and east that cover places."""
    finite = np.isfinite(lat_deg) & np.isfinite(lon_deg)
    if not finite.any() or np.abs(lat_deg[finite]).max() > 90.0 or np.abs(lon_deg[finite]).max() > 360.0:
        raise EstimatorError(
            f"{path}: its places are no degrees of latitude and longitude; give their coordinate reference "
            "system with `crs`, such as EPSG:32723"
        )
    lat, lon = lat_deg[finite], lon_deg[finite]
    home = how.home or GeodeticPosition(
        lat_deg=round(0.5 * float(lat.min() + lat.max()), 6),
        lon_deg=round(0.5 * float(lon.min() + lon.max()), 6),
        alt_m=0.0,
    )
    per_lat, per_lon = LocalFrame(home).metres_per_degree
    step = how.spacing_m
    axes = []
    for values in ((lat - home.lat_deg) * per_lat, (lon - home.lon_deg) * per_lon):
        away_m = max(float(values.min()), -float(values.max()), 0.0)
        if away_m > _FARTHEST_M:
            raise EstimatorError(
                f"{path} is {away_m / 1000.0:.0f} km from `home` {home.lat_deg:g},{home.lon_deg:g}: it is "
                "the map of another place, or latitude and longitude are exchanged"
            )
        first, last = math.floor(values.min() / step), math.ceil(values.max() / step)
        axes.append((first, last - first + 1))
    if axes[0][1] * axes[1][1] > _MAX_POINTS:
        raise EstimatorError(
            f"{path}: `spacing_m` {step:g} m makes {axes[0][1]} x {axes[1][1]} points; up to {_MAX_POINTS} "
            "are accepted: ask for more, or is `home` of another place?"
        )
    north_m, east_m = (step * (first + np.arange(count, dtype=np.float64)) for first, count in axes)
    return home, north_m, east_m


def _places(home: GeodeticPosition, north_m: Array, east_m: Array) -> tuple[Array, Array]:
    per_lat, per_lon = LocalFrame(home).metres_per_degree
    lat, lon = np.meshgrid(home.lat_deg + north_m / per_lat, home.lon_deg + east_m / per_lon, indexing="ij")
    return lat, lon


# grids


def _geotiff(path: Path, how: MapImport) -> _Source:
    rasterio = _library("rasterio", path)
    try:
        with rasterio.open(path) as dataset:
            band = dataset.read(1, masked=True).astype(np.float64).filled(np.nan)
            transform, crs = dataset.transform, dataset.crs
    except _library("rasterio.errors", path).RasterioError as error:
        raise EstimatorError(f"{path} can't be read as GeoTIFF: {error}") from None
    if how.crs is None and crs is None:
        raise EstimatorError(
            f"{path} has no coordinate reference system; give it with `crs`, such as EPSG:32723"
        )
    if transform.b or transform.d:
        raise EstimatorError(f"{path} is a rotated grid; accepted are grids along the axes of their system")
    columns = transform.c + transform.a * (np.arange(band.shape[1]) + 0.5)
    rows = transform.f + transform.e * (np.arange(band.shape[0]) + 0.5)
    return _regular(how.crs or crs.to_string(), columns, rows, band)


def _netcdf(path: Path, how: MapImport) -> _Source:
    netcdf = _library("netCDF4", path)
    try:
        with netcdf.Dataset(path) as dataset:
            grids = [
                v for v in dataset.variables.values() if v.ndim == 2 and v.dimensions[0] != v.dimensions[1]
            ]
            variable = _chosen(path, {v.name: v for v in grids}, how.column)
            what = f"{variable.name} over {', '.join(variable.dimensions)}"
            axes = []
            for dimension in variable.dimensions:
                if dimension not in dataset.variables:
                    raise EstimatorError(f"{path}: {variable.name} has no coordinates of {dimension}")
                axis = dataset.variables[dimension]
                axes.append((_axis_kind(axis), np.ma.filled(axis[:].astype(np.float64), np.nan)))
            values = np.ma.filled(variable[:].astype(np.float64), np.nan)
    except OSError as error:
        raise EstimatorError(f"{path} can't be read as netCDF: {error}") from None
    kinds = [kind for kind, _ in axes]
    if kinds == ["x", "y"]:
        axes, values = axes[::-1], values.T
    elif kinds != ["y", "x"]:
        raise EstimatorError(
            f"{path}: {what} is no map; accepted are coordinates named "
            f"{', '.join((*_LATITUDES, *_LONGITUDES))}"
        )
    (_, rows), (_, columns) = axes
    geographic = np.abs(rows).max() <= 90.0 and np.abs(columns).max() <= 360.0
    if how.crs is None and not geographic:
        raise EstimatorError(
            f"{path}: its coordinates reach {np.abs(rows).max():g}, which is no latitude; give their "
            "coordinate reference system with `crs`, such as EPSG:32723"
        )
    if how.crs is None:
        columns = np.where(columns > 180.0, columns - 360.0, columns)
    return _regular(how.crs or _GEOGRAPHIC, columns, rows, values)


def _axis_kind(axis: Any) -> str:
    """ "x" or "y" of a coordinate, from its name or its units; "" if neither says it."""
    units = str(getattr(axis, "units", "")).lower()
    name = str(axis.name).lower()
    if name in _LATITUDES or "degrees_north" in units:
        return "y"
    return "x" if name in _LONGITUDES or "degrees_east" in units else ""


def _regular(crs: str, columns: Array, rows: Array, values: Array) -> _Source:
    """A source over grid lines in any order."""
    right, up = np.argsort(columns), np.argsort(rows)
    x, y, grid = columns[right], rows[up], values[up][:, right]
    inside = RegularGridInterpolator((y, x), grid, bounds_error=False, fill_value=np.nan)
    share = np.linspace(0.0, 1.0, _EDGE_POINTS)
    along_x, along_y = x[0] + share * (x[-1] - x[0]), y[0] + share * (y[-1] - y[0])
    ends = np.ones(_EDGE_POINTS)
    return _Source(
        crs=crs,
        x=np.concatenate((along_x, along_x, x[0] * ends, x[-1] * ends)),
        y=np.concatenate((y[0] * ends, y[-1] * ends, along_y, along_y)),
        sample=lambda at_x, at_y: inside(np.column_stack((at_y, at_x))),
    )


def _chosen(path: Path, found: dict[str, Any], column: str | None) -> Any:
    """The variable or column with the values."""
    if column is not None:
        if column not in found:
            raise EstimatorError(f"{path} has no `column` {column!r}; there are {', '.join(found) or 'none'}")
        return found[column]
    if len(found) != 1:
        raise EstimatorError(
            f"{path} has {len(found)} candidates for the field ({', '.join(found) or 'none'}); name one with "
            "`column`"
        )
    return next(iter(found.values()))


# line data


def _from_lines(path: Path, how: MapImport) -> MapContents:
    if how.line_spacing_m is None:
        raise EstimatorError(f"{path} holds line data: give the distance of its lines, `line_spacing_m`")
    names, table = _table(path)
    x, y = (_named(path, names, table, accepted) for accepted in (_LONGITUDES, _LATITUDES))
    values = _chosen(path, _value_columns(names, table), how.column)
    kept = np.isfinite(x) & np.isfinite(y) & np.isfinite(values)
    lon, lat = _transformed(how.crs or _GEOGRAPHIC, _GEOGRAPHIC, x[kept], y[kept])
    if int(kept.sum()) < _LEAST_POINTS:
        raise EstimatorError(
            f"{path} has {int(kept.sum())} places with a value; {_LEAST_POINTS} or more make a map"
        )
    home, north_m, east_m = _grid_over(path, lat, lon, how)
    per_lat, per_lon = LocalFrame(home).metres_per_degree
    places = np.column_stack(((lat - home.lat_deg) * per_lat, (lon - home.lon_deg) * per_lon))
    # several readings of one cell are one: triangles between them would be slivers
    _, cell = np.unique(np.floor(places / (0.5 * how.spacing_m)), axis=0, return_inverse=True)
    cell = cell.ravel()
    count = np.bincount(cell)
    north, east, value = (np.bincount(cell, weights=w) / count for w in (*places.T, values[kept]))
    means = np.column_stack((north, east))
    at = np.column_stack([axis.ravel() for axis in np.meshgrid(north_m, east_m, indexing="ij")])
    near = cKDTree(means).query(at)[0] <= _GAPS * how.line_spacing_m
    grid = np.full(len(at), np.nan)
    try:
        grid[near] = LinearNDInterpolator(means, value)(at[near])
    except ValueError as error:
        raise EstimatorError(f"{path}: its places make no area: {error}") from None
    return _made(path, how, home, north_m, east_m, grid.reshape(north_m.size, east_m.size))


def _table(path: Path) -> tuple[list[str], list[list[float]]]:
    """Column names and rows of numbers of a table: CSV with a header, or Geosoft's XYZ."""
    opened = lzma.open if path.suffix == ".xz" else open
    rows: list[list[float]] = []
    names: list[str] = []
    try:
        with opened(path, "rt", encoding="utf-8") as file:
            for number, text in enumerate(file, 1):
                line = text.strip()
                words = next(csv.reader([line])) if "," in line else line.lstrip("/ ").split()
                if not words or words[0].lower() in _LINE_NAMES:
                    continue
                if not names:
                    names = [word.strip().lower() for word in words]
                    if _is_number(names[0]):
                        raise EstimatorError(
                            f"{path} has no header; accepted are columns with names, such as "
                            "longitude,latitude,total_field_nt"
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
    return names, rows


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return math.nan  # text, or `*` for no value


def _is_number(word: str) -> bool:
    return not math.isnan(_number(word)) or word == "nan"


def _named(path: Path, names: Sequence[str], rows: list[list[float]], accepted: Sequence[str]) -> Array:
    for name in accepted:
        if name in names:
            return np.array(rows).reshape(-1, len(names))[:, names.index(name)]
    raise EstimatorError(f"{path} has the columns {', '.join(names)}; none is {', '.join(accepted)}")


def _value_columns(names: Sequence[str], rows: list[list[float]]) -> dict[str, Array]:
    """Columns that can be the field: those with one of the usual names, else all in nT."""
    table = np.array(rows).reshape(-1, len(names))
    columns = {name: table[:, k] for k, name in enumerate(names)}
    usual = {name: values for name, values in columns.items() if name in VALUES}
    if usual:
        first = next(name for name in VALUES if name in usual)
        return {first: usual[first]}
    return {name: values for name, values in columns.items() if name not in (*_LONGITUDES, *_LATITUDES)}


# libraries


def _library(name: str, path: Path) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise EstimatorError(
            f"{path} needs {name}, which is not installed: pip install 'flightstack[maps]'"
        ) from None


def _transformed(source: str, target: str, x: Array, y: Array) -> tuple[Array, Array]:
    """Places from one coordinate reference system in another."""
    if source == target:
        return x, y
    what = Path(f"the coordinate reference system {source}")
    errors, warp = (_library(f"rasterio.{name}", what) for name in ("errors", "warp"))
    try:
        found = warp.transform(source, target, x, y)
    except (errors.RasterioError, ValueError) as error:
        raise EstimatorError(
            f"`crs` {source} is not accepted: {error}; give one such as EPSG:32723"
        ) from None
    return np.asarray(found[0], dtype=np.float64), np.asarray(found[1], dtype=np.float64)
