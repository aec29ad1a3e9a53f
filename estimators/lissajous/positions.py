"""Positions of a vehicle from different messages in one form."""

import math
from dataclasses import dataclass
from typing import Final

from estimators.lissajous.parameters import Source
from estimators.messages import Message
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

MESSAGES: Final = {
    Source.GPS: "GPS_RAW_INT",
    Source.GLOBAL: "GLOBAL_POSITION_INT",
    Source.LOCAL: "LOCAL_POSITION_NED",
}

_NOT_KNOWN: Final = 65535
_FIX_2D: Final = 2
_MAX_LAT_E7: Final = 900_000_000
_MAX_LON_E7: Final = 1_800_000_000


@dataclass(frozen=True, slots=True)
class Fix:
    """One position measurement.

    Attributes:
        lat_deg, lon_deg, alt_m: place, altitude above mean sea level.
        north_m_s, east_m_s: velocity over ground; NaN: not measured.
    """

    lat_deg: float
    lon_deg: float
    alt_m: float
    north_m_s: float
    east_m_s: float


class PositionReader:
    """Reads the position messages of one vehicle.

    Args:
        source: the message to use.

    Attributes:
        message: name of this message.
        home: home from HOME_POSITION; None before it was received.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.message = MESSAGES[source]
        self.home: GeodeticPosition | None = None
        self._local: LocalFrame | None = None

    def take_home(self, message: Message) -> bool:
        """Process a HOME_POSITION; returns False when its position is invalid."""
        if abs(message.latitude) > _MAX_LAT_E7 or abs(message.longitude) > _MAX_LON_E7:
            return False
        place = GeodeticPosition(
            lat_deg=1e-7 * message.latitude, lon_deg=1e-7 * message.longitude, alt_m=1e-3 * message.altitude
        )
        self.home = place
        offset = (float(message.x), float(message.y), float(message.z))
        if all(map(math.isfinite, offset)):
            lat_deg, lon_deg, alt_m = LocalFrame(place).geodetic_from_ned(*(-value for value in offset))
            if abs(lat_deg) <= 90.0:
                self._local = LocalFrame(GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m))
        return True

    def read(self, message: Message) -> Fix | None:
        """The position in a message of the source; None when it contains no position (yet)."""
        if self.source is Source.LOCAL:
            return self._read_local(message)
        if abs(message.lat) > _MAX_LAT_E7 or abs(message.lon) > _MAX_LON_E7:
            return None
        if self.source is Source.GLOBAL:
            north_m_s, east_m_s = 0.01 * message.vx, 0.01 * message.vy
        else:
            if message.fix_type < _FIX_2D or (message.lat == 0 and message.lon == 0):
                return None
            north_m_s = east_m_s = math.nan
            if message.vel != _NOT_KNOWN and message.cog != _NOT_KNOWN:
                course_rad = math.radians(0.01 * message.cog)
                north_m_s = 0.01 * message.vel * math.cos(course_rad)
                east_m_s = 0.01 * message.vel * math.sin(course_rad)
        return Fix(1e-7 * message.lat, 1e-7 * message.lon, 1e-3 * message.alt, north_m_s, east_m_s)

    def _read_local(self, message: Message) -> Fix | None:
        if self._local is None:
            return None
        lat_deg, lon_deg, alt_m = self._local.geodetic_from_ned(message.x, message.y, message.z)
        return Fix(lat_deg, lon_deg, alt_m, float(message.vx), float(message.vy))


def values_of(source: Source, message: Message) -> tuple[float, ...]:
    """The values of a position message that the estimator uses, for the input guard."""
    if source is Source.GPS:
        return (message.lat, message.lon, message.alt, message.vel, message.cog)
    if source is Source.GLOBAL:
        return (message.lat, message.lon, message.alt, message.vx, message.vy)
    return (message.x, message.y, message.z, message.vx, message.vy)
