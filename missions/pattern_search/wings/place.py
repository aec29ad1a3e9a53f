"""Place of an aircraft along a path, from its telemetry."""

import math

from flightsim.foundation.geodesy import LocalFrame
from missions.errors import MissionError
from missions.planning.flyable import FlyablePath
from missions.vehicle import telemetry
from missions.vehicle.vehicle import Vehicle

_AHEAD_M = 80.0
_OLDEST_S = 1.0  # longest extrapolation of a position by its velocity


class PlaceOnPath:
    """The place along a path, updated by every `update`; it never goes back.

    Args:
        vehicle: vehicle whose home is the path's origin.
        path: path with entry and exit.
        from_arc_m: initial place of the aircraft along the path.

    Attributes:
        arc_m: distance of the place along the path.
        north_m, east_m: present position of the aircraft.
        vel_north_m_s, vel_east_m_s: velocity over ground.
        ground_speed_m_s: ground speed, at least 1.
        across_m: distance from the path, positive to the right of it.
    """

    def __init__(self, vehicle: Vehicle, path: FlyablePath, from_arc_m: float) -> None:
        self.arc_m = from_arc_m
        self.north_m = self.east_m = 0.0
        self.vel_north_m_s = self.vel_east_m_s = 0.0
        self.ground_speed_m_s = 1.0
        self.across_m = 0.0
        self._vehicle = vehicle
        self._path = path
        self._frame = LocalFrame(vehicle.home)

    def update(self) -> None:
        """Read the present position of the aircraft.

        Raises:
            MissionError: it reports no position, or is no longer armed.
        """
        vehicle = self._vehicle
        p = vehicle.latest(telemetry.Position)
        if p is None:
            raise MissionError(f"the vehicle reports no position in flight; {vehicle.link.last_received()}")
        vehicle.link.require_armed("before the pattern was flown")
        north, east, _ = self._frame.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
        late_s = min(_OLDEST_S, max(0.0, (vehicle.clock.stamp_us - p.time_us) * 1e-6))
        self.vel_north_m_s, self.vel_east_m_s = p.vel_ned_m_s[0], p.vel_ned_m_s[1]
        self.north_m = north + late_s * self.vel_north_m_s
        self.east_m = east + late_s * self.vel_east_m_s
        self.ground_speed_m_s = max(1.0, p.ground_speed_m_s)
        found = self._path.nearest(self.north_m, self.east_m, from_arc_m=self.arc_m, ahead_m=_AHEAD_M)
        self.arc_m = max(self.arc_m, found)
        (path_north, path_east), course, _ = self._path.at(self.arc_m)
        self.across_m = (self.east_m - path_east) * math.cos(course) - (self.north_m - path_north) * math.sin(
            course
        )
