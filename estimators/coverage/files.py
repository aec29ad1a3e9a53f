"""The files of a coverage, and the file of a searched area."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.coverage.coverage import Coverage
from estimators.errors import EstimatorError
from estimators.survey.geotiff import write_geotiff
from flightsim.foundation.file_content import TEXT_BYTES, FileError, read_text
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

__all__ = ["read_area", "write_coverage_geotiff"]


def read_area(path: Path, origin: GeodeticPosition) -> NDArray[np.float64]:
    """The corners of the polygon in a GeoJSON file, (n, 2) north and east of an origin, m.

    Args:
        path: the file: a Polygon, or features of which the first Polygon counts. Holes are not accepted.
        origin: of the corners.

    Raises:
        EstimatorError: it can't be read, or has no such polygon.
    """
    try:
        rings = _rings(json.loads(read_text(path, max_bytes=TEXT_BYTES)))
        if rings is None or len(rings) != 1:
            raise EstimatorError(f"{path} has no Polygon without holes; give a GeoJSON file with one")
        corners = np.array([position[:2] for position in rings[0]], dtype=np.float64)
    except FileError as error:
        raise EstimatorError(str(error)) from error
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        if isinstance(error, EstimatorError):
            raise
        raise EstimatorError(f"{path} is no GeoJSON: {error}") from error
    lon, lat = corners.T
    if len(corners) < 4 or not (np.abs(lat) <= 90.0).all() or not (np.abs(lon) <= 180.0).all():
        raise EstimatorError(f"{path}: a Polygon has 4 positions or more, longitude and latitude, degrees")
    north_m, east_m, _ = LocalFrame(origin).ned_from_geodetic(lat, lon, np.full(len(lat), origin.alt_m))
    return np.column_stack([north_m, east_m])


def _rings(found: Any) -> Sequence[Any] | None:
    """The rings of the first polygon in a GeoJSON object."""
    kind = found["type"]
    if kind == "Polygon":
        return list(found["coordinates"])
    if kind == "Feature":
        return None if found["geometry"] is None else _rings(found["geometry"])
    within = found["features"] if kind == "FeatureCollection" else ()
    return next((found for each in within if (found := _rings(each)) is not None), None)


def write_coverage_geotiff(path: Path, part: Path, coverage: Coverage) -> None:
    """Write the probability of detection and what was swept as two bands; NaN outside of the area.

    Raises:
        EstimatorError: rasterio is not installed.
    """
    inside = coverage.area.inside
    bands = {
        "pod": np.where(inside, coverage.pod, np.nan),
        "swept": np.where(inside, coverage.swept.astype(np.float64), np.nan),
    }
    north, east = coverage.area.layout.centres()
    about = {name: value for name, value in coverage.figures.items() if value is not None}
    axes = north.ravel(), east.ravel()
    write_geotiff(path, part, coverage.origin, axes, bands, units=("1", "1"), about=about)
