"""The common part of flying an uploaded plan: the order of its items, jumps, conditions, DO_ items."""

import math
from abc import ABC, abstractmethod
from collections import deque
from dataclasses import replace
from typing import Final

from autopilot_bridge.flight import plan_reading as plans
from autopilot_bridge.flight.context import (
    Array,
    FlightContext,
    FlightEvent,
    HomeChangeRequested,
    ItemCommanded,
    MissionFinished,
    MissionModeRequested,
    RoiMode,
    TaskFinished,
    WaypointReached,
    WaypointStarted,
)
from autopilot_bridge.flight.region_of_interest import ROI_COMMANDS, roi_of
from autopilot_bridge.flight.task import FlightTask, SpeedKind, TaskStatus
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav_layout

_MAX_INSTANT_ITEMS: Final = 200  # per update: breaks loops of DO_JUMP without anything to fly in between
_DEFAULT_SPEED: Final = -2.0
_WAITS: Final = frozenset(
    {plans.Command.NAV_LOITER_UNLIM, plans.Command.NAV_LOITER_TURNS, plans.Command.NAV_LOITER_TIME}
)


class PlanTask(ABC):
    """Executes the items of a store, from its current one; DONE (and holding) after the last.

    A new plan or another current item in the store takes effect at the next update. DO_ items act at once.
    With `PlanRules.conditions` they act during the flight to the next position, delayed by CONDITION_ items,
    and those that did not act before the arrival are dropped. Items for equipment are reported as
    `ItemCommanded`. An item that takes time is either a separate task (`_sub`) or a leg, which the vehicle's
    class flies.

    Args:
        store: the plan; its `current` is updated.
        first_item: 1 where item 0 is home (ArduPilot).
        rules: how the firmware flies a plan.
    """

    def __init__(
        self, store: MissionStore, *, first_item: int = 0, rules: plans.PlanRules = plans.PX4_PLANS
    ) -> None:
        self._store = store
        self._first_item = first_item
        self._rules = rules
        self._version = -1
        self._seq = -1
        self._sub: FlightTask | None = None
        self._jumps: dict[int, int] = {}
        self._wait_left_s = 0.0
        self._beside: deque[int] = deque()
        self._condition_left_s = math.nan
        self._finished = False

    @abstractmethod
    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Fly at this speed until an item or a command changes it, the present leg included."""

    @abstractmethod
    def _forget_leg(self) -> None:
        """Discard the present leg."""

    @abstractmethod
    def _hold_task(self) -> FlightTask:
        """The task that holds the present position."""

    @abstractmethod
    def _return_task(self) -> FlightTask:
        """The task that flies home."""

    @abstractmethod
    def _begin_flown(self, ctx: FlightContext, item: MissionItem, came_from: Array | None) -> bool:
        """Begin an item that is flown, as `_sub` or as a leg; False when there is nothing to fly.

        `came_from`: the end of the previous leg; None: the vehicle's position.
        """

    def _turn(self, ctx: FlightContext, item: MissionItem) -> None:  # noqa: B027
        """Begin a CONDITION_YAW; not possible on an aircraft."""

    def _turned(self, ctx: FlightContext) -> bool:
        """CONDITION_YAW is finished."""
        return True

    @abstractmethod
    def activate(self, ctx: FlightContext) -> None:
        """Continue from the present state, and begin the current item."""

    @abstractmethod
    def update(self, ctx: FlightContext) -> TaskStatus:
        """Write `ctx.setpoint` for the next period."""

    @property
    def item(self) -> MissionItem | None:
        """The item being flown; None after the last."""
        return None if self._finished or self._seq < 0 else self._store.items[self._seq]

    def _emit(self, ctx: FlightContext, event: FlightEvent) -> None:
        """Report progress, unless the plan is not the stored one."""
        if not self._rules.silent:
            ctx.events.append(event)

    def _restart(self, ctx: FlightContext) -> None:
        """(Re-)read the plan and begin its current item."""
        self._version = self._store.version
        self._finished = False
        self._jumps.clear()
        ctx.look_at(None)
        self._begin(ctx, max(self._store.current, self._first_item), None)

    def _begin(self, ctx: FlightContext, seq: int, came_from: Array | None) -> None:
        """Make `seq` the current item, and execute items that take no time."""
        items = self._store.items
        self._sub = None
        self._forget_leg()
        self._wait_left_s = 0.0
        self._beside.clear()
        self._condition_left_s = math.nan
        for _ in range(_MAX_INSTANT_ITEMS):
            if seq >= len(items):
                self._do_the_rest(ctx)
                self._finish(ctx)
                return
            item = items[seq]
            if plans.is_navigation(item):
                self._seq = self._store.current = seq
                self._emit(ctx, WaypointStarted(seq))
                if self._begin_timed(ctx, item, came_from):
                    self._go_on_beside(ctx)
                    return
                self._do_the_rest(ctx)
                seq += 1
                continue
            if item.command in plans.JUMPS:
                seq = self._jump(item, seq)
                continue
            if self._rules.conditions:
                self._beside.append(seq)
            else:
                self._seq = self._store.current = seq
                self._emit(ctx, WaypointStarted(seq))
                self._act(ctx, item, seq)
            seq += 1
        self._finish(ctx)

    def _finish(self, ctx: FlightContext) -> None:
        if not self._finished:
            self._emit(ctx, MissionFinished())
        self._finished = True
        self._seq = self._store.current
        self._forget_leg()
        self._set_sub(ctx, self._hold_task())

    def _set_sub(self, ctx: FlightContext, task: FlightTask) -> None:
        self._sub = task
        task.activate(ctx)

    # items that take no time

    def _jump(self, item: MissionItem, seq: int) -> int:
        """DO_JUMP, DO_JUMP_TAG: the next sequence number."""
        target = plans.jump_target(item, self._store.items)
        left = self._jumps.get(seq, round(item.param2) if math.isfinite(item.param2) else 0)
        if target is not None and target >= self._first_item and left != 0:
            self._jumps[seq] = left - 1 if left > 0 else left
            return target
        return seq + 1

    def _act(self, ctx: FlightContext, item: MissionItem, seq: int) -> None:
        """Execute a DO_ item."""
        if item.command == plans.Command.DO_CHANGE_SPEED:
            self._change_by_item(ctx, item)
        elif item.command == plans.Command.DO_SET_HOME:
            here = item.param1 == 1.0
            place = ctx.nav[nav_layout.POS_NED_M] if here else plans.target_of(item, ctx)
            if place is not None:
                ctx.events.append(HomeChangeRequested(float(place[0]), float(place[1]), float(place[2])))
        elif item.command in ROI_COMMANDS:
            ctx.look_at(roi_of(item, ctx))
            ctx.events.append(ItemCommanded(seq))
        elif item.command not in plans.MARKERS and item.command not in plans.CONDITIONS:
            ctx.events.append(ItemCommanded(seq))
        self._emit(ctx, WaypointReached(seq, navigation=False))

    def _change_by_item(self, ctx: FlightContext, item: MissionItem) -> None:
        """DO_CHANGE_SPEED in the plan; -2: back to the parameters' speed."""
        kind, speed_m_s = round(item.param1) if math.isfinite(item.param1) else 1, item.param2
        if kind not in tuple(SpeedKind) or not math.isfinite(speed_m_s):
            return
        if speed_m_s > 0.0:
            self.change_speed(ctx, SpeedKind(kind), speed_m_s)
        elif speed_m_s == _DEFAULT_SPEED and kind <= SpeedKind.GROUND_SPEED:
            for each in (SpeedKind.GROUND_SPEED, SpeedKind.CLIMB, SpeedKind.DESCENT):
                self.change_speed(ctx, each, None)

    # items during the flight to the next position

    def _go_on_beside(self, ctx: FlightContext) -> None:
        """Execute the items that are due during the flight, up to a condition that is not met."""
        while self._beside:
            seq = self._beside[0]
            item = self._store.items[seq]
            if item.command in plans.CONDITIONS:
                if not self._is_met(ctx, item):
                    return
                self._condition_left_s = math.nan
                self._emit(ctx, WaypointReached(seq, navigation=False))
            else:
                self._act(ctx, item, seq)
            self._beside.popleft()

    def _do_the_rest(self, ctx: FlightContext) -> None:
        """Without a flight, the items before the first condition are executed and the others are dropped."""
        while self._beside:
            seq = self._beside.popleft()
            item = self._store.items[seq]
            if item.command in plans.CONDITIONS:
                self._beside.clear()
                return
            self._act(ctx, item, seq)

    def _is_met(self, ctx: FlightContext, item: MissionItem) -> bool:
        """One update of a CONDITION_ item; true when it lets the next one pass."""
        if item.command == plans.Command.CONDITION_DISTANCE:
            target = plans.target_of(self._store.items[self._seq], ctx)
            if target is None:
                return True
            here = ctx.nav[nav_layout.POS_NED_M]
            away_m = math.hypot(float(target[0] - here[0]), float(target[1] - here[1]))
            return away_m <= item.param1
        first = math.isnan(self._condition_left_s)
        if item.command == plans.Command.CONDITION_YAW:
            if first:
                self._condition_left_s = 0.0
                self._turn(ctx, item)
            return self._turned(ctx)
        if first:
            self._condition_left_s = item.param1 if math.isfinite(item.param1) else 0.0
        else:
            self._condition_left_s -= ctx.dt_s
        return self._condition_left_s <= 0.0

    # region of interest

    def _roi_place(self, ctx: FlightContext) -> Array | None:
        """Position of the region of interest, local NED, (3,); None: there is none."""
        roi = ctx.roi
        if roi is None or self._finished:
            return None
        if roi.mode is RoiMode.LOCATION:
            return roi.place_ned_m
        seq = roi.index if roi.mode is RoiMode.WAYPOINT else self._seq
        items = self._store.items
        if not self._first_item <= seq < len(items) or not plans.is_waypoint(items[seq]):
            return None
        return plans.target_of(items[seq], ctx)

    # items that take time

    def _begin_timed(self, ctx: FlightContext, item: MissionItem, came_from: Array | None) -> bool:
        """Begin an item that takes time; False when there is nothing to fly."""
        if self._rules.hurries and item.command in _WAITS:
            item = replace(item, command=plans.Command.NAV_WAYPOINT, param1=0.0, param2=0.0, param3=0.0)
        if item.command == plans.Command.NAV_DELAY:
            self._wait_left_s = item.param1 if math.isfinite(item.param1) else 0.0
            if not self._wait_left_s > 0.0 or self._rules.hurries:
                return False
            self._set_sub(ctx, self._hold_task())
            return True
        if item.command == plans.Command.NAV_RETURN_TO_LAUNCH:
            ctx.events.append(MissionModeRequested(item.command))
            self._set_sub(ctx, self._return_task())
            return True
        return self._begin_flown(ctx, item, came_from)

    def _follow_store(self, ctx: FlightContext) -> None:
        """Start a new plan, or another current item; execute the items during the flight."""
        if self._store.version != self._version:
            self._restart(ctx)
        elif self._store.current != self._seq and not self._finished:
            self._begin(ctx, max(self._store.current, self._first_item), None)
        elif self._beside:
            self._go_on_beside(ctx)

    def _fly_sub(self, ctx: FlightContext, task: FlightTask) -> None:
        before = len(ctx.events)
        status = task.update(ctx)
        if len(ctx.events) != before:
            # the end of the sub-task is not the end of the mission
            ctx.events[before:] = [e for e in ctx.events[before:] if not isinstance(e, TaskFinished)]
        if self._finished:
            return
        item = self._store.items[self._seq]
        if item.command == plans.Command.NAV_DELAY:
            self._wait_left_s -= ctx.dt_s
            done = self._wait_left_s <= 0.0
        else:
            done = self._sub_done(ctx, item, status)
        if done:
            self._complete(ctx, item, self._came_from(ctx))

    def _sub_done(self, ctx: FlightContext, item: MissionItem, status: TaskStatus) -> bool:
        """The task of the current item has completed the item."""
        return status is TaskStatus.DONE

    def _came_from(self, ctx: FlightContext) -> Array | None:
        """Where the leg after a finished sub-task starts; None: at the vehicle's position."""
        return None

    def _complete(self, ctx: FlightContext, item: MissionItem, came_from: Array | None) -> None:
        """The current item is finished: report it, and continue."""
        self._emit(ctx, WaypointReached(self._seq, navigation=plans.is_navigation(item)))
        last = self._seq + 1 >= len(self._store.items)
        if last or not item.autocontinue:
            self._finish(ctx)
        else:
            self._begin(ctx, self._seq + 1, came_from)
