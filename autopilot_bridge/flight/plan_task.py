"""What flying an uploaded plan takes on any vehicle: the order of its items, jumps, conditions, DO_ items."""

import math
from abc import ABC, abstractmethod
from typing import Final

from autopilot_bridge.flight.context import (
    Array,
    FlightContext,
    HomeChangeRequested,
    MissionFinished,
    MissionModeRequested,
    WaypointReached,
    WaypointStarted,
)
from autopilot_bridge.flight.plan_reading import Command, is_navigation, jump_target, target_of
from autopilot_bridge.flight.task import FlightTask, SpeedKind, TaskStatus
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav_layout

_MAX_INSTANT_ITEMS: Final = 200  # per update: breaks loops of DO_JUMP without anything to fly in between


class PlanTask(ABC):
    """Executes the items of a store, from its current one; DONE (and holding) after the last.

    A new plan or another current item, seen in the store, takes effect at the next update. DO_ items act at
    once; those for equipment the vehicle doesn't have are passed over. What takes time is either a task of
    its own (`_sub`) or a leg, which the vehicle's class flies itself.

    Args:
        store: the plan; its `current` is kept up to date.
        first_item: 1 where item 0 is home (ArduPilot).
    """

    __slots__ = (
        "_finished",
        "_first_item",
        "_jumps",
        "_seq",
        "_store",
        "_sub",
        "_version",
        "_wait_left_s",
    )

    def __init__(self, store: MissionStore, *, first_item: int = 0) -> None:
        self._store = store
        self._first_item = first_item
        self._version = -1
        self._seq = -1
        self._sub: FlightTask | None = None
        self._jumps: dict[int, int] = {}
        self._wait_left_s = 0.0
        self._finished = False

    @abstractmethod
    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Fly on at this speed until an item or a command changes it, the present leg included."""

    @abstractmethod
    def _forget_leg(self) -> None:
        """No leg is flown any more."""

    @abstractmethod
    def _hold_task(self) -> FlightTask:
        """Stays here."""

    @abstractmethod
    def _return_task(self) -> FlightTask:
        """Flies home."""

    @abstractmethod
    def _begin_flown(self, ctx: FlightContext, item: MissionItem, came_from: Array | None) -> bool:
        """Begin an item that is flown, as `_sub` or as a leg; False when there is nothing to do.

        `came_from`: the place the leg before has led to; None: wherever the vehicle is.
        """

    @property
    def item(self) -> MissionItem | None:
        """The item being flown; None after the last."""
        return None if self._finished or self._seq < 0 else self._store.items[self._seq]

    def _restart(self, ctx: FlightContext) -> None:
        """(Re-)read the plan and begin its current item."""
        self._version = self._store.version
        self._finished = False
        self._jumps.clear()
        self._begin(ctx, max(self._store.current, self._first_item), None)

    def _begin(self, ctx: FlightContext, seq: int, came_from: Array | None) -> None:
        """Make `seq` the current item, running through items that take no time."""
        items = self._store.items
        self._sub = None
        self._forget_leg()
        self._wait_left_s = 0.0
        for _ in range(_MAX_INSTANT_ITEMS):
            if seq >= len(items):
                self._finish(ctx)
                return
            item = items[seq]
            self._seq = self._store.current = seq
            ctx.events.append(WaypointStarted(seq))
            if is_navigation(item) or item.command in (Command.CONDITION_DELAY, Command.CONDITION_YAW):
                if self._begin_timed(ctx, item, came_from):
                    return
                seq += 1
                continue
            seq = self._act(ctx, item, seq)
        self._finish(ctx)

    def _finish(self, ctx: FlightContext) -> None:
        if not self._finished:
            ctx.events.append(MissionFinished())
        self._finished = True
        self._forget_leg()
        self._set_sub(ctx, self._hold_task())

    def _set_sub(self, ctx: FlightContext, task: FlightTask) -> None:
        self._sub = task
        task.activate(ctx)

    def _act(self, ctx: FlightContext, item: MissionItem, seq: int) -> int:
        """A DO_ item: do it, and give the next sequence number."""
        if item.command == Command.DO_JUMP:
            target = jump_target(item, self._store.items)
            left = self._jumps.get(seq, round(item.param2) if math.isfinite(item.param2) else 0)
            if target is not None and target >= self._first_item and left != 0:
                self._jumps[seq] = left - 1 if left > 0 else left
                return target
        elif item.command == Command.DO_CHANGE_SPEED:
            self._change_by_item(ctx, item)
        elif item.command == Command.DO_SET_HOME:
            here = item.param1 == 1.0
            place = ctx.nav[nav_layout.POS_NED_M] if here else target_of(item, ctx)
            if place is not None:
                ctx.events.append(HomeChangeRequested(float(place[0]), float(place[1]), float(place[2])))
        ctx.events.append(WaypointReached(seq, navigation=False))
        return seq + 1

    def _change_by_item(self, ctx: FlightContext, item: MissionItem) -> None:
        """DO_CHANGE_SPEED in the plan; -2: back to the parameters' speed."""
        kind, speed_m_s = round(item.param1) if math.isfinite(item.param1) else 1, item.param2
        if kind not in tuple(SpeedKind) or not math.isfinite(speed_m_s):
            return
        if speed_m_s > 0.0:
            self.change_speed(ctx, SpeedKind(kind), speed_m_s)
        elif speed_m_s == -2.0 and kind <= SpeedKind.GROUND_SPEED:
            for each in (SpeedKind.GROUND_SPEED, SpeedKind.CLIMB, SpeedKind.DESCENT):
                self.change_speed(ctx, each, None)

    def _begin_timed(self, ctx: FlightContext, item: MissionItem, came_from: Array | None) -> bool:
        """Begin an item that takes time; False when there is nothing to do."""
        if item.command in (Command.CONDITION_DELAY, Command.NAV_DELAY):
            self._wait_left_s = item.param1 if math.isfinite(item.param1) else 0.0
            self._set_sub(ctx, self._hold_task())
            return self._wait_left_s > 0.0
        if item.command == Command.NAV_RETURN_TO_LAUNCH:
            ctx.events.append(MissionModeRequested(item.command))
            self._set_sub(ctx, self._return_task())
            return True
        return self._begin_flown(ctx, item, came_from)

    def _follow_store(self, ctx: FlightContext) -> None:
        """Take over a new plan, or another current item."""
        if self._store.version != self._version:
            self._restart(ctx)
        elif self._store.current != self._seq and not self._finished:
            self._begin(ctx, max(self._store.current, self._first_item), None)

    def _fly_sub(self, ctx: FlightContext, task: FlightTask) -> None:
        before = len(ctx.events)
        status = task.update(ctx)
        if len(ctx.events) != before:
            # the sub-task's own end is not the mission's
            ctx.events[before:] = [e for e in ctx.events[before:] if type(e).__name__ != "TaskFinished"]
        if self._finished:
            return
        item = self._store.items[self._seq]
        if item.command in (Command.CONDITION_DELAY, Command.NAV_DELAY):
            self._wait_left_s -= ctx.dt_s
            done = self._wait_left_s <= 0.0
        else:
            done = self._sub_done(ctx, item, status)
        if done:
            self._complete(ctx, item, self._came_from(ctx))

    def _sub_done(self, ctx: FlightContext, item: MissionItem, status: TaskStatus) -> bool:
        """The task of the current item has done what the item asks for."""
        return status is TaskStatus.DONE

    def _came_from(self, ctx: FlightContext) -> Array | None:
        """Where the leg after a finished sub-task starts; None: wherever the vehicle is."""
        return None

    def _complete(self, ctx: FlightContext, item: MissionItem, came_from: Array | None) -> None:
        """The current item is done: report, and go on."""
        ctx.events.append(WaypointReached(self._seq, navigation=is_navigation(item)))
        last = self._seq + 1 >= len(self._store.items)
        if last or not item.autocontinue:
            self._finish(ctx)
        else:
            self._begin(ctx, self._seq + 1, came_from)
