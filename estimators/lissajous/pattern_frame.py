"""The pattern's frame on the ground, and one vehicle's track in it.

Positions of a vehicle from different messages in one form.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from autopilot_bridge.mavlink.wire_units import (
    UNKNOWN_UINT16,
    cdeg_degrees,
    home_of,
    m_s,
    place_of,
    velocity_of,
)
from estimators import wire
from estimators.lissajous.model import Array
from estimators.lissajous.motion_filter import MotionFilter
from estimators.lissajous.parameters import LissajousParameters, Source
from estimators.messages import Message, is_a
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

MESSAGES: Final = {
    Source.GPS: "GPS_RAW_INT",
    Source.GLOBAL: "GLOBAL_POSITION_INT",
    Source.LOCAL: "LOCAL_POSITION_NED",
}

_FIX_2D: Final = 2


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

    def take_home(self, message: wire.HOME_POSITION) -> bool:
        """Process a HOME_POSITION; returns False when its position is invalid."""
        place = home_of(message)
        if place is None:
            return False
        self.home = place
        offset = (float(message.x), float(message.y), float(message.z))
        if all(map(math.isfinite, offset)):
            lat_deg, lon_deg, alt_m = LocalFrame(place).geodetic_from_ned(*(-value for value in offset))
            if abs(lat_deg) <= 90.0:
                self._local = LocalFrame(GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m))
        return True

    def read(self, message: Message) -> Fix | None:
        """The position in a message of the source; None when it contains no position (yet)."""
        if is_a(message, wire.LOCAL_POSITION_NED):
            return self._read_local(message)
        if is_a(message, wire.GLOBAL_POSITION_INT):
            north_m_s, east_m_s, _ = velocity_of(message)
            return self._fix(message, (north_m_s, east_m_s))
        if not is_a(message, wire.GPS_RAW_INT):
            return None
        if message.fix_type < _FIX_2D or (message.lat == 0 and message.lon == 0):
            return None
        velocity = (math.nan, math.nan)
        if message.vel != UNKNOWN_UINT16 and message.cog != UNKNOWN_UINT16:
            course_rad, speed_m_s = math.radians(cdeg_degrees(message.cog)), m_s(message.vel)
            velocity = (speed_m_s * math.cos(course_rad), speed_m_s * math.sin(course_rad))
        return self._fix(message, velocity)

    @staticmethod
    def _fix(
        message: wire.GLOBAL_POSITION_INT | wire.GPS_RAW_INT, velocity_m_s: tuple[float, float]
    ) -> Fix | None:
        place = place_of(message)
        return None if place is None else Fix(place.lat_deg, place.lon_deg, place.alt_m, *velocity_m_s)

    def _read_local(self, message: wire.LOCAL_POSITION_NED) -> Fix | None:
        if self._local is None:
            return None
        lat_deg, lon_deg, alt_m = self._local.geodetic_from_ned(message.x, message.y, message.z)
        return Fix(lat_deg, lon_deg, alt_m, float(message.vx), float(message.vy))


def values_of(message: Message) -> tuple[float, ...]:
    """The values of a position message that the estimator uses, for the input guard."""
    if is_a(message, wire.GPS_RAW_INT):
        return (message.lat, message.lon, message.alt, message.vel, message.cog)
    if is_a(message, wire.GLOBAL_POSITION_INT):
        return (message.lat, message.lon, message.alt, message.vx, message.vy)
    if is_a(message, wire.LOCAL_POSITION_NED):
        return (message.x, message.y, message.z, message.vx, message.vy)
    return ()


class PatternFrame:
    """The pattern's frame: its centre, and its axes relative to north.

    Args:
        parameters: parameters of the estimator.
        home: home of the vehicle, for a centre that is not specified by coordinates.
    """

    def __init__(self, parameters: LissajousParameters, home: GeodeticPosition) -> None:
        p = parameters
        place = home
        if p.centre_lat_deg is not None and p.centre_lon_deg is not None:
            place = GeodeticPosition(lat_deg=p.centre_lat_deg, lon_deg=p.centre_lon_deg, alt_m=home.alt_m)
        lat_deg, lon_deg, alt_m = LocalFrame(place).geodetic_from_ned(p.centre_north_m, p.centre_east_m, 0.0)
        self.frame = LocalFrame(GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m))
        self.orientation_rad = p.orientation_rad
        self._cos, self._sin = math.cos(p.orientation_rad), math.sin(p.orientation_rad)

    def along(self, north: float, east: float) -> tuple[float, float]:
        """(x, y) of a vector that is given in north and east."""
        return self._cos * north + self._sin * east, -self._sin * north + self._cos * east

    def north_east(self, x: float, y: float) -> tuple[float, float]:
        """(north, east) of a vector that is given along the pattern's axes."""
        return self._cos * x - self._sin * y, self._sin * x + self._cos * y

    def place(self, fix: Fix) -> tuple[float, float]:
        """(x, y) of a fix, m from the centre."""
        north_m, east_m, _ = self.frame.ned_from_geodetic(fix.lat_deg, fix.lon_deg, fix.alt_m)
        return self.along(north_m, east_m)

    def velocity(self, fix: Fix) -> tuple[float, float]:
        """(x, y) components of a fix's velocity, m/s."""
        return self.along(fix.north_m_s, fix.east_m_s)

    def origin_of(self, other: "PatternFrame") -> tuple[float, float]:
        """(x, y) of the centre of another pattern with the same orientation."""
        o = other.frame.origin
        north_m, east_m, _ = self.frame.ned_from_geodetic(o.lat_deg, o.lon_deg, o.alt_m)
        return self.along(north_m, east_m)

    def geodetic(self, x: float, y: float) -> GeodeticPosition:
        """Geodetic position of a point (x, y) at the pattern's altitude."""
        lat_deg, lon_deg, alt_m = self.frame.geodetic_from_ned(*self.north_east(x, y), 0.0)
        return GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m)

    def motion_ned(self, state: Array, covariance: Array) -> tuple[Array, Array]:
        """State (north, its rate, east, its rate) and its covariance, from those along the pattern's axes."""
        c, s = self._cos, self._sin
        turn = np.array([[c, 0.0, -s, 0.0], [0.0, c, 0.0, -s], [s, 0.0, c, 0.0], [0.0, s, 0.0, c]])
        return turn @ state[:4], turn @ covariance[:4, :4] @ turn.T


class Track:
    """One vehicle's filter in a pattern's frame. The frame may change, because home is set again on arming.

    Attributes:
        filter: filter of its motion.
        pattern: the frame; None before home or centre is known.
    """

    def __init__(self, parameters: LissajousParameters) -> None:
        self.parameters = parameters
        self.filter = MotionFilter(parameters)
        self.pattern: PatternFrame | None = None
        self._delay_us = round(1e6 * parameters.position_delay_s)

    def place_pattern(self, pattern: PatternFrame) -> None:
        """Set the pattern's frame. If it has moved, the present state is transformed to the new frame."""
        if self.pattern is not None:
            self.filter.move_origin(*self.pattern.origin_of(pattern))
        self.pattern = pattern

    def take(self, time_us: int, fix: Fix) -> bool:
        """Process a position; returns False while the pattern's place is not known."""
        if self.pattern is None:
            return False
        x, y = self.pattern.place(fix)
        vx, vy = self.pattern.velocity(fix)
        self.filter.take(time_us - self._delay_us, x, vx, y, vy)
        return True
