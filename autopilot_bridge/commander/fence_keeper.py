"""The geofence in the commander: the position that it checks, its data for failsafes, its return point."""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from autopilot_bridge.commander.events import Event
from autopilot_bridge.commander.fence_watch import FenceWatch
from autopilot_bridge.commander.geofence_parameters import FenceParameters
from autopilot_bridge.commander.health import HealthMonitor
from autopilot_bridge.commander.situation import Situation
from autopilot_bridge.commander.vehicle_tasks import TargetPosition
from autopilot_bridge.flight.context import Array, FlightContext
from autopilot_bridge.flight.parameters import FlightParameters
from autopilot_bridge.flight.return_place import nearest_rally
from autopilot_bridge.navigation import layout as nav
from flightsim.foundation.vectors import Vector

_RADII_AHEAD: Final = 2.0  # in radii of an aircraft's loiter circle
_AIRCRAFT_DOWN_M: Final = 5.0
_MOVING_M_S: Final = 0.5


def place_ahead(context: FlightContext, place_ned_m: Vector) -> Vector:
    """The position that the vehicle can't avoid reaching: a multicopter brakes, an aircraft circles."""
    north, east, down = place_ned_m
    v_north, v_east, v_down = context.nav[nav.VEL_NED_M_S].tolist()
    speed = math.hypot(v_north, v_east)
    p = context.parameters
    if isinstance(p, FlightParameters):
        ahead_m = _braking_m(speed, p.acceleration_m_s2, p.jerk_m_s3)
        vertical = p.acceleration_up_m_s2 if v_down > 0.0 else p.acceleration_down_m_s2
        down += math.copysign(_braking_m(abs(v_down), vertical, p.jerk_m_s3), v_down)
    else:
        ahead_m = _RADII_AHEAD * abs(p.loiter_radius_m)
        if abs(v_down) > _MOVING_M_S:
            down += math.copysign(_AIRCRAFT_DOWN_M, v_down)
    if speed > _MOVING_M_S:
        north += ahead_m * v_north / speed
        east += ahead_m * v_east / speed
    return north, east, down


def _braking_m(speed_m_s: float, acceleration_m_s2: float, jerk_m_s3: float) -> float:
    """Stopping distance, with a deceleration that builds up at limited jerk."""
    return speed_m_s * (0.5 * speed_m_s / acceleration_m_s2 + acceleration_m_s2 / jerk_m_s3)


def fence_return_place(
    context: FlightContext, watch: FenceWatch, parameters: FenceParameters
) -> TargetPosition | None:
    """The target of ArduPlane's GUIDED action: the return point, a rally point or home; None: not known."""
    home = context.home_ned_m
    if not math.isfinite(float(home.sum())) or context.frame is None:
        return None
    p = context.fixed_wing
    if parameters.return_to_rally:
        rally = nearest_rally(context, p.rally)
        if rally is not None:
            return TargetPosition(ned_m=np.array([rally.ned_m[0], rally.ned_m[1], rally.altitude_down_m]))
        return TargetPosition(ned_m=np.array([home[0], home[1], home[2] - p.return_altitude_m]))
    low_m = parameters.height_min_m + parameters.margin_m
    high_m = parameters.height_max_m - parameters.margin_m
    height_m = parameters.return_height_m
    if height_m <= 0.0:
        height_m = p.return_altitude_m if low_m >= high_m else 0.5 * (low_m + high_m)
    point = watch.geofence.return_point(context.frame)
    north, east = (float(home[0]), float(home[1])) if point is None else point
    return TargetPosition(ned_m=np.array([north, east, float(home[2]) - height_m]))


class FenceKeeper:
    """Checks the geofence with the vehicle's position, and answers which positions are inside.

    Args:
        watch: the state of the geofence.
        context: the data that flight tasks see; they check through it whether a position is inside.
        health: provides the position of the GPS receiver.
        parameters: returns the present parameters.
    """

    def __init__(
        self,
        watch: FenceWatch,
        context: FlightContext,
        health: HealthMonitor,
        parameters: Callable[[], FenceParameters],
    ) -> None:
        self._watch = watch
        self._context = context
        self._health = health
        self._parameters = parameters
        context.within_fence = self.allows

    def update(self, situation: Situation) -> list[Event]:
        """Check the vehicle's position and write the fence's state into `situation`; returns the events."""
        watch, context, parameters = self._watch, self._context, self._parameters()
        position: tuple[float, float, float] | None = None
        if parameters.by_gps:
            position = self._health.gps_position_ned(context.frame)
        elif situation.position:
            north, east, down = context.nav[nav.POS_NED_M].tolist()
            position = (north, east, down)
        if parameters.predicts and position is not None and situation.airborne:
            position = place_ahead(context, position)
        home = tuple(context.home_ned_m.tolist()) if situation.home_set else None
        changes = watch.update(
            position,
            home,
            context.frame,
            parameters,
            time_us=situation.time_us,
            armed=situation.armed,
            airborne=situation.airborne,
            landing=situation.landing,
        )
        situation.outside_fence = bool(watch.broken)
        situation.fence_present = watch.present(parameters)
        situation.fence_breaches = watch.breaches
        situation.fence_away_m = watch.distance_m
        return changes

    def allows(self, place_ned_m: Array) -> bool:
        """True when a position is inside all enabled walls."""
        north, east, down = place_ned_m.tolist()
        return self._watch.allows((north, east, down), self._context.frame, self._parameters())

    def return_place(self) -> TargetPosition | None:
        """The target of a breach whose action is to fly to a point; None: not known."""
        return fence_return_place(self._context, self._watch, self._parameters())
