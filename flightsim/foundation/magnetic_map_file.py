"""The file of a magnetic map: total field on a regular grid, as a survey publishes it.

A simulated world makes its true field from such a file, and missions and estimators compare readings with it.
The file is a numpy `.npz` archive that needs nothing of this package to be read:

    format                  "flightstack-magnetic-map-1"
    north_m  (rows,)        grid lines, metres north of home, rising
    east_m   (columns,)     metres east of home, likewise
    total_field_nt          (rows, columns) float64, main field and anomaly; NaN: no data there
    vertical_gradient_nt_m  (rows, columns) change of the total field with height, upwards; absent: not known
    height_m                height above home that the map is valid at
    home_lat_deg, home_lon_deg, home_alt_m   the home whose local frame it is in (WGS84)
    error_nt                stated standard deviation of total_field_nt; absent: not stated
    line_spacing_m          distance of the survey's lines, across which the error changes; absent: not stated

Between grid points it is interpolated bilinearly in both arrays. A reading at a height h compares with
total_field_nt + vertical_gradient_nt_m * (h - height_m).
"""

import io
import math
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.file_content import FileError
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.npz_file import NpzFileError, read_npz

Array = NDArray[np.float64]

FORMAT: Final = "flightstack-magnetic-map-1"
EARTH_NT: Final = (18_000.0, 72_000.0)
"""Smallest and largest total field on the Earth, with anomalies."""

_ARRAYS: Final = ("north_m", "east_m", "total_field_nt")
_NUMBERS: Final = ("height_m", "home_lat_deg", "home_lon_deg", "home_alt_m")
_STATED: Final = ("error_nt", "line_spacing_m")


class MagneticMapError(ValueError):
    """A map that can't be used; the message gives the reason."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MapContents:
    """The contents of a map's file.

    Attributes:
        north_m, east_m: (rows,), (columns,) grid lines, rising.
        total_field_nt: (rows, columns); NaN where there is no data.
        vertical_gradient_nt_m: (rows, columns) upward derivative; None: not known.
        height_m: above home, what the map is valid at.
        home: origin of its frame.
        error_nt: standard deviation of `total_field_nt` as the survey states it; None: not stated.
        line_spacing_m: distance of the survey's lines; None: not stated.

    Raises:
        MagneticMapError: the grid is not one, or has no data.
    """

    north_m: Array
    east_m: Array
    total_field_nt: Array
    height_m: float
    home: GeodeticPosition
    vertical_gradient_nt_m: Array | None = None
    error_nt: float | None = None
    line_spacing_m: float | None = None

    def __post_init__(self) -> None:
        shape = (self.north_m.size, self.east_m.size)
        rising = all(
            lines.ndim == 1 and lines.size >= 2 and bool(np.all(np.diff(lines) > 0.0))
            for lines in (self.north_m, self.east_m)
        )
        gradient = self.vertical_gradient_nt_m
        if not rising or self.total_field_nt.shape != shape:
            raise MagneticMapError(
                f"its grid of {self.total_field_nt.shape} does not fit {self.north_m.size} rising lines "
                f"north and {self.east_m.size} east"
            )
        if gradient is not None and gradient.shape != shape:
            raise MagneticMapError(
                f"vertical_gradient_nt_m has shape {gradient.shape}; its grid lines make {shape}"
            )
        if not np.any(np.isfinite(self.total_field_nt)) or np.any(np.isinf(self.total_field_nt)):
            raise MagneticMapError("it has no data: total_field_nt needs finite numbers")
        if gradient is not None and not np.all(np.isfinite(gradient[np.isfinite(self.total_field_nt)])):
            raise MagneticMapError(
                "vertical_gradient_nt_m has no number at places where total_field_nt has one; leave it out, "
                "or fill it"
            )
        if not math.isfinite(self.height_m):
            raise MagneticMapError(f"height_m {self.height_m} is not finite")
        for name, value in (("error_nt", self.error_nt), ("line_spacing_m", self.line_spacing_m)):
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise MagneticMapError(f"{name} {value:g} is not accepted; more than 0 is")


def map_file_bytes(contents: MapContents) -> bytes:
    """The file of a map; the same map gives the same bytes."""
    home = contents.home
    found: dict[str, Any] = {
        "format": FORMAT,
        **{name: getattr(contents, name) for name in _ARRAYS},
        "height_m": contents.height_m,
        "home_lat_deg": home.lat_deg,
        "home_lon_deg": home.lon_deg,
        "home_alt_m": home.alt_m,
    }
    for name in ("vertical_gradient_nt_m", *_STATED):
        if getattr(contents, name) is not None:
            found[name] = getattr(contents, name)
    file = io.BytesIO()
    # like numpy.savez_compressed, but without the time of day
    with zipfile.ZipFile(file, "w", compression=zipfile.ZIP_DEFLATED) as archive:
        for name, value in found.items():
            member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(member, "w", force_zip64=True) as part:
                np.lib.format.write_array(part, np.asanyarray(value), allow_pickle=False)
    return file.getvalue()


def read_map_file(path: Path) -> MapContents:
    """Read the file of a map.

    Raises:
        MagneticMapError: the file does not exist or is not a map, or the map has no data or values that are
            no total field of the Earth.
    """
    try:
        found = read_npz(path)
    except FileError as error:
        raise MagneticMapError(str(error)) from None
    except NpzFileError as error:
        raise MagneticMapError(f"{path} is not a magnetic map (a numpy .npz archive): {error}") from None
    missing = [name for name in ("format", *_ARRAYS, *_NUMBERS) if name not in found]
    if missing:
        raise MagneticMapError(f"{path} is not a magnetic map: it has no {', '.join(missing)}")
    if str(found["format"]) != FORMAT:
        raise MagneticMapError(f"{path} has the format {found['format']}; accepted is {FORMAT}")
    try:
        contents = _contents(found)
    except ValueError as error:
        raise MagneticMapError(f"{path}: {error}") from None
    low, high = np.nanmin(contents.total_field_nt), np.nanmax(contents.total_field_nt)
    if not EARTH_NT[0] <= low <= high <= EARTH_NT[1]:
        raise MagneticMapError(
            f"{path} has values from {low:g} to {high:g} nT, which is no total field of the Earth "
            f"({EARTH_NT[0]:g} to {EARTH_NT[1]:g} nT); total_field_nt is main field and anomaly together"
        )
    return contents


def _contents(found: Mapping[str, NDArray[Any]]) -> MapContents:
    height_m, lat_deg, lon_deg, alt_m = (_number(name, found[name]) for name in _NUMBERS)
    gradient = found.get("vertical_gradient_nt_m")
    north_m, east_m, total_nt = (_real(name, found[name]) for name in _ARRAYS)
    stated = {name: _number(name, found[name]) for name in _STATED if name in found}
    return MapContents(
        north_m=north_m,
        east_m=east_m,
        total_field_nt=total_nt,
        vertical_gradient_nt_m=None if gradient is None else _real("vertical_gradient_nt_m", gradient),
        height_m=height_m,
        home=GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m),
        error_nt=stated.get("error_nt"),
        line_spacing_m=stated.get("line_spacing_m"),
    )


def _real(name: str, values: NDArray[Any]) -> Array:
    if values.dtype.kind not in "iuf":
        raise MagneticMapError(f"{name} holds {values.dtype} and no real numbers")
    return values.astype(np.float64)


def _number(name: str, values: NDArray[Any]) -> float:
    if values.size != 1:
        raise MagneticMapError(f"{name} has the shape {values.shape}; it is to be one number")
    return float(_real(name, values).reshape(()))
