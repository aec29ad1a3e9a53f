"""Flying an uploaded plan (MAVLink mission protocol), through its waypoints without needless stops."""

import math
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase
from autopilot_bridge.flight.corners import Point, passing_speed, turn_in_distance
from autopilot_bridge.flight.ground import TakeoffRamp
from autopilot_bridge.flight.hold import HoldTask
from autopilot_bridge.flight.land import LandTask
from autopilot_bridge.flight.motion import SmoothMotion
from autopilot_bridge.flight.orbit import OrbitTask
from autopilot_bridge.flight.plan_reading import (
    Command,
    is_navigation,
    is_passed_through,
    is_waypoint,
    target_of,
)
from autopilot_bridge.flight.plan_task import PlanTask
from autopilot_bridge.flight.return_home import ReturnTask
from autopilot_bridge.flight.takeoff import TakeoffTask
from autopilot_bridge.flight.task import FlightTask, SpeedKind, SpeedTask, TaskStatus
from autopilot_bridge.flight.trajectory import SPEED
from autopilot_bridge.flight.yaw import wrap_pi
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav_layout

_LOOK_AHEAD_ITEMS: Final = 40
_LOOK_AHEAD_M: Final = 150.0
_YAW_REACHED_RAD: Final = math.radians(5.0)


@dataclass(slots=True)
class _Leg:
    """The leg being flown to a waypoint."""

    start: Array
    target: Array
    radius_m: float
    yaw_rad: float
    passing_m_s: float  # 0: stop there
    turn_in_m: float
    hold_s: float
    waited_s: float = 0.0
    arrived: bool = False


