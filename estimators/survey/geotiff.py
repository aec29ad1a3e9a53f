"""Grids as GeoTIFF, in degrees of WGS84."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.extras import library
from estimators.survey.map_places import WGS84, grid_degrees
from flightsim.foundation.geodesy import GeodeticPosition

__all__ = ["write_geotiff"]

Array = NDArray[np.float64]


def write_geotiff(
    path: Path,
    part: Path,
    home: GeodeticPosition,
    axes: tuple[Array, Array],
    bands: Mapping[str, Array],
    *,
    units: Sequence[str],
    about: Mapping[str, Any],
) -> None:
    """Write bands on evenly spaced grid points, which are the centres of the pixels, float64, NaN without
    data.

    Args:
        path: of the file, for messages.
        part: where to write.
        home: origin of the grid.
        axes: north and east of the grid lines, m from home.
        bands: (rows, columns) each, rows from the south, by description.
        units: of the bands.
        about: tags.

    Raises:
        EstimatorError: rasterio is not installed.
    """
    rasterio, affine = library("rasterio", path), library("rasterio.transform", path).Affine
    lat, lon = grid_degrees(home, *axes)
    step_lat, step_lon = (lat[-1] - lat[0]) / (lat.size - 1), (lon[-1] - lon[0]) / (lon.size - 1)
    with rasterio.open(
        part,
        "w",
        driver="GTiff",
        height=lat.size,
        width=lon.size,
        count=len(bands),
        dtype="float64",
        crs=WGS84.text,
        transform=affine(step_lon, 0.0, lon[0] - 0.5 * step_lon, 0.0, -step_lat, lat[-1] + 0.5 * step_lat),
        nodata=np.nan,
        compress="deflate",
    ) as dataset:
        dataset.update_tags(**about)
        dataset.descriptions = tuple(bands)
        dataset.units = tuple(units)
        dataset.write(np.stack([values[::-1] for values in bands.values()]))  # rows from the north
