"""Entry into a pattern and exit from it: straight flight before and after it, entered from a circle."""

import math
from dataclasses import dataclass
from typing import Final

from flightsim.foundation.geodesy import LocalFrame
from missions.planning.flyable import FlyablePath
from missions.vehicle import telemetry
from missions.vehicle.vehicle import Vehicle

_LEAD_IN_S: Final = 8.0  # straight flight before the pattern, in which the remaining errors of a turn settle
_LEAD_OUT_S: Final = 4.0
_CIRCLE_RADII: Final = 1.3  # multiple of the tightest turn's radius; leaves a margin for the guidance
_READY_RAD: Final = math.radians(12.0)
_NEAR: Final = 0.5  # share of the circle's radius


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A circle that touches the path at its beginning and is left along the path.

    Attributes:
        centre_m: centre, north and east.
        radius_m: radius of the circle.
        clockwise: direction, seen from above.
        north_m, east_m, course_rad: place where it is left, and course there.
    """

    centre_m: tuple[float, float]
    radius_m: float
    clockwise: bool
    north_m: float
    east_m: float
    course_rad: float

    @classmethod
    def to(cls, path: FlyablePath, turn_radius_m: float, from_m: tuple[float, float] = (0.0, 0.0)) -> "Entry":
        """The circle at a path's beginning, on the side from which the aircraft comes."""
        (north, east), course, _ = path.at(float(path.arc_m[0]))
        radius_m = _CIRCLE_RADII * turn_radius_m
        right = (from_m[1] - east) * math.cos(course) - (from_m[0] - north) * math.sin(course) >= 0.0
        side = 1.0 if right else -1.0
        return cls(
            centre_m=(
                north - side * radius_m * math.sin(course),
                east + side * radius_m * math.cos(course),
            ),
            radius_m=radius_m,
            clockwise=right,
            north_m=north,
            east_m=east,
            course_rad=course,
        )

    def leaving(self, vehicle: Vehicle, soon_s: float) -> bool:
        """Whether the aircraft will fly along the path's beginning after `soon_s`."""
        p = vehicle.latest(telemetry.Position)
        if p is None:
            return False
        north, east, _ = LocalFrame(vehicle.home).ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
        vel_north, vel_east = p.vel_ned_m_s[0], p.vel_ned_m_s[1]
        near = math.hypot(
            north + soon_s * vel_north - self.north_m, east + soon_s * vel_east - self.east_m
        ) < max(40.0, _NEAR * self.radius_m)
        turning = (1.0 if self.clockwise else -1.0) * p.ground_speed_m_s / self.radius_m
        course = math.atan2(vel_east, vel_north) + turning * soon_s
        return near and abs(math.remainder(course - self.course_rad, math.tau)) < _READY_RAD


def with_leads(path: FlyablePath, ground_speed_m_s: float) -> FlyablePath:
    """A pattern's path with entry and exit, for the highest ground speed."""
    return path.with_leads(_LEAD_IN_S * ground_speed_m_s, _LEAD_OUT_S * ground_speed_m_s)
