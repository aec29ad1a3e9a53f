"""What both ways of flying a pattern with wings share: its path, and the approach at its end."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from missions.notes import CommandedPath
from missions.options import FlightOptions
from missions.planning.flyable import FlyablePath
from missions.planning.limits import FixedWingLimits
from missions.vehicle.fixed_wing import Approach
from missions.vehicle.vehicle import Vehicle

_APPROACH_HEIGHT_M: Final = 40.0
_APPROACH_LAYER_M: Final = 15.0
_APPROACH_CIRCLE_M: Final = 80.0
_SLOW: Final = 0.5  # of the airspeed: slowest over ground that is waited for


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternFlight:
    """One aircraft's pattern.

    Attributes:
        options: as this aircraft flies them.
        limits: of this aircraft.
        path: of the pattern, from home.
        route: the same with straight flight before and after it.
        turn_radius_m: tightest turn over ground.
    """

    options: FlightOptions
    limits: FixedWingLimits
    path: FlyablePath
    route: FlyablePath
    turn_radius_m: float

    @property
    def slow_m_s(self) -> float:
        """Slowest over ground that a deadline allows for."""
        return _SLOW * self.options.speed_m_s

    @property
    def away_s(self) -> float:
        """Time to fly from anywhere of the pattern to its start, or home, at most."""
        return (self.route.reach_m + 10.0 * self.turn_radius_m) / self.slow_m_s

    def commanded(
        self, vehicle: Vehicle, waypoints: list[tuple[float, float]], acceptance_m: float
    ) -> CommandedPath:
        """What the flight is scored against."""
        down_m = -self.options.own_altitude_m
        points = self.path.points_m
        return CommandedPath(
            origin=vehicle.home,
            points_ned_m=np.column_stack((points, np.full(len(points), down_m))),
            waypoints_ned_m=np.array([(n, e, down_m) for n, e in waypoints]).reshape(-1, 3),
            acceptance_m=acceptance_m,
        )

    def approach(self, vehicle: Vehicle) -> Approach:
        """Down to the runway it took off from; a team's circles lie in layers."""
        return Approach(
            place=vehicle.home,
            heading_rad=vehicle.landing_heading_rad(),
            height_m=_APPROACH_HEIGHT_M + _APPROACH_LAYER_M * self.options.index,
            circle_radius_m=max(_APPROACH_CIRCLE_M, self.turn_radius_m),
        )
