"""The units of messages on the wire, and SI units: one reader and writer of places, velocities and headings.

MAVLink sends latitudes and longitudes as degrees times 1e7, altitudes in millimetres, velocities in
centimetres per second and headings in hundredths of a degree (common.xml). The readers take a message of a
link, a row of a log (`estimators.wire`), or any other with the same fields. Contents are untrusted: a place
that is not on the Earth is None.
"""

import math
from collections.abc import Sequence
from typing import Any, Final, Protocol

from flightsim.foundation.geodetic_position import GeodeticPosition
from flightsim.foundation.vectors import Angle, Array, Vector

UNKNOWN_UINT16: Final = 0xFFFF
"""A heading, course, speed, dilution or voltage that is not known."""
_FULL_CIRCLE_CDEG: Final = 36000


class HasPlace(Protocol):
    """GLOBAL_POSITION_INT, GPS_RAW_INT, HIL_GPS and others: degE7, degE7, mm above mean sea level."""

    lat: int
    lon: int
    alt: int


class HasHome(Protocol):
    """HOME_POSITION, GPS_GLOBAL_ORIGIN, SET_GPS_GLOBAL_ORIGIN: degE7, degE7, mm above mean sea level."""

    latitude: int
    longitude: int
    altitude: int


class HasVelocity(Protocol):
    """GLOBAL_POSITION_INT, HIL_STATE_QUATERNION: cm/s in NED."""

    vx: int
    vy: int
    vz: int


class HasHeading(Protocol):
    """GLOBAL_POSITION_INT: hundredths of a degree."""

    hdg: int


class Columns(Protocol):
    """A table or a structured array with the columns of a message."""

    def __getitem__(self, field: str, /) -> Any: ...


# numbers, and arrays of them


def degrees(e7: Angle) -> Angle:
    """Degrees of degE7."""
    return e7 * 1e-7


def metres(mm: Angle) -> Angle:
    """Metres of millimetres."""
    return mm * 1e-3


def m_s(cm_s: Angle) -> Angle:
    """Metres per second of centimetres per second."""
    return cm_s * 0.01


def cdeg_degrees(cdeg: Angle) -> Angle:
    """Degrees of hundredths of a degree."""
    return cdeg * 0.01


def to_e7(degrees: Angle) -> Angle:
    """DegE7 of degrees, not rounded."""
    return degrees * 1e7


def e7(degrees: float) -> int:
    """DegE7 of degrees."""
    return round(to_e7(degrees))


def mm(metres: float) -> int:
    """Millimetres of metres."""
    return round(metres * 1e3)


def place_e7(place: GeodeticPosition) -> tuple[int, int, int]:
    """Latitude and longitude, degE7, and altitude, mm, of a place."""
    return e7(place.lat_deg), e7(place.lon_deg), mm(place.alt_m)


# messages


def place(lat_e7: int, lon_e7: int, alt_mm: int) -> GeodeticPosition | None:
    """A place of degE7, degE7 and mm; None: it is not on the Earth."""
    lat_deg, lon_deg = degrees(lat_e7), degrees(lon_e7)
    if not (abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0):
        return None
    return GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=metres(alt_mm))


def home(lat_e7: int, lon_e7: int, alt_mm: int) -> GeodeticPosition | None:
    """A home or origin of degE7, degE7 and mm; None: it is not on the Earth, or at 0, 0, which autopilots
    send before they have one.
    """
    return None if lat_e7 == 0 == lon_e7 else place(lat_e7, lon_e7, alt_mm)


def place_of(message: HasPlace) -> GeodeticPosition | None:
    """The place in a message; None: it is not on the Earth."""
    return place(message.lat, message.lon, message.alt)


def home_of(message: HasHome) -> GeodeticPosition | None:
    """The home or the origin in a message; None: it is none, as in `home`."""
    return home(message.latitude, message.longitude, message.altitude)


def velocity_of(message: HasVelocity) -> Vector:
    """The velocity in a message, NED, m/s."""
    return m_s(message.vx), m_s(message.vy), m_s(message.vz)


def heading_of(message: HasHeading) -> float:
    """The heading in a message, rad; NaN: not known."""
    return math.radians(cdeg_degrees(message.hdg)) if message.hdg <= _FULL_CIRCLE_CDEG else math.nan


def place_columns(table: Columns, names: Sequence[str] = ("lat", "lon", "alt")) -> tuple[Array, Array, Array]:
    """Latitudes and longitudes, degrees, and altitudes, m, of the messages in a table."""
    lat, lon, alt = names
    return degrees(table[lat]), degrees(table[lon]), metres(table[alt])
