"""Magnetic maps for other programs: GeoTIFF and netCDF in degrees of WGS84.

The local frame of a map is linear in latitude and longitude (`flightsim.foundation.geodesy.LocalFrame`), so
its grid lines are meridians and parallels: values are copied, and nothing is interpolated.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from estimators.extras import library
from estimators.logs.new_file import new_file
from estimators.survey.geotiff import write_geotiff
from estimators.survey.map_places import WGS84, grid_degrees
from flightsim.foundation.magnetic_map_file import MapContents

__all__ = ["exported_map"]

Array = NDArray[np.float64]

_UNITS: Final = {"total_field_nt": "nT", "vertical_gradient_nt_m": "nT/m"}
_LONG_NAMES: Final = {
    "total_field_nt": "total magnetic field",
    "vertical_gradient_nt_m": "upward derivative of the total magnetic field",
}


def exported_map(contents: MapContents, path: Path) -> None:
    """Write a map to a new file: GeoTIFF (`.tif`, `.tiff`) or netCDF (`.nc`), float64, NaN without data.

    Both have the total field, nT, and the vertical gradient, nT/m, if the map has one, and as metadata home,
    height, error and line spacing. A GeoTIFF has the grid points as the centres of its pixels.

    Raises:
        EstimatorError: another kind of file, a map with uneven grid lines as GeoTIFF, or a library is not
            installed.
        LogError: the file exists or can't be written.
    """
    kinds: dict[str, Callable[[MapContents, Path, Path], None]] = {
        ".tif": _write_geotiff,
        ".tiff": _write_geotiff,
        ".nc": _write_netcdf,
    }
    write = kinds.get(path.suffix.lower())
    if write is None:
        raise EstimatorError(f"{path} is no kind of file that is written; accepted are {', '.join(kinds)}")
    with new_file(path) as part:
        write(contents, path, part)


def _write_geotiff(contents: MapContents, path: Path, part: Path) -> None:
    for name, lines in (("north_m", contents.north_m), ("east_m", contents.east_m)):
        steps = np.diff(lines)
        if not np.allclose(steps, steps.mean(), rtol=1e-6):
            raise EstimatorError(
                f"{path}: {name} of the map is spaced {steps.min():g} to {steps.max():g} m, and a GeoTIFF "
                "has even spacing; accepted is netCDF (.nc)"
            )
    bands = _bands(contents)
    units = [_UNITS[name] for name in bands]
    axes = contents.north_m, contents.east_m
    write_geotiff(path, part, contents.home, axes, bands, units=units, about=_metadata(contents))


def _write_netcdf(contents: MapContents, path: Path, part: Path) -> None:
    wkt = library("rasterio.crs", path).CRS.from_string(WGS84.text).to_wkt()
    axes = grid_degrees(contents.home, contents.north_m, contents.east_m)
    names = ("latitude", "longitude")
    with library("netCDF4", path).Dataset(part, "w") as dataset:
        dataset.setncatts({"Conventions": "CF-1.8", **_metadata(contents)})
        mapping = dataset.createVariable("crs", "i4", ())
        mapping.setncatts({"grid_mapping_name": "latitude_longitude", "crs_wkt": wkt})
        for name, units, lines in zip(names, ("degrees_north", "degrees_east"), axes, strict=True):
            dataset.createDimension(name, lines.size)
            axis = dataset.createVariable(name, "f8", (name,))
            axis.setncatts({"standard_name": name, "units": units})
            axis[:] = lines
        for name, values in _bands(contents).items():
            variable = dataset.createVariable(name, "f8", names, compression="zlib", fill_value=np.nan)
            variable.setncatts({"long_name": _LONG_NAMES[name], "units": _UNITS[name], "grid_mapping": "crs"})
            variable[:] = values


def _bands(contents: MapContents) -> dict[str, Array]:
    """Values (rows, columns) by name, rows from the south."""
    found = {"total_field_nt": contents.total_field_nt}
    if contents.vertical_gradient_nt_m is not None:
        found["vertical_gradient_nt_m"] = contents.vertical_gradient_nt_m
    return found


def _metadata(contents: MapContents) -> dict[str, float]:
    home = contents.home
    stated = {"error_nt": contents.error_nt, "line_spacing_m": contents.line_spacing_m}
    return {
        "height_m": contents.height_m,
        "home_lat_deg": home.lat_deg,
        "home_lon_deg": home.lon_deg,
        "home_alt_m": home.alt_m,
        **{name: value for name, value in stated.items() if value is not None},
    }
