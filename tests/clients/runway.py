"""Places around a runway and a circuit flown from it, for clients of any library."""

import math
from dataclasses import dataclass
from typing import Final

from pymavlink.dialects.v20 import all as mavlink

METRES_PER_DEG: Final = math.radians(6_371_000.0)
_SLOPE: Final = math.tan(math.radians(5.0))
_APPROACH_HEIGHT_M: Final = 35.0

Place = tuple[float, float]
"""North and east of home, metres."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanItem:
    """One item of a plan; a place is degrees and metres over home, and without one it is MAV_FRAME_MISSION.

    Attributes:
        command: MAV_CMD.
        place: latitude, longitude, height.
        parameters: the first of param1 to param4; what is left out is 0.
    """

    command: int
    place: tuple[float, float, float] | None = None
    parameters: tuple[float, ...] = ()

    @property
    def frame(self) -> int:
        if self.place is None:
            return int(mavlink.MAV_FRAME_MISSION)
        return int(mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)


@dataclass(frozen=True, slots=True, kw_only=True)
class Runway:
    """Where an aircraft stands, and the way it points.

    Attributes:
        lat_deg, lon_deg, alt_m: home, altitude over the sea.
        heading_rad: of the aircraft.
    """

    lat_deg: float
    lon_deg: float
    alt_m: float
    heading_rad: float

    def geodetic(self, place: Place, height_m: float) -> tuple[float, float, float]:
        """Latitude, longitude and height, in degrees and as it was given, of a place."""
        east_deg = place[1] / (METRES_PER_DEG * math.cos(math.radians(self.lat_deg)))
        return self.lat_deg + place[0] / METRES_PER_DEG, self.lon_deg + east_deg, height_m

    def place(self, lat_deg: float, lon_deg: float) -> Place:
        """North and east of home."""
        east_m = (lon_deg - self.lon_deg) * METRES_PER_DEG * math.cos(math.radians(self.lat_deg))
        return (lat_deg - self.lat_deg) * METRES_PER_DEG, east_m

    def along(self, along_m: float, right_m: float = 0.0) -> Place:
        """A place given along the runway that starts at home, and to its right."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return along_m * c - right_m * s, along_m * s + right_m * c

    def circuit(self, flavour: str, height_m: float = 50.0) -> list[PlanItem]:
        """Take-off, two corners, and a landing 50 m down the runway, as ground stations plan it for the
        flavour: from a circle down (PX4), by waypoints (ArduPlane).
        """

        def item(command: int, place: Place, height_m: float, *parameters: float) -> PlanItem:
            return PlanItem(command=command, place=self.geodetic(place, height_m), parameters=parameters)

        approach_m, at = _APPROACH_HEIGHT_M, self.along
        away_m = approach_m / _SLOPE
        items = [
            item(mavlink.MAV_CMD_NAV_TAKEOFF, at(350.0), 40.0, 10.0),
            item(mavlink.MAV_CMD_NAV_WAYPOINT, at(450.0, -250.0), height_m),
            item(mavlink.MAV_CMD_NAV_WAYPOINT, at(-150.0, -300.0), height_m),
            PlanItem(command=mavlink.MAV_CMD_DO_LAND_START),
        ]
        if flavour == "px4":
            centre = at(50.0 - away_m, -100.0)
            items.append(item(mavlink.MAV_CMD_NAV_LOITER_TO_ALT, centre, approach_m, 1.0, -100.0, 0.0, 1.0))
        else:
            items.insert(0, item(mavlink.MAV_CMD_NAV_WAYPOINT, (0.0, 0.0), 0.0))  # item 0 is home
            items.append(item(mavlink.MAV_CMD_NAV_WAYPOINT, at(-away_m - 250.0, -150.0), approach_m + 10.0))
            items.append(item(mavlink.MAV_CMD_NAV_WAYPOINT, at(50.0 - away_m), approach_m))
        items.append(item(mavlink.MAV_CMD_NAV_LAND, at(50.0), 0.0))
        return items
