"""Flying an uploaded plan with a fixed wing: through waypoints, around circles, and down to the runway."""

import math
from typing import Final

import numpy as np

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight import plan_reading as plans
from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase
from autopilot_bridge.flight.fixed_wing.base import GuidedPath
from autopilot_bridge.flight.fixed_wing.circle_item import CircleItem
from autopilot_bridge.flight.fixed_wing.descend import PositionLost
from autopilot_bridge.flight.fixed_wing.landing import LandTask
from autopilot_bridge.flight.fixed_wing.leg import Leg
from autopilot_bridge.flight.fixed_wing.line import Line
from autopilot_bridge.flight.fixed_wing.loiter import LoiterTask
from autopilot_bridge.flight.fixed_wing.return_home import ReturnTask
from autopilot_bridge.flight.fixed_wing.state import AircraftState, FlightCommand
from autopilot_bridge.flight.fixed_wing.takeoff import TakeoffTask
from autopilot_bridge.flight.heading import turn_angle
from autopilot_bridge.flight.plan_task import PlanTask
from autopilot_bridge.flight.task import FlightTask, SpeedKind, SpeedTask, TaskStatus, clear_setpoint
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from flightsim.foundation.vectors import Vector

_CIRCLES: Final = frozenset(
    {
        plans.Command.NAV_LOITER_UNLIM,
        plans.Command.NAV_LOITER_TURNS,
        plans.Command.NAV_LOITER_TIME,
        plans.Command.NAV_LOITER_TO_ALT,
    }
)
_TAKEOFFS: Final = frozenset({plans.Command.NAV_TAKEOFF, plans.Command.NAV_VTOL_TAKEOFF})
_LANDINGS: Final = frozenset({plans.Command.NAV_LAND, plans.Command.NAV_VTOL_LAND})
_MISSED_RADII: Final = 2.0  # a waypoint passed within so many acceptance radii is taken as reached


