"""Common parts of both ways to fly a pattern with a fixed wing: its path, and the approach at its end.

Entry into a pattern and exit from it: straight flight before and after it, entered from a circle.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from missions.base.options import FlightOptions
from missions.planning.flyable import FlyablePath
from missions.planning.way_in import runway_approach
from missions.vehicle.limits import FixedWingLimits
from missions.vehicle.notes import CommandedPath
from missions.vehicle.vehicle import Vehicle
from missions.vehicle.wing import Approach

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


_LEAD_IN_S: Final = 8.0  # straight flight before the pattern, in which the remaining errors of a turn settle
_LEAD_OUT_S: Final = 4.0


def with_leads(path: FlyablePath, ground_speed_m_s: float) -> FlyablePath:
    """A pattern's path with entry and exit, for the highest ground speed."""
    return path.with_leads(_LEAD_IN_S * ground_speed_m_s, _LEAD_OUT_S * ground_speed_m_s)
