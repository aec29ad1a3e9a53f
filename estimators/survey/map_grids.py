"""Grids of other programs: GeoTIFF, Surfer's and Esri's grids (by GDAL), and netCDF."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from estimators.errors import EstimatorError
from estimators.extras import library
from estimators.survey.map_places import EXAMPLE, WGS84, ReferenceSystem
from estimators.survey.map_values import LATITUDES, LONGITUDES, chosen
from flightsim.foundation.geodesy import WGS84_A_M, longitude_near

__all__ = ["GridSource", "netcdf", "raster"]

Array = NDArray[np.float64]

Check = Callable[[Array], Array]

_FORMATS: Final = {
    "GTiff": "GeoTIFF",
    "GSAG": "Surfer's ASCII grid",
    "GSBG": "Surfer's binary grid",
    "GS7BG": "Surfer's binary grid",
    "AAIGrid": "Esri's ASCII grid",
}
"""What is read through GDAL, by the name of its driver."""
_MOST_POINTS: Final = 25_000_000
_EDGE_POINTS: Final = 50
_SLACK: Final = 1e-6  # of a grid step: places come out of transformations
_CRS_TEXTS: Final = ("crs_wkt", "spatial_ref", "epsg_code")


@dataclass(frozen=True, slots=True, kw_only=True)
class GridSource:
    """Values over the plane of a coordinate reference system.

    Attributes:
        crs: the system.
        x, y: (n,) places around the data, in its coordinates.
        sample: values at places x, y; NaN without data.
    """

    crs: ReferenceSystem
    x: Array
    y: Array
    sample: Callable[[Array, Array], Array]


def raster(path: Path, driver: str, crs: str | None, column: str | None, check: Check) -> GridSource:
    """A band of a file that GDAL reads.

    Args:
        path: the file.
        driver: GDAL's name of its format.
        crs: coordinate reference system of its places; None: the one that it declares.
        column: number or description of the band; None: the only one that can be it.
        check: returns the values with NaN for those that stand for no data, and refuses impossible ones.

    Raises:
        EstimatorError: the file can't be read, has no coordinate reference system or several bands without a
            choice, or is rotated.
    """
    rasterio, errors = library("rasterio", path), library("rasterio.errors", path)
    try:
        with (
            warnings.catch_warnings(action="error", category=errors.NotGeoreferencedWarning),
            rasterio.open(path, driver=driver) as dataset,
        ):
            _require_size(path, dataset.width, dataset.height)
            with np.errstate(invalid="ignore"):  # values that are no numbers are counted by `check`
                band = dataset.read(_band(path, dataset, column), masked=True).astype(np.float64)
            band = band.filled(np.nan)
            transform, declared = dataset.transform, dataset.crs
    except errors.NotGeoreferencedWarning:
        raise EstimatorError(f"{path} does not say where on the Earth its points are") from None
    except (errors.RasterioError, ValueError, MemoryError) as error:
        if isinstance(error, EstimatorError):
            raise
        reason = " ".join(str(error).split())
        raise EstimatorError(f"{path} can't be read as {_FORMATS[driver]}: {reason}") from None
    if crs is None and declared is None:
        raise EstimatorError(f"{path} has no coordinate reference system; give it with `crs`, {EXAMPLE}")
    if transform.b or transform.d:
        raise EstimatorError(f"{path} is a rotated grid; accepted are grids along the axes of their system")
    columns = transform.c + transform.a * (np.arange(band.shape[1]) + 0.5)
    rows = transform.f + transform.e * (np.arange(band.shape[0]) + 0.5)
    return _regular(path, ReferenceSystem.of(path, crs or declared.to_wkt()), columns, rows, check(band))


def _require_size(path: Path, columns: int, rows: int) -> None:
    if columns * rows > _MOST_POINTS:
        raise EstimatorError(
            f"{path} is a grid of {columns} x {rows} points; accepted are up to {_MOST_POINTS}, cut it"
        )


def _band(path: Path, dataset: Any, column: str | None) -> int:
    """Number of the band of the field."""
    numbers = {str(number): int(number) for number in dataset.indexes}
    if column in numbers:
        return numbers[column]
    texts = list(dataset.descriptions)
    bands = {
        text if text and texts.count(text) == 1 else number: numbers[number]
        for number, text in zip(numbers, texts, strict=True)
    }
    return int(chosen(path, bands, column))


def netcdf(path: Path, crs: str | None, column: str | None, check: Check) -> GridSource:
    """A variable of a netCDF file over two coordinates.

    Args:
        path: the file.
        crs: coordinate reference system of its places; None: that of the variable's grid mapping, and WGS84
            for degrees without one.
        column: name of the variable; None: the only one that can be it.
        check: as of `raster`.

    Raises:
        EstimatorError: the file can't be read, has no such variable, coordinates that make no grid, or a
            grid mapping that defines no coordinate reference system.
    """
    library_of_netcdf = library("netCDF4", path)
    try:
        with library_of_netcdf.Dataset(path) as dataset:
            variable = _variable(path, dataset, column)
            _require_size(path, *variable.shape)
            axes = [_axis(path, dataset, variable, dimension) for dimension in variable.dimensions]
            values = np.ma.filled(variable[:].astype(np.float64), np.nan)
            text = crs or _declared(path, dataset, variable)
            what = f"{variable.name} over {', '.join(variable.dimensions)}"
    except (OSError, RuntimeError) as error:  # of libraries for netCDF and HDF
        raise EstimatorError(f"{path} can't be read as netCDF: {error}") from None
    kinds = [kind for kind, _ in axes]
    if kinds == ["x", "y"]:
        axes, values = axes[::-1], values.T
    elif kinds != ["y", "x"]:
        raise EstimatorError(
            f"{path}: {what} is no map; accepted are coordinates named {', '.join((*LATITUDES, *LONGITUDES))}"
        )
    (_, rows), (_, columns) = axes
    if text is None and (np.abs(rows).max() > 90.0 or np.abs(columns).max() > 360.0):
        raise EstimatorError(
            f"{path}: its coordinates reach {np.abs(rows).max():g}, which is no latitude; give their "
            f"coordinate reference system with `crs`, {EXAMPLE}"
        )
    return _regular(path, ReferenceSystem.of(path, text or WGS84.text), columns, rows, check(values))


def _variable(path: Path, dataset: Any, column: str | None) -> Any:
    """The variable of the field: numbers over two coordinates."""
    numbers = [v for v in dataset.variables.values() if _is_numeric(v)]
    grids = {v.name: v for v in numbers if v.ndim == 2 and v.dimensions[0] != v.dimensions[1]}
    if not grids:
        others = [f"{v.name} over {', '.join(v.dimensions)}" for v in numbers if v.ndim > 2]
        there = f"; there is {' and '.join(others)}: save one time or level of it" if others else ""
        raise EstimatorError(f"{path} has no variable of numbers over two coordinates{there}")
    return chosen(path, grids, column)


def _is_numeric(variable: Any) -> bool:
    return getattr(variable.dtype, "kind", "") in ("i", "u", "f")  # the dtype of text is `str`


def _axis(path: Path, dataset: Any, variable: Any, dimension: str) -> tuple[str, Array]:
    """Kind ("x", "y", or "" if neither its name nor its units give it) and values of a coordinate."""
    if dimension not in dataset.variables:
        raise EstimatorError(f"{path}: {variable.name} has no coordinates of {dimension}")
    axis = dataset.variables[dimension]
    if axis.ndim != 1 or not _is_numeric(axis):
        raise EstimatorError(
            f"{path}: its coordinate {dimension} is no list of numbers, one for each grid line"
        )
    values = np.ma.filled(axis[:].astype(np.float64), np.nan)
    units, name = str(getattr(axis, "units", "")).lower(), dimension.lower()
    if name in LATITUDES or "degrees_north" in units:
        return "y", values
    return "x" if name in LONGITUDES or "degrees_east" in units else "", values


def _declared(path: Path, dataset: Any, variable: Any) -> str | None:
    """Coordinate reference system of a variable's grid mapping (CF conventions, section 5.6); None: none."""
    name = str(getattr(variable, "grid_mapping", "")).split(":")[0].strip()
    if not name:
        return None
    mapping = dataset.variables.get(name)
    for key in _CRS_TEXTS:
        text = str(getattr(mapping, key, "")).strip()
        if text:
            return f"EPSG:{text}" if text.isdecimal() else text
    degrees = getattr(mapping, "grid_mapping_name", "") == "latitude_longitude"
    if degrees and float(getattr(mapping, "semi_major_axis", WGS84_A_M)) == WGS84_A_M:
        return None
    raise EstimatorError(
        f"{path}: its grid mapping {name} has no {', '.join(_CRS_TEXTS)}; give the coordinate reference "
        f"system with `crs`, {EXAMPLE}"
    )


