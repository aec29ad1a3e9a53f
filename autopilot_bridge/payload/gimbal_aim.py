"""The target that a gimbal follows automatically: a position, or another system that reports its position."""

import math
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.wire_units import degrees, metres, velocity_of
from autopilot_bridge.mission_wire import RELATIVE_FRAMES, TERRAIN_FRAMES
from autopilot_bridge.payload.reported_vehicle import STALE_US, ReportedVehicle
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

_RELATIVE_FRAMES: Final = RELATIVE_FRAMES | TERRAIN_FRAMES  # the ground is assumed level with home
_HAS_POSITION: Final = 1  # of FOLLOW_TARGET.est_capabilities
_HAS_VELOCITY: Final = 2
_FASTEST_M_S: Final = 1000.0


class GimbalAim:
    """A region of interest.

    Attributes:
        system_id: id of the followed system; 0: none.
    """

    def __init__(self, vehicle: ReportedVehicle) -> None:
        self._vehicle = vehicle
        self._place: GeodeticPosition | None = None
        self._velocity_ned_m_s = (0.0, 0.0, 0.0)
        self._commanded_us = 0
        self.system_id = 0

    @property
    def active(self) -> bool:
        """There is a target."""
        return self._place is not None or self.system_id != 0

    def clear(self) -> None:
        """Remove the target."""
        self._place, self.system_id = None, 0

    def look_at(self, lat_deg: float, lon_deg: float, alt_m: float, frame: int) -> bool | None:
        """Point at a position; False: it is invalid; None: it can't be computed yet."""
        if not (abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0 and abs(alt_m) < 1e5):
            return False
        if frame in _RELATIVE_FRAMES:
            alt_m += self._vehicle.home_alt_m
        if self._vehicle.position is None or math.isnan(alt_m):
            return None
        self._place = GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m)
        self._velocity_ned_m_s = (0.0, 0.0, 0.0)
        self.system_id = 0
        return True

    def follow(self, system_id: int) -> None:
        """Point at another system, as long as it reports its position."""
        if system_id != self.system_id:
            self._place = None
        self.system_id = system_id

    def handle(self, message: MAVLinkMessage, sender: tuple[int, int], time_us: int) -> None:
        """Handle GLOBAL_POSITION_INT or FOLLOW_TARGET of the followed system."""
        if sender[0] != self.system_id or not self.system_id:
            return
        match message:
            case dialect.MAVLink_global_position_int_message():
                alt_m = metres(message.alt)
                velocity = velocity_of(message)
            case dialect.MAVLink_follow_target_message() if message.est_capabilities & _HAS_POSITION:
                alt_m = float(message.alt)
                moves = message.est_capabilities & _HAS_VELOCITY
                north, east, down = message.vel if moves else (0.0, 0.0, 0.0)
                velocity = (float(north), float(east), float(down))
            case _:
                return
        fits = abs(message.lat) <= 900_000_000 and abs(message.lon) <= 1_800_000_000 and abs(alt_m) < 1e5
        if not fits or not all(abs(speed) < _FASTEST_M_S for speed in velocity):
            return
        self._place = GeodeticPosition(
            lat_deg=degrees(message.lat), lon_deg=degrees(message.lon), alt_m=alt_m
        )
        self._velocity_ned_m_s = velocity
        self._commanded_us = time_us

    def direction(self, time_us: int) -> tuple[float, float] | None:
        """(pitch, yaw from north), radians, of the target; None: not known now.

        A moving target is extrapolated in a straight line for up to three seconds after its last message.
        """
        here, place = self._vehicle.position, self._place
        if here is None or place is None:
            return None
        north, east, down = LocalFrame(here).ned_from_geodetic(place.lat_deg, place.lon_deg, place.alt_m)
        if self.system_id:
            elapsed_us = time_us - self._commanded_us
            if elapsed_us > STALE_US:
                return None
            ways = (1e-6 * elapsed_us * speed for speed in self._velocity_ned_m_s)
            north, east, down = (value + way for value, way in zip((north, east, down), ways, strict=True))
        if north == east == down == 0.0:
            return None
        return -math.atan2(down, math.hypot(north, east)), math.atan2(east, north)