class MissionTask(PlanTask):
    """A plan flown by a multicopter (`PlanTask`), without needless stops.

    Waypoints without a hold time are passed at the speed their corner, the acceptance radius and the legs
    behind them allow. NAV_RETURN_TO_LAUNCH is flown here and also reported as `MissionModeRequested`.

    Args:
        store: the plan; its `current` is kept up to date.
        first_item: 1 where item 0 is home (ArduPilot).
    """

    __slots__ = ("_leg", "_motion", "_ramp", "_speed_m_s", "_yaw_rad")

    def __init__(self, store: MissionStore, *, first_item: int = 0) -> None:
        super().__init__(store, first_item=first_item)
        self._leg: _Leg | None = None
        self._motion: SmoothMotion | None = None
        self._ramp: TakeoffRamp | None = None
        self._speed_m_s: float | None = None
        self._yaw_rad = math.nan

    def activate(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.CRUISE
        self._motion = SmoothMotion(ctx, speed_m_s=self._speed_m_s)
        self._ramp = TakeoffRamp(ctx)
        self._restart(ctx)

    def _forget_leg(self) -> None:
        self._leg = None

    def _hold_task(self) -> FlightTask:
        return HoldTask()

    def _return_task(self) -> FlightTask:
        return ReturnTask()

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Fly on at this speed until an item or a command changes it, the present leg included."""
        horizontal = kind in (SpeedKind.AIRSPEED, SpeedKind.GROUND_SPEED)
        if horizontal:
            self._speed_m_s = speed_m_s
        motion, leg = self._motion, self._leg
        if motion is not None:
            motion.change_speed(ctx, kind, speed_m_s)
        if isinstance(self._sub, SpeedTask):
            self._sub.change_speed(ctx, kind, speed_m_s)
        elif leg is not None and horizontal and leg.passing_m_s > 0.0:
            item = self._store.items[self._seq]
            leg.passing_m_s, leg.turn_in_m = self._corner(ctx, item, leg.start, leg.target, leg.radius_m)

    def _begin_flown(self, ctx: FlightContext, item: MissionItem, came_from: Array | None) -> bool:
        """Begin an item that is flown; False when there is nothing to do."""
        command = item.command
        if command == Command.CONDITION_YAW:
            self._yaw_rad = self._condition_yaw(ctx, item)
            self._set_sub(ctx, HoldTask(yaw_rad=self._yaw_rad))
            return True
        target = target_of(item, ctx)
        if target is None:
            return False
        if command in (Command.NAV_TAKEOFF, Command.NAV_VTOL_TAKEOFF):
            base = float(ctx.home_ned_m[2])
            base = float(ctx.nav[nav_layout.POS_NED_M][2]) if math.isnan(base) else base
            self._set_sub(ctx, TakeoffTask(base - float(target[2])))
            return True
        if command in (Command.NAV_LAND, Command.NAV_VTOL_LAND):
            self._set_sub(ctx, LandTask(target, self._item_yaw(ctx, item)))
            return True
        if command == Command.NAV_LOITER_TURNS:
            turns = item.param1 if math.isfinite(item.param1) and item.param1 > 0.0 else 1.0
            radius = item.param3 if math.isfinite(item.param3) else 0.0
            speed = self._speed_m_s or ctx.multicopter.orbit_speed_m_s
            task = OrbitTask(target, abs(radius) or None, math.copysign(speed, radius), turns=turns)
            self._set_sub(ctx, task)
            return True
        return self._begin_leg(ctx, item, target, came_from)

    def _condition_yaw(self, ctx: FlightContext, item: MissionItem) -> float:
        angle = math.radians(item.param1) if math.isfinite(item.param1) else 0.0
        if item.param4 == 1.0:
            direction = -1.0 if item.param3 < 0.0 else 1.0
            return wrap_pi(float(ctx.nav[27]) + direction * angle)
        return wrap_pi(angle)

    def _item_yaw(self, ctx: FlightContext, item: MissionItem) -> float | None:
        if not ctx.multicopter.use_waypoint_yaw or not math.isfinite(item.param4):
            return None
        return math.radians(item.param4)

    def _begin_leg(
        self, ctx: FlightContext, item: MissionItem, target: Array, came_from: Array | None
    ) -> bool:
        """A waypoint, or a loiter at a place."""
        motion = self._motion
        if motion is None:
            return False
        waypoint = is_waypoint(item)
        radius = ctx.multicopter.acceptance_radius_m
        if waypoint and math.isfinite(item.param2) and item.param2 > 0.0:
            radius = item.param2
        hold_s = 0.0
        if waypoint or item.command == Command.NAV_LOITER_TIME:
            hold_s = item.param1 if math.isfinite(item.param1) else 0.0
        elif item.command == Command.NAV_LOITER_UNLIM:
            hold_s = math.inf
        yaw = self._item_yaw(ctx, item)
        if yaw is not None:
            self._yaw_rad = math.nan
        if self._sub is not None or came_from is None:
            motion.restart(ctx)
        motion.trajectory.limits[SPEED] = min(
            self._speed_m_s or ctx.multicopter.cruise_speed_m_s, ctx.multicopter.max_speed_m_s
        )
        if came_from is None:
            motion.begin_leg()
        else:
            motion.turn_into_leg(came_from)
        start = motion.trajectory.position_ned_m if came_from is None else came_from
        speed, turn_in = self._corner(ctx, item, start, target, radius)
        self._leg = _Leg(
            start.copy(), target, radius, self._yaw_rad if yaw is None else yaw, speed, turn_in, hold_s
        )
        return True

    def _corner(
        self, ctx: FlightContext, item: MissionItem, start: Array, target: Array, radius: float
    ) -> tuple[float, float]:
        """(speed at which the waypoint may be passed, distance before it at which the turn begins)."""
        if not is_passed_through(item):
            return 0.0, 0.0
        path: list[Point] = [_point(start), _point(target)]
        radii = [radius, radius]
        length_m = 0.0
        for later in self._store.items[self._seq + 1 : self._seq + 1 + _LOOK_AHEAD_ITEMS]:
            if not is_navigation(later):
                if later.command in (Command.DO_JUMP, Command.CONDITION_DELAY, Command.CONDITION_YAW):
                    break
                continue
            place = target_of(later, ctx) if is_waypoint(later) else None
            if place is None:
                break
            path.append(_point(place))
            own = later.param2 if math.isfinite(later.param2) else 0.0
            radii.append(own if own > 0.0 else ctx.multicopter.acceptance_radius_m)
            length_m += math.dist(path[-2], path[-1])
            if not is_passed_through(later) or length_m > _LOOK_AHEAD_M:
                break
        speed = min(passing_speed(path, radii, ctx.multicopter), ctx.multicopter.max_speed_m_s)
        if speed <= 0.0:
            return 0.0, 0.0
        speed = min(speed, self._speed_m_s or ctx.multicopter.cruise_speed_m_s)
        return speed, turn_in_distance(path, radii, speed, ctx.multicopter)

    def update(self, ctx: FlightContext) -> TaskStatus:
        motion, ramp = self._motion, self._ramp
        if motion is None or ramp is None:
            self.activate(ctx)
            return self.update(ctx)
        self._follow_store(ctx)
        if self._sub is not None:
            self._fly_sub(ctx, self._sub)
        elif self._leg is not None:
            self._fly_leg(ctx, motion, ramp, self._leg)
        return TaskStatus.DONE if self._finished else TaskStatus.RUNNING

    def _sub_done(self, ctx: FlightContext, item: MissionItem, status: TaskStatus) -> bool:
        if item.command == Command.CONDITION_YAW:
            return abs(wrap_pi(float(ctx.nav[27]) - self._yaw_rad)) < _YAW_REACHED_RAD
        return super()._sub_done(ctx, item, status)

    def _fly_leg(self, ctx: FlightContext, motion: SmoothMotion, ramp: TakeoffRamp, leg: _Leg) -> None:
        if not ramp.update(ctx, True, ctx.multicopter.takeoff_speed_m_s):
            motion.restart(ctx)
            return
        motion.synchronise(ctx)
        motion.fly_to(ctx, leg.target, 0.0 if leg.arrived else leg.passing_m_s, leg.turn_in_m)
        motion.steer(ctx, leg.yaw_rad, leg.target)
        motion.write(ctx)
        item = self._store.items[self._seq]
        vehicle = ctx.nav[nav_layout.POS_NED_M]
        point = motion.trajectory.position_ned_m
        away = _flat_distance(vehicle, leg.target)
        level = abs(float(vehicle[2] - leg.target[2])) < ctx.multicopter.acceptance_altitude_m
        inside = ctx.position_valid and away <= leg.radius_m and level
        if leg.passing_m_s > 0.0 and not leg.arrived:
            ahead = motion.ahead_m(leg.target)
            if inside and ahead <= leg.turn_in_m + float(motion.trajectory.limits[SPEED]) * ctx.dt_s:
                self._complete(ctx, item, leg.target)
            elif ahead < -leg.radius_m:
                leg.passing_m_s = 0.0  # missed: come back to it
                motion.begin_leg()
            return
        if not leg.arrived and inside and (motion.stopped or _flat_distance(point, leg.target) < 0.3):
            leg.arrived = True
        if leg.arrived:
            leg.waited_s += ctx.dt_s
            if leg.waited_s >= leg.hold_s:
                self._complete(ctx, item, leg.target)


def _flat_distance(a: Array, b: Array) -> float:
    return math.hypot(float(a[0] - b[0]), float(a[1] - b[1]))


def _point(v: Array) -> Point:
    return float(v[0]), float(v[1]), float(v[2])
