"""Magnetic maps from other programs' files: grids as GeoTIFF, netCDF, of Surfer and of Esri, and line data as
tables. A file is recognised by its content.

A grid is sampled, and line data are interpolated linearly on the triangles of their points (Delaunay), at the
points of a regular grid in the local frame of a home. Places in other coordinate reference systems and datums
than WGS84 are transformed by PROJ. The libraries are an extra: `pip install 'flightstack[maps]'`.
"""

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from estimators.survey.map_grids import netcdf, raster
from estimators.survey.map_import_options import MapImport
from estimators.survey.map_lines import gridded, line_data
from estimators.survey.map_places import WGS84, ReferenceSystem, grid_degrees, transformed
from estimators.survey.map_values import checked_values, with_main_field
from flightsim.foundation.file_content import XZ, FileError, file_head
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame, longitude_near
from flightsim.foundation.magnetic_map_file import MagneticMapError, MapContents
from flightsim.foundation.vectors import wrap_180

Array = NDArray[np.float64]

_DRIVERS: Final = {
    b"II*\0": "GTiff",
    b"MM\0*": "GTiff",
    b"II+\0": "GTiff",
    b"MM\0+": "GTiff",
    b"DSAA": "GSAG",
    b"DSBB": "GSBG",
    b"DSRB": "GS7BG",
}
"""GDAL's drivers by the first bytes of a file."""
_ESRI: Final = re.compile(
    rb"\s*(ncols|nrows|xll(corner|center)|yll(corner|center)|cellsize)\s", re.IGNORECASE
)
_NETCDF: Final = (b"CDF", b"\x89HDF\r\n\x1a\n")
_XZ_MAGIC: Final = b"\xfd7zXZ\x00"
_ACCEPTED: Final = (
    "GeoTIFF, netCDF, grids of Surfer and Esri, and tables of line data (.csv, .xyz, .txt, also with .xz)"
)
_MAX_POINTS: Final = 4_000_000
_FARTHEST_M: Final = 100_000.0  # of the data from home
_ON_LINE: Final = 1e-6  # of the spacing: data that end there end on a grid line


def imported_map(path: Path, how: MapImport) -> MapContents:
    """Read a file as a map.

    Raises:
        EstimatorError: the file can't be read, has no coordinate reference system, no data, or
            values that are no magnetic field; or a library is not installed.
    """
    try:
        head = file_head(path, accepted=(XZ,))
    except FileError as error:
        raise EstimatorError(str(error)) from None

    def check(values: Array) -> Array:
        return checked_values(path, values, how.values, how.no_data)

    driver = "AAIGrid" if _ESRI.match(head) else _DRIVERS.get(head[:4])
    if driver is not None:
        source = raster(path, driver, how.crs, how.column, check)
    elif head.startswith(_NETCDF):
        source = netcdf(path, how.crs, how.column, check)
    elif head.startswith(_XZ_MAGIC) or b"\0" not in head:
        return _from_lines(path, how, check)
    else:
        geosoft = "; export a grid of Oasis montaj as GeoTIFF" if path.suffix.lower() == ".grd" else ""
        raise EstimatorError(f"{path} is no kind of file that is known; accepted are {_ACCEPTED}{geosoft}")
    lon, lat = transformed(path, source.crs, WGS84, source.x, source.y)
    home, north_m, east_m = _grid_over(path, lat, lon, how)
    lat_deg, lon_deg = np.meshgrid(*grid_degrees(home, north_m, east_m), indexing="ij")
    x, y = transformed(path, WGS84, source.crs, lon_deg.ravel(), lat_deg.ravel())
    return _made(path, how, home, north_m, east_m, source.sample(x, y).reshape(lat_deg.shape))


def _from_lines(path: Path, how: MapImport, check: Callable[[Array], Array]) -> MapContents:
    if how.line_spacing_m is None:
        raise EstimatorError(f"{path} holds line data: give the distance of its lines, `line_spacing_m`")
    x, y, values = line_data(path, how.column, check)
    crs = ReferenceSystem.of(path, how.crs or WGS84.text)
    lon, lat = transformed(path, crs, WGS84, x, y)
    home, north_m, east_m = _grid_over(path, lat, lon, how)
    places = np.column_stack(LocalFrame(home).ned_from_geodetic(lat, lon, np.zeros_like(lat))[:2])
    spacings = {"spacing_m": how.spacing_m, "line_spacing_m": how.line_spacing_m}
    grid = gridded(path, places, values, north_m, east_m, **spacings)
    return _made(path, how, home, north_m, east_m, grid)


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
    lon = longitude_near(lon, float(lon[0]))  # data on both sides of 180 degrees stay together
    home = how.home or GeodeticPosition(
        lat_deg=round(0.5 * float(lat.min() + lat.max()), 6),
        lon_deg=round(wrap_180(0.5 * float(lon.min() + lon.max())), 6),
        alt_m=0.0,
    )
    step = how.spacing_m
    axes = []
    for values in LocalFrame(home).ned_from_geodetic(lat, lon, np.zeros_like(lat))[:2]:
        away_m = max(float(values.min()), -float(values.max()), 0.0)
        if away_m > _FARTHEST_M:
            raise EstimatorError(
                f"{path} is {away_m / 1000.0:.0f} km from `home` {home.lat_deg:g},{home.lon_deg:g}: it is "
                "the map of another place, or latitude and longitude are exchanged"
            )
        first = math.floor(values.min() / step + _ON_LINE)
        last = math.ceil(values.max() / step - _ON_LINE)
        axes.append((first, last - first + 1))
    if axes[0][1] * axes[1][1] > _MAX_POINTS:
        raise EstimatorError(
            f"{path}: `spacing_m` {step:g} m makes {axes[0][1]} x {axes[1][1]} points; up to {_MAX_POINTS} "
            "are accepted: ask for more, or is `home` of another place?"
        )
    north_m, east_m = (step * (first + np.arange(count, dtype=np.float64)) for first, count in axes)
    return home, north_m, east_m
