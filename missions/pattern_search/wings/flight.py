"""Common parts of both ways to fly a pattern with a fixed wing: its path, and the approach at its end."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from missions.notes import CommandedPath
from missions.options import FlightOptions
from missions.planning.flyable import FlyablePath
from missions.planning.limits import FixedWingLimits
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
