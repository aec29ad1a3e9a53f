"""Where the tracker's operator has seen the target: a place on the Earth, relative to the aircraft."""

import math

from autopilot_bridge.mavlink.wire_units import degrees, home_of
from estimators import wire
from estimators.interface import Need
from estimators.messages import Message, is_a
from flightsim.foundation.geodesy import LocalFrame

_OLD_US = 1_000_000


class OperatorPlace:
    """A place from home, in the level frame of an aircraft with GPS.

    Args:
        north_m, east_m: the place from home; None: the place below the aircraft.
    """

    def __init__(self, north_m: float | None, east_m: float | None) -> None:
        self._goal = None if north_m is None or east_m is None else (north_m, east_m)
        self._frame: LocalFrame | None = None
        self._own: tuple[int, float, float] | None = None
        self._yaw_rad = math.nan

    @property
    def needs(self) -> list[Need]:
        """Messages of the aircraft that it needs."""
        return [
            Need(messages=("HOME_POSITION",), rate_hz=0.0, purpose="home, the origin of the target's place"),
            Need(messages=("GLOBAL_POSITION_INT",), rate_hz=1.0, wanted_rate_hz=5.0, purpose="position"),
            Need(messages=("ATTITUDE",), rate_hz=1.0, wanted_rate_hz=10.0, purpose="heading"),
        ]

    def take(self, time_us: int, message: Message) -> None:
        """Process a message of the aircraft."""
        if is_a(message, wire.HOME_POSITION):
            home = home_of(message)
            if home is not None:
                self._frame = LocalFrame(home)
        elif is_a(message, wire.GLOBAL_POSITION_INT) and self._frame is not None:
            north_m, east_m, _ = self._frame.ned_from_geodetic(
                degrees(message.lat), degrees(message.lon), self._frame.origin.alt_m
            )
            self._own = (time_us, north_m, east_m)
        elif is_a(message, wire.ATTITUDE) and math.isfinite(message.yaw):
            self._yaw_rad = message.yaw

    def level(self, time_us: int) -> tuple[float, float] | None:
        """Forward and right of the place; None: the position is not known."""
        if self._goal is None:
            return (0.0, 0.0)
        if self._own is None or time_us - self._own[0] > _OLD_US or math.isnan(self._yaw_rad):
            return None
        north, east = self._goal[0] - self._own[1], self._goal[1] - self._own[2]
        c, s = math.cos(self._yaw_rad), math.sin(self._yaw_rad)
        return (c * north + s * east, -s * north + c * east)
