"""Flight of an uploaded plan (MAVLink mission protocol), through its waypoints without unnecessary stops."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight import plan_reading as plans
from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase
from autopilot_bridge.flight.heading import Turn
from autopilot_bridge.flight.multicopter.corners import passing_speed, turn_in_distance
from autopilot_bridge.flight.multicopter.hold import HoldTask
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.multicopter.orbit import OrbitTask
from autopilot_bridge.flight.multicopter.precision_land import landing_task
from autopilot_bridge.flight.multicopter.return_home import ReturnTask
from autopilot_bridge.flight.multicopter.spline import SplineCurve, SplineFlight
from autopilot_bridge.flight.multicopter.takeoff import TakeoffRamp, TakeoffTask
from autopilot_bridge.flight.multicopter.trajectory import SPEED
from autopilot_bridge.flight.multicopter.yaw import Nose
from autopilot_bridge.flight.parameters import YawBehaviour
from autopilot_bridge.flight.plan_task import PlanTask
from autopilot_bridge.flight.region_of_interest import heading_to
from autopilot_bridge.flight.surroundings_parameters import Precision
from autopilot_bridge.flight.task import FlightTask, SpeedKind, SpeedTask, TaskStatus
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav_layout
from flightsim.foundation.vectors import Vector, wrap_pi

_LOOK_AHEAD_ITEMS: Final = 40
_LOOK_AHEAD_M: Final = 150.0
_YAW_REACHED_RAD: Final = math.radians(5.0)
_SAME_PLACE_M: Final = 0.1
_SLOW_M_S: Final = 0.3  # a curve that ends at less than twice this speed ends in a stop
_WIDE_M: Final = 1e3  # no corner at the end of a curve: the next leg continues straight


@dataclass(slots=True)
class _Leg:
    """The leg being flown to a waypoint; along a curve if there is one."""

    start: Array
    target: Array
    radius_m: float
    yaw_rad: float
    passing_m_s: float  # 0: stop there
    turn_in_m: float
    hold_s: float
    spline: SplineFlight | None = None
    waited_s: float = 0.0
    arrived: bool = False


class MissionTask(PlanTask):
    """A plan flown by a multicopter (`PlanTask`), without unnecessary stops.

    Waypoints without a hold time are passed at the speed that their corner, the acceptance radius and the
    next legs allow. NAV_RETURN_TO_LAUNCH is flown here and also reported as `MissionModeRequested`. The nose
    follows a region of interest.

    Args:
        store: the plan; its `current` is updated.
        first_item: 1 where item 0 is home (ArduPilot).
        rules: how the firmware flies a plan.
    """

    def __init__(
        self, store: MissionStore, *, first_item: int = 0, rules: plans.PlanRules = plans.PX4_PLANS
    ) -> None:
        super().__init__(store, first_item=first_item, rules=rules)
        self._leg: _Leg | None = None
        self._motion: SmoothMotion | None = None
        self._ramp: TakeoffRamp | None = None
        self._nose = Nose()
        self._speed_m_s: float | None = None
        self._turning: Turn | None = None

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
        return ReturnTask(self._store, first_item=self._first_item, rules=self._rules, plan_task=MissionTask)

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Fly at this speed until an item or a command changes it, the present leg included."""
        horizontal = kind in (SpeedKind.AIRSPEED, SpeedKind.GROUND_SPEED)
        if horizontal:
            self._speed_m_s = speed_m_s
        motion, leg = self._motion, self._leg
        if motion is not None:
            motion.change_speed(ctx, kind, speed_m_s)
        if isinstance(self._sub, SpeedTask):
            self._sub.change_speed(ctx, kind, speed_m_s)
        elif leg is not None and horizontal and leg.passing_m_s > 0.0 and leg.spline is None:
            leg.passing_m_s, leg.turn_in_m = self._corner(ctx, self._seq, leg.start, leg.target, leg.radius_m)

    def _begin_flown(self, ctx: FlightContext, item: MissionItem, came_from: Array | None) -> bool:
        """Begin an item that is flown; False when there is nothing to fly."""
        command = item.command
        target = plans.target_of(item, ctx)
        if target is None:
            return False
        self._turning = None  # CONDITION_YAW lasts until the next position
        if command in (plans.Command.NAV_TAKEOFF, plans.Command.NAV_VTOL_TAKEOFF):
            base = float(ctx.home_ned_m[2])
            base = float(ctx.nav[nav_layout.POS_NED_M][2]) if math.isnan(base) else base
            self._set_sub(ctx, TakeoffTask(base - float(target[2])))
            return True
        if command in (plans.Command.NAV_LAND, plans.Command.NAV_VTOL_LAND):
            precision = int(item.param2) if item.param2 in tuple(Precision) else Precision.NONE
            yaw_rad = self._item_yaw(ctx, item)
            self._set_sub(ctx, landing_task(ctx, target, yaw_rad, precision=Precision(precision)))
            return True
        if command == plans.Command.NAV_LOITER_TURNS:
            turns = item.param1 if math.isfinite(item.param1) and item.param1 > 0.0 else 1.0
            radius = item.param3 if math.isfinite(item.param3) else 0.0
            speed = self._speed_m_s or ctx.multicopter.orbit_speed_m_s
            task = OrbitTask(target, abs(radius) or None, math.copysign(speed, radius), turns=turns)
            self._set_sub(ctx, task)
            return True
        return self._begin_leg(ctx, item, target, came_from)

    def _turn(self, ctx: FlightContext, item: MissionItem) -> None:
        self._turning = Turn(
            math.radians(item.param1) if math.isfinite(item.param1) else 0.0,
            direction=int(item.param3 > 0.0) - int(item.param3 < 0.0),
            rate_max_rad_s=math.radians(item.param2) if item.param2 > 0.0 else None,
            relative=item.param4 == 1.0,
        )
        if self._leg is not None:
            self._leg.yaw_rad = math.nan

    def _turned(self, ctx: FlightContext) -> bool:
        if self._turning is None:
            return True
        behind = wrap_pi(float(ctx.setpoint[sp.YAW_RAD]) - float(ctx.nav[nav_layout.YAW]))
        return self._turning.done and abs(behind) < _YAW_REACHED_RAD

    def _item_yaw(self, ctx: FlightContext, item: MissionItem) -> float | None:
        if not ctx.multicopter.use_waypoint_yaw or not math.isfinite(item.param4):
            return None
        return math.radians(item.param4)

    def _radius(self, ctx: FlightContext, item: MissionItem) -> float:
        """Acceptance radius of a waypoint."""
        own = item.param2 if math.isfinite(item.param2) and self._rules.item_radius else 0.0
        return own if own > 0.0 and plans.is_waypoint(item) else ctx.multicopter.acceptance_radius_m

    def _cruise(self, ctx: FlightContext) -> float:
        return min(self._speed_m_s or ctx.multicopter.cruise_speed_m_s, ctx.multicopter.max_speed_m_s)

    def _begin_leg(
        self, ctx: FlightContext, item: MissionItem, target: Array, came_from: Array | None
    ) -> bool:
        """Begin a waypoint, or a loiter at a position."""
        motion = self._motion
        if motion is None:
            return False
        radius = self._radius(ctx, item)
        hold_s = 0.0
        if plans.is_waypoint(item) or item.command == plans.Command.NAV_LOITER_TIME:
            hold_s = item.param1 if math.isfinite(item.param1) else 0.0
        elif item.command == plans.Command.NAV_LOITER_UNLIM:
            hold_s = math.inf
        yaw = self._item_yaw(ctx, item)
        if self._sub is not None or came_from is None:
            motion.restart(ctx)
        motion.trajectory.limits[SPEED] = self._cruise(ctx)
        start = motion.trajectory.position_ned_m if came_from is None else came_from
        leg = _Leg(start.copy(), target, radius, math.nan if yaw is None else yaw, 0.0, 0.0, hold_s)
        if item.command == plans.Command.NAV_SPLINE_WAYPOINT:
            velocity = motion.trajectory.velocity_ned_m_s
            curve = self._curve(ctx, self._seq, motion.trajectory.position_ned_m, velocity)
            leg.spline = SplineFlight(curve, float(np.linalg.norm(velocity)), ctx.multicopter)
        else:
            if came_from is None:
                motion.begin_leg()
            else:
                motion.turn_into_leg(came_from)
            leg.passing_m_s, leg.turn_in_m = self._corner(ctx, self._seq, start, target, radius)
        self._leg = leg
        return True

    def _curve(
        self, ctx: FlightContext, seq: int, start: Array, velocity: Array, *, ends: bool = False
    ) -> SplineCurve:
        """The curve of a spline waypoint: from the velocity at its start, towards the item after it.

        Args:
            ends: as if the plan ended there (the look-ahead stops there).
        """
        items = self._store.items
        target = plans.target_of(items[seq], ctx)
        assert target is not None  # checked by the caller
        speed = self._cruise(ctx)
        distance = float(np.linalg.norm(target - start))
        moving = float(np.linalg.norm(velocity))
        first = velocity * (distance / moving) if moving > 0.1 else np.zeros(3)
        last, end_speed = np.zeros(3), 0.0
        after = None if ends else self._next_place(ctx, seq)
        if after is not None and plans.is_passed_through(items[seq]):
            following, place = after
            if items[following].command == plans.Command.NAV_SPLINE_WAYPOINT:
                last = place - start
                heading = last * (speed / max(float(np.linalg.norm(last)), 0.1))
                end_speed = self._curve(ctx, following, target, heading, ends=True).entry_speed_m_s
            else:
                last = place - target
                length = float(np.linalg.norm(last))
                end_speed = speed if length > _SAME_PLACE_M else 0.0
                if end_speed > 0.0:
                    before = target - last / length
                    end_speed = self._corner(ctx, seq, before, target, _WIDE_M)[0]
                last *= distance / max(length, 0.1)
        return SplineCurve(
            start, target, first, last, parameters=ctx.multicopter, speed_m_s=speed, end_speed_m_s=end_speed
        )

    def _next_place(self, ctx: FlightContext, seq: int) -> tuple[int, Array] | None:
        """The waypoint flown after an item, if it follows without a jump or a wait."""
        for later in range(seq + 1, len(self._store.items)):
            item = self._store.items[later]
            if plans.is_navigation(item):
                place = plans.target_of(item, ctx) if plans.is_waypoint(item) else None
                return None if place is None else (later, place)
            if item.command in plans.JUMPS:
                return None
        return None

    def _corner(
        self, ctx: FlightContext, seq: int, start: Array, target: Array, radius: float
    ) -> tuple[float, float]:
        """(speed at which the waypoint may be passed, distance before it at which the turn begins)."""
        if not plans.is_passed_through(self._store.items[seq]):
            return 0.0, 0.0
        path: list[Vector] = [_point(start), _point(target)]
        radii = [radius, radius]
        length_m = 0.0
        for number, later in enumerate(self._store.items[seq + 1 : seq + 1 + _LOOK_AHEAD_ITEMS], seq + 1):
            if not plans.is_navigation(later):
                if later.command in plans.JUMPS:
                    break
                continue
            if later.command == plans.Command.NAV_SPLINE_WAYPOINT and len(path) == 2:
                return self._into_spline(ctx, number, start, target)
            place = plans.target_of(later, ctx) if plans.is_waypoint(later) else None
            if place is None:
                break
            path.append(_point(place))
            radii.append(self._radius(ctx, later))
            length_m += math.dist(path[-2], path[-1])
            curved = later.command == plans.Command.NAV_SPLINE_WAYPOINT
            if curved or not plans.is_passed_through(later) or length_m > _LOOK_AHEAD_M:
                break
        speed = min(passing_speed(path, radii, ctx.multicopter), ctx.multicopter.max_speed_m_s)
        if speed <= 0.0:
            return 0.0, 0.0
        speed = min(speed, self._cruise(ctx))
        return speed, turn_in_distance(path, radii, speed, ctx.multicopter)

    def _into_spline(self, ctx: FlightContext, seq: int, start: Array, target: Array) -> tuple[float, float]:
        """Speed at the end of a straight leg before a curve; no turn begins before it."""
        leg = target - start
        length = float(np.linalg.norm(leg))
        if plans.target_of(self._store.items[seq], ctx) is None or length < _SAME_PLACE_M:
            return 0.0, 0.0
        curve = self._curve(ctx, seq, target, leg * (self._cruise(ctx) / length), ends=True)
        return min(self._cruise(ctx), curve.entry_speed_m_s), 0.0

    def update(self, ctx: FlightContext) -> TaskStatus:
        motion, ramp = self._motion, self._ramp
        if motion is None or ramp is None:
            self.activate(ctx)
            return self.update(ctx)
        self._follow_store(ctx)
        sub, leg = self._sub, self._leg
        if sub is not None:
            self._fly_sub(ctx, sub)
            if isinstance(sub, HoldTask | OrbitTask):
                self._nose.point(ctx, self._wanted_yaw(ctx, math.nan), self._turning)
        elif leg is not None:
            self._fly_leg(ctx, motion, ramp, leg)
        return TaskStatus.DONE if self._finished else TaskStatus.RUNNING

    def _wanted_yaw(self, ctx: FlightContext, otherwise: float) -> float:
        """Heading of the region of interest, if the nose follows it."""
        roi = ctx.roi
        if roi is None or not ctx.multicopter.nose_follows_roi:
            return otherwise
        yaw = heading_to(ctx, self._roi_place(ctx), roi.yaw_offset_rad)
        return otherwise if math.isnan(yaw) else yaw

    def _fly_leg(self, ctx: FlightContext, motion: SmoothMotion, ramp: TakeoffRamp, leg: _Leg) -> None:
        if not ramp.update(ctx, True, ctx.multicopter.takeoff_speed_m_s):
            motion.restart(ctx)
            return
        motion.synchronise(ctx)
        if leg.spline is not None:
            self._fly_spline(ctx, motion, leg, leg.spline)
            return
        motion.fly_to(ctx, leg.target, 0.0 if leg.arrived else leg.passing_m_s, leg.turn_in_m)
        motion.steer(ctx, self._wanted_yaw(ctx, leg.yaw_rad), leg.target, turn=self._turning)
        motion.write(ctx)
        item = self._store.items[self._seq]
        north, east, down = ctx.nav[nav_layout.POS_NED_M].tolist()
        target_n, target_e, target_d = leg.target.tolist()
        away = math.hypot(north - target_n, east - target_e)
        level = abs(down - target_d) < ctx.multicopter.acceptance_altitude_m
        inside = ctx.position_valid and away <= leg.radius_m and level
        if leg.passing_m_s > 0.0 and not leg.arrived:
            ahead = motion.ahead_m(leg.target)
            if inside and ahead <= leg.turn_in_m + float(motion.trajectory.limits[SPEED]) * ctx.dt_s:
                self._complete(ctx, item, leg.target)
            elif ahead < -leg.radius_m:
                leg.passing_m_s = 0.0  # missed: return to it
                motion.begin_leg()
            return
        if (
            not leg.arrived
            and inside
            and (motion.stopped or _flat_distance(motion.trajectory.position_ned_m, leg.target) < 0.3)
        ):
            leg.arrived = True
        if leg.arrived:
            leg.waited_s += ctx.dt_s
            if leg.waited_s >= leg.hold_s:
                self._complete(ctx, item, leg.target)

    def _fly_spline(self, ctx: FlightContext, motion: SmoothMotion, leg: _Leg, spline: SplineFlight) -> None:
        """One tick along the curve; its end is a normal waypoint."""
        trajectory = motion.trajectory
        if not ctx.position_valid:
            motion.brake(ctx)
            motion.steer(ctx, leg.yaw_rad, turn=self._turning)
            motion.write(ctx)
            return
        if spline.done:  # from here on its end is a position to hold, or to pass
            leg.spline = None
            motion.begin_leg()
            if spline.speed_m_s > 2.0 * _SLOW_M_S:
                self._complete(ctx, self._store.items[self._seq], leg.target)
            return
        trajectory.wait_for(ctx.nav[nav_layout.POS_NED_M], ctx.multicopter.trajectory_error_max_m)
        position, velocity, acceleration = spline.advance(ctx.dt_s * trajectory.stretch)
        trajectory.position_ned_m[:] = position
        trajectory.velocity_ned_m_s[:] = velocity
        trajectory.acceleration_ned_m_s2[:] = acceleration
        course = math.atan2(float(velocity[1]), float(velocity[0]))
        follows = ctx.multicopter.yaw_behaviour is not YawBehaviour.KEEP and self._turning is None
        along = course if follows else math.nan
        held = leg.yaw_rad if math.isfinite(leg.yaw_rad) else along
        motion.steer(ctx, self._wanted_yaw(ctx, held), leg.target, turn=self._turning)
        motion.write(ctx)


def _flat_distance(a: Array, b: Array) -> float:
    return math.hypot(float(a[0] - b[0]), float(a[1] - b[1]))


def _point(v: Array) -> Vector:
    return float(v[0]), float(v[1]), float(v[2])
