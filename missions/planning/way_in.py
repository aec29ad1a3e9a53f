"""The way into a path for a fixed wing, and from it to the runway of the takeoff."""

import math
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import LocalFrame
from missions.planning.flyable import FlyablePath
from missions.vehicle import telemetry
from missions.vehicle.vehicle import Vehicle
from missions.vehicle.wing import Approach

_APPROACH_HEIGHT_M: Final = 40.0
_APPROACH_LAYER_M: Final = 15.0
_APPROACH_CIRCLE_M: Final = 80.0


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


def way_in_items(
    vehicle: Vehicle, entry: Entry, *, airspeed_m_s: float, takeoff_m: float, height_m: float
) -> list[MissionItem]:
    """Takeoff, airspeed, and a circle that is left along a path's beginning.

    Args:
        vehicle: the aircraft.
        entry: the circle, from its home.
        airspeed_m_s: from the takeoff on.
        takeoff_m: height above home at the end of the takeoff.
        height_m: height above home of the circle.
    """
    lat, lon, _ = LocalFrame(vehicle.home).geodetic_from_ned(*entry.centre_m, 0.0)
    return [
        vehicle.firmware.takeoff_item(vehicle.home, takeoff_m),
        MissionItem(
            command=dialect.MAV_CMD_DO_CHANGE_SPEED,
            frame=dialect.MAV_FRAME_MISSION,
            param1=0.0,  # airspeed
            param2=airspeed_m_s,
            param3=-1.0,
        ),
        MissionItem(
            command=dialect.MAV_CMD_NAV_LOITER_TO_ALT,
            param1=1.0,  # leave the circle only in the direction of the next item
            param2=math.copysign(entry.radius_m, 1.0 if entry.clockwise else -1.0),
            param4=1.0,  # the leg begins where the circle is left
            x=lat,
            y=lon,
            z=height_m,
        ),
    ]


def waypoint_item(
    vehicle: Vehicle, radius_m: float, north_m: float, east_m: float, height_m: float
) -> MissionItem:
    """A waypoint at a place from home, with the distance before it at which the next leg may begin."""
    lat, lon, _ = LocalFrame(vehicle.home).geodetic_from_ned(north_m, east_m, 0.0)
    return MissionItem(
        command=dialect.MAV_CMD_NAV_WAYPOINT,
        param2=radius_m,
        param4=vehicle.firmware.unset,
        x=lat,
        y=lon,
        z=height_m,
    )