class MissionTask(PlanTask):
    """A plan flown by a fixed wing (`PlanTask`).

    Waypoints are flown through, the turn to the next leg beginning before them; a height that isn't reached
    there is circled to. A landing takes the leg before it as glide slope.

    Args:
        store: the plan; its `current` is kept up to date.
        first_item: 1 where item 0 is home (ArduPilot).
        rules: how the firmware goes through a plan.
    """

    def __init__(
        self, store: MissionStore, first_item: int = 0, rules: plans.PlanRules = plans.PX4_PLANS
    ) -> None:
        super().__init__(store, first_item=first_item, rules=rules)
        self._state = AircraftState()
        self._command = FlightCommand()
        self._path = GuidedPath()
        self._lost = PositionLost()
        self._leg: Leg | None = None
        self._circle: CircleItem | None = None
        self._track: Line | None = None
        self._track_down_m = 0.0
        self._airspeed_m_s = math.nan
        self._throttle = math.nan
        self._hold_s = 0.0

    @property
    def sub_task(self) -> FlightTask | None:
        """The task that flies the current item, where it isn't a leg."""
        return self._sub

    @property
    def landing(self) -> bool:
        """The current item is a landing."""
        return isinstance(self._sub, LandTask)

    def activate(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.CRUISE
        self._state.read(ctx)
        self._lost.reset()
        self._restart(ctx)

    def _forget_leg(self) -> None:
        self._leg = None
        self._circle = None
        self._track = None
        self._hold_s = 0.0

    def _hold_task(self) -> FlightTask:
        return LoiterTask(airspeed_m_s=self._airspeed_m_s)

    def _return_task(self) -> FlightTask:
        return ReturnTask(self._store, first_item=self._first_item, rules=self._rules, plan_task=MissionTask)

    def _finish(self, ctx: FlightContext) -> None:
        sub, leg = self._sub, self._leg
        super()._finish(ctx)
        ctx.phase = FlightPhase.CRUISE
        if isinstance(sub, LoiterTask):
            self._sub = sub  # goes on circling there
        elif leg is not None:
            self._set_sub(ctx, LoiterTask(np.array(leg.target), airspeed_m_s=self._airspeed_m_s))

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        if kind not in (SpeedKind.AIRSPEED, SpeedKind.GROUND_SPEED):
            return
        self._airspeed_m_s = math.nan if speed_m_s is None else speed_m_s
        if isinstance(self._sub, SpeedTask):
            self._sub.change_speed(ctx, kind, speed_m_s)

    def _change_by_item(self, ctx: FlightContext, item: MissionItem) -> None:
        super()._change_by_item(ctx, item)
        if math.isfinite(item.param3) and item.param3 > 0.0:
            self._throttle = min(1.0, 0.01 * item.param3)

    def go_around(self, ctx: FlightContext, height_m: float = math.nan) -> bool:
        """Break the landing off and come back to it (MAV_CMD_DO_GO_AROUND); False when none is flown."""
        return isinstance(self._sub, LandTask) and self._sub.go_around(ctx, height_m)

    def _begin_flown(self, ctx: FlightContext, item: MissionItem, came_from: Array | None) -> bool:
        command, p = item.command, ctx.fixed_wing
        target = plans.target_of(item, ctx)
        if target is None:
            return False
        if command in _TAKEOFFS:
            base = float(ctx.home_ned_m[2])
            base = self._state.down_m if math.isnan(base) else base
            placeless = p.takeoff_straight or not _has_place(item)
            self._set_sub(ctx, TakeoffTask(base - float(target[2]), None if placeless else target))
        elif command in _LANDINGS:
            start = came_from if came_from is not None else self._place_before(ctx)
            self._set_sub(ctx, LandTask(target, start))
        elif command in _CIRCLES:
            self._circle = CircleItem(item, target, self._airspeed_m_s, p)
            self._set_sub(ctx, self._circle.task)
        elif command == plans.Command.NAV_CONTINUE_AND_CHANGE_ALT:
            self._track = Line()
            self._track.begin(self._state, self._state.course_rad)
            self._track_down_m = float(target[2])
        else:
            self._begin_leg(ctx, item, target, came_from)
            hold_s = item.param1 if math.isfinite(item.param1) and self._rules.holds else 0.0
            self._hold_s = max(0.0, hold_s)
        return True

    def _place_before(self, ctx: FlightContext) -> Array | None:
        """Place of the last waypoint or circle before the current item."""
        for item in reversed(self._store.items[self._first_item : self._seq]):
            if plans.is_waypoint(item) or item.command in _CIRCLES:
                return plans.target_of(item, ctx)
        return None

    def _place_after(self, ctx: FlightContext) -> Array | None:
        """Place of the next item that has one; None when there is none, or a jump before it."""
        for item in self._store.items[self._seq + 1 :]:
            if plans.is_navigation(item):
                has = plans.is_waypoint(item) or item.command in _CIRCLES or item.command in _LANDINGS
                return plans.target_of(item, ctx) if has else None
            if item.command in plans.JUMPS:
                return None
        return None

    def _begin_leg(
        self, ctx: FlightContext, item: MissionItem, target: Array, came_from: Array | None
    ) -> None:
        state, p = self._state, ctx.fixed_wing
        own = item.param2 if math.isfinite(item.param2) else 0.0
        start = (state.north_m, state.east_m, state.down_m) if came_from is None else _place(came_from)
        place = _place(target)
        after = self._place_after(ctx)
        # an item's own radius holds whatever the turn behind it, as ArduPlane has it
        turn = math.nan if after is None or own > 0.0 else turn_angle(start, place, _place(after))
        beyond_m = item.param3 if self._rules.passes_by and item.param3 > 0.0 else 0.0
        if beyond_m > 0.0:
            place = _beyond(start, place, beyond_m)
        self._leg = Leg(
            start,
            place,
            ramps=came_from is not None,
            radius_m=own if own > 0.0 else p.acceptance_radius_m,
            turn_rad=turn,
            to_the_end=beyond_m > 0.0,
        )
        if came_from is not None:
            self._leg.turn_from(state.course_rad)

    def update(self, ctx: FlightContext) -> TaskStatus:
        if self._version < 0:
            self.activate(ctx)
        self._state.read(ctx)
        self._follow_store(ctx)
        if self._sub is not None:
            self._fly_sub(ctx, self._sub)
        elif not ctx.armed or ctx.on_ground:
            # only a take-off leaves the ground
            clear_setpoint(ctx.setpoint, sp.IDLE if ctx.armed else sp.OFF)
        else:
            self._fly_here(ctx)
        return TaskStatus.DONE if self._finished else TaskStatus.RUNNING

    def _sub_done(self, ctx: FlightContext, item: MissionItem, status: TaskStatus) -> bool:
        circle = self._circle
        if circle is None:
            return super()._sub_done(ctx, item, status)
        return circle.done(ctx, self._state, self._place_after(ctx))

    def _came_from(self, ctx: FlightContext) -> Array | None:
        """A circle is left where the aircraft is, on its height; one flown for a height is its waypoint."""
        circle, state, leg = self._circle, self._state, self._leg
        if circle is None:
            return None
        if leg is not None:
            return np.array(leg.target)
        return np.array([state.north_m, state.east_m, float(circle.task.centre_ned_m[2])])

    def _fly_here(self, ctx: FlightContext) -> None:
        """A leg, or straight on to another height."""
        command, state, leg, track = self._command, self._state, self._leg, self._track
        command.clear()
        command.airspeed_m_s = self._airspeed_m_s
        if state.airspeed_m_s != state.airspeed_m_s:
            command.throttle = self._throttle  # flown only where there is no airspeed to fly by
        if not ctx.position_valid:
            command.down_m = leg.target[2] if leg is not None else self._track_down_m
            self._lost.fly(ctx, command, ctx.fixed_wing.loiter_radius_m)
            command.write(ctx)
            return
        found = self._lost.found()
        if leg is not None:
            if found:
                leg.start_again(state)
            self._fly_leg(ctx, leg, command)
        elif track is not None:
            track.follow(state, self._path.of(ctx), command)
            command.down_m = self._track_down_m
            command.write(ctx)
            if abs(state.down_m - self._track_down_m) < min(10.0, ctx.fixed_wing.acceptance_altitude_m):
                self._complete(ctx, self._store.items[self._seq], None)

    def _fly_leg(self, ctx: FlightContext, leg: Leg, command: FlightCommand) -> None:
        state, p = self._state, ctx.fixed_wing
        guidance = self._path.of(ctx)
        leg.follow(state, guidance, command)
        command.write(ctx)
        near = leg.turn_in_m(guidance, p)
        away, passed = leg.away_m(state), leg.passed(state)
        if away > near and not passed and not leg.too_short:
            return
        item = self._store.items[self._seq]
        if passed and away > max(near, _MISSED_RADII * leg.radius_m) and not leg.too_short:
            leg.start_again(state)
        elif self._hold_s > 0.0:
            wait = MissionItem(command=plans.Command.NAV_LOITER_TIME, param1=self._hold_s)
            self._circle = CircleItem(wait, np.array(leg.target), self._airspeed_m_s, p)
            self._set_sub(ctx, self._circle.task)
        elif abs(state.down_m - leg.target[2]) < p.acceptance_altitude_m:
            self._complete(ctx, item, np.array(leg.target))
        else:
            self._circle = CircleItem.to_height(np.array(leg.target), self._airspeed_m_s, p)
            self._set_sub(ctx, self._circle.task)


def _place(v: Array) -> Vector:
    return float(v[0]), float(v[1]), float(v[2])


def _beyond(start: Vector, place: Vector, distance_m: float) -> Vector:
    """So far behind a place, on the line from `start`."""
    north, east = place[0] - start[0], place[1] - start[1]
    length = math.hypot(north, east)
    if length < 1.0:
        return place
    return place[0] + north / length * distance_m, place[1] + east / length * distance_m, place[2]


def _has_place(item: MissionItem) -> bool:
    return math.isfinite(item.x) and math.isfinite(item.y) and not (item.x == 0.0 and item.y == 0.0)
