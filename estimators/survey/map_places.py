"""Coordinate reference systems of imported and exported maps, WGS84 among them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from estimators.extras import library
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame, longitude_near

__all__ = ["WGS84", "ReferenceSystem", "grid_degrees", "transformed"]

Array = NDArray[np.float64]

EXAMPLE: Final = "such as EPSG:32723"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceSystem:
    """A coordinate reference system of places on the Earth.

    Attributes:
        text: its name ("EPSG:32723") or its definition (WKT).
        geographic: whether its coordinates are degrees of longitude and latitude.
    """

    text: str
    geographic: bool

    @classmethod
    def of(cls, path: Path, text: str) -> "ReferenceSystem":
        """The system of a name or a definition.

        Args:
            path: the file whose places it is for.
            text: what the file declares, or what is given for it.

        Raises:
            EstimatorError: PROJ does not know it, or it has no place on the Earth.
        """
        if text == WGS84.text:
            return WGS84
        short = " ".join(text.split())[:60]
        try:
            with library("rasterio", path).Env():  # without it GDAL prints errors by itself
                found = library("rasterio.crs", path).CRS.from_user_input(text)
        except library("rasterio.errors", path).CRSError as error:
            raise EstimatorError(
                f"{path}: `crs` {short} is not accepted: {error}; give one {EXAMPLE}"
            ) from None
        if not (found.is_geographic or found.is_projected):
            raise EstimatorError(
                f"{path} has the coordinate reference system {short}, which is neither geographic nor "
                f"projected; give that of its coordinates with `crs`, {EXAMPLE}"
            )
        return cls(text=found.to_string(), geographic=bool(found.is_geographic))


WGS84: Final = ReferenceSystem(text="EPSG:4326", geographic=True)


def transformed(
    path: Path, source: ReferenceSystem, target: ReferenceSystem, x: Array, y: Array
) -> tuple[Array, Array]:
    """Places (n,) of one coordinate reference system in another; x is longitude or easting.

    Raises:
        EstimatorError: PROJ can't transform them.
    """
    if source == target:
        return x, y
    errors, failures, warp = (library(f"rasterio.{name}", path) for name in ("errors", "_err", "warp"))
    try:
        with library("rasterio", path).Env():
            found = warp.transform(source.text, target.text, longitude_near(x) if source.geographic else x, y)
    except (errors.RasterioError, failures.CPLE_BaseError, ValueError):
        systems = " to ".join(system.text[:60] for system in (source, target))
        raise EstimatorError(
            f"{path}: PROJ can't transform its places from {systems}; give their coordinate reference system "
            f"with `crs`, {EXAMPLE}"
        ) from None
    return np.asarray(found[0], dtype=np.float64), np.asarray(found[1], dtype=np.float64)


def grid_degrees(home: GeodeticPosition, north_m: Array, east_m: Array) -> tuple[Array, Array]:
    """Latitudes (rows,) and longitudes (columns,) of a map's grid lines, WGS84; longitudes may pass 180."""
    per_lat, per_lon = LocalFrame(home).metres_per_degree
    return home.lat_deg + north_m / per_lat, home.lon_deg + east_m / per_lon
