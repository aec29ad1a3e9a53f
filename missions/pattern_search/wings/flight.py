"""Common parts of both ways to fly a pattern with a fixed wing: its path, and the approach at its end.

Entry into a pattern and exit from it: straight flight before and after it, entered from a circle.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from flightsim.foundation.geodesy import LocalFrame
from missions.notes import CommandedPath
from missions.options import FlightOptions
from missions.planning.flyable import FlyablePath
from missions.planning.limits import FixedWingLimits
from missions.vehicle import telemetry
from missions.vehicle.vehicle import Vehicle
from missions.vehicle.wing import Approach

_APPROACH_HEIGHT_M: Final = 40.0
_APPROACH_LAYER_M: Final = 15.0
_APPROACH_CIRCLE_M: Final = 80.0
_SLOW: Final = 0.5  # share of the airspeed: slowest ground speed that deadlines allow for


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternFlight:
    """One aircraft's pattern.

    Attributes:
        options: options as this aircraft flies them.
        limits: limits of this aircraft.
        path: path of the pattern, from home.
        route: path with straight flight before and after it.
        turn_radius_m: radius of the tightest turn over ground.
    """

    options: FlightOptions
    limits: FixedWingLimits
    path: FlyablePath
    route: FlyablePath
    turn_radius_m: float

    @property
    def slow_m_s(self) -> float:
        """Slowest ground speed that a deadline allows for."""
        return _SLOW * self.options.speed_m_s

    @property
    def away_s(self) -> float:
        """Longest time of a flight from any place of the pattern to its start, or home."""
        return (self.route.reach_m + 10.0 * self.turn_radius_m) / self.slow_m_s

    def commanded(
        self, vehicle: Vehicle, waypoints: list[tuple[float, float]], acceptance_m: float
    ) -> CommandedPath:
        """The path with which the flight is compared."""
        down_m = -self.options.own_altitude_m
        points = self.path.points_m
        return CommandedPath(
            origin=vehicle.home,
            points_ned_m=np.column_stack((points, np.full(len(points), down_m))),
            waypoints_ned_m=np.array([(n, e, down_m) for n, e in waypoints]).reshape(-1, 3),
            acceptance_m=acceptance_m,
        )

    def approach(self, vehicle: Vehicle) -> Approach:
        """Approach to the runway of the takeoff."""
        return runway_approach(vehicle, self.options.index, self.turn_radius_m)


def runway_approach(vehicle: Vehicle, index: int, turn_radius_m: float) -> Approach:
    """Approach to the runway of the takeoff; the circles of a team are in layers.

    Args:
        vehicle: the aircraft.
        index: its number in the team.
        turn_radius_m: of its turns over ground.
    """
    return Approach(
        place=vehicle.home,
        heading_rad=vehicle.wing.landing_heading_rad(),
        height_m=_APPROACH_HEIGHT_M + _APPROACH_LAYER_M * index,
        circle_radius_m=max(_APPROACH_CIRCLE_M, turn_radius_m),
    )


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
            centre_m=(north - side * radius_m * math.sin(course), east + side * radius_m * math.cos(course)),
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