def _regular(path: Path, crs: ReferenceSystem, columns: Array, rows: Array, values: Array) -> GridSource:
    """A source over grid lines in any order."""
    right, up = np.argsort(columns), np.argsort(rows)
    x, y, grid = columns[right], rows[up], values[up][:, right]
    for name, lines in (("x", x), ("y", y)):
        if lines.size < 2 or not np.all(np.isfinite(lines)) or not np.all(np.diff(lines) > 0.0):
            raise EstimatorError(
                f"{path}: its {name} coordinates are no grid lines; accepted are two or more finite numbers "
                "without repetition"
            )
    inside = RegularGridInterpolator((y, x), grid, bounds_error=False, fill_value=np.nan)
    share = np.linspace(0.0, 1.0, _EDGE_POINTS)
    along_x, along_y = x[0] + share * (x[-1] - x[0]), y[0] + share * (y[-1] - y[0])
    ends = np.ones(_EDGE_POINTS)

    def sample(at_x: Array, at_y: Array) -> Array:
        if crs.geographic:
            at_x = longitude_near(at_x, 0.5 * float(x[0] + x[-1]))
        found: Array = inside(np.column_stack((_on_edge(at_y, y), _on_edge(at_x, x))))
        return found

    return GridSource(
        crs=crs,
        x=np.concatenate((along_x, along_x, x[0] * ends, x[-1] * ends)),
        y=np.concatenate((y[0] * ends, y[-1] * ends, along_y, along_y)),
        sample=sample,
    )


def _on_edge(places: Array, lines: Array) -> Array:
    """Places of which those that are beside the outer grid lines by rounding are on them."""
    inside = np.clip(places, lines[0], lines[-1])
    near = np.abs(places - inside) <= _SLACK * (lines[-1] - lines[0]) / (lines.size - 1)
    return np.where(near, inside, places)
