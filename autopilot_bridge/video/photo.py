"""Photos as JPEG files, with the camera's position and settings in Exif 2.32."""

import math
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from PIL.ExifTags import GPS, IFD, Base


def save_photo(path: Path, picture: NDArray[np.uint8], notes: dict[str, Any]) -> None:
    """Write a picture (height, width, 3), BGR.

    Args:
        path: a new file.
        picture: the picture.
        notes: known values among "lat_deg", "lon_deg", "alt_m" (above mean sea level), "yaw_deg" (of the
            optical axis from true north), "unix_us", "focal_mm", "focal_35_mm"; and the JPEG "quality",
            1 to 100.

    Raises:
        OSError: the file exists, or can't be written; then no partial file is left.
    """
    encoded = BytesIO()
    Image.fromarray(picture[:, :, ::-1]).save(
        encoded, "JPEG", quality=int(notes["quality"]), exif=_exif(notes)
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    file = path.open("xb")
    try:
        with file:
            file.write(encoded.getbuffer())
    except OSError:
        path.unlink(missing_ok=True)
        raise


def _exif(notes: dict[str, Any]) -> Image.Exif:
    exif = Image.Exif()
    exif[Base.Make] = "flightstack"
    exif[Base.Model] = "simulated camera"
    more: dict[int, Any] = {}
    if "focal_mm" in notes:
        more[Base.FocalLength] = float(notes["focal_mm"])
        more[Base.FocalLengthIn35mmFilm] = round(notes["focal_35_mm"])
    gps: dict[int, Any] = {}
    if "unix_us" in notes:
        moment = datetime.fromtimestamp(notes["unix_us"] * 1e-6, UTC)
        exif[Base.DateTime] = moment.strftime("%Y:%m:%d %H:%M:%S")
        more[Base.DateTimeOriginal] = moment.strftime("%Y:%m:%d %H:%M:%S")
        more[Base.SubsecTimeOriginal] = f"{moment.microsecond // 1000:03d}"
        more[Base.OffsetTimeOriginal] = "+00:00"
        gps[GPS.GPSDateStamp] = moment.strftime("%Y:%m:%d")
        gps[GPS.GPSTimeStamp] = (
            float(moment.hour),
            float(moment.minute),
            moment.second + moment.microsecond * 1e-6,
        )
    if "lat_deg" in notes:
        gps[GPS.GPSVersionID] = b"\x02\x03\x00\x00"
        gps[GPS.GPSLatitudeRef] = "N" if notes["lat_deg"] >= 0.0 else "S"
        gps[GPS.GPSLatitude] = _sexagesimal(notes["lat_deg"])
        gps[GPS.GPSLongitudeRef] = "E" if notes["lon_deg"] >= 0.0 else "W"
        gps[GPS.GPSLongitude] = _sexagesimal(notes["lon_deg"])
        gps[GPS.GPSAltitudeRef] = b"\x00" if notes["alt_m"] >= 0.0 else b"\x01"
        gps[GPS.GPSAltitude] = abs(float(notes["alt_m"]))
        gps[GPS.GPSMapDatum] = "WGS-84"
    if "yaw_deg" in notes:
        gps[GPS.GPSImgDirectionRef] = "T"
        gps[GPS.GPSImgDirection] = notes["yaw_deg"] % 360.0
    exif.get_ifd(IFD.Exif).update(more)
    exif.get_ifd(IFD.GPSInfo).update(gps)
    return exif


def _sexagesimal(angle_deg: float) -> tuple[float, float, float]:
    """Degrees, minutes, seconds."""
    whole, minutes = divmod(abs(angle_deg) * 60.0, 60.0)
    whole_minutes = math.floor(minutes)
    return whole, float(whole_minutes), (minutes - whole_minutes) * 60.0
