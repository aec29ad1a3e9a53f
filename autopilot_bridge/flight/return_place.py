"""What returns of all classes of vehicle share: height, target (PX4 RTL_TYPE | ArduPilot RALLY_*), plan.

Source: PX4 1.16 navigator/rtl (findRtlDestination), ArduPilot 4.6 AP_Rally.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from autopilot_bridge.flight.context import Array, FlightContext
from autopilot_bridge.flight.parameters import ALONG_PLAN, RallyRule, ReturnDestination
from autopilot_bridge.flight.plan_reading import (
    PX4_PLANS,
    Command,
    PlanRules,
    is_waypoint,
    landing_start,
    target_of,
)
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav_layout

if TYPE_CHECKING:
    from autopilot_bridge.flight.plan_task import PlanTask

_PREFERENCE_M: Final = 2.0  # home, then the landing, unless another place is closer by more than this (PX4)
_LANDINGS: Final = frozenset({Command.NAV_LAND, Command.NAV_VTOL_LAND})
_TO_LANDING: Final = frozenset(
    {ReturnDestination.LANDING_SEQUENCE, ReturnDestination.LANDING_OR_RALLY, ReturnDestination.CLOSEST}
)
_RALLY_POINT: Final = 5100  # MAV_CMD_NAV_RALLY_POINT


class ReturnPhase(IntEnum):
    """The phase of a return; the last two are a multicopter's, whose plan is a phase of its own."""

    CLIMB = 0
    FLY = 1
    DESCEND = 2
    LOITER = 3
    LAND = 4
    PLAN = 5
    STAY = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class ReturnPlace:
    """The target of a return.

    Attributes:
        ned_m: the position, local NED, (3,); its down is the ground reference of the return's heights.
        altitude_down_m: down coordinate of the return altitude; NaN: the parameter's.
        rally: it is a rally point.
        landing: sequence number at which the plan's landing begins; None: the vehicle lands, or circles,
            there.
    """

    ned_m: Array
    altitude_down_m: float = math.nan
    rally: bool = False
    landing: int | None = None


def plan_landing(store: MissionStore | None) -> int | None:
    """Where the landing of a plan begins: its DO_LAND_START, else its landing item; None: no landing."""
    if store is None:
        return None
    start = landing_start(store.items)
    if start is not None:
        return start
    return next((seq for seq, item in enumerate(store.items) if item.command in _LANDINGS), None)


def choose_return(
    ctx: FlightContext,
    rule: RallyRule,
    destination: ReturnDestination,
    landing: int | None,
    store: MissionStore | None,
) -> ReturnPlace | None:
    """The target of a return from here; None while there is no home.

    Args:
        rule: which rally points are considered.
        destination: which other targets are considered.
        landing: where the plan's landing begins; None: no landing.
        store: the plan.
    """
    if not math.isfinite(float(ctx.home_ned_m.sum())):
        return None
    home = ReturnPlace(ned_m=np.array(ctx.home_ned_m))
    rally = nearest_rally(ctx, rule)
    landing_place = _landing_place(ctx, store, landing) if destination in _TO_LANDING else None
    if destination is ReturnDestination.LANDING_SEQUENCE and landing_place is not None:
        return landing_place
    if destination is ReturnDestination.LANDING_OR_RALLY:
        candidates = [place for place in (landing_place, rally) if place is not None] or [home]
    else:
        # only among the rally points if home is not considered (ArduPilot)
        alone = rally is not None and not rule.home_competes
        candidates = [place for place in (None if alone else home, landing_place, rally) if place is not None]
    best = candidates[0]
    for place in candidates[1:]:
        if _away_m(ctx, place.ned_m) + _PREFERENCE_M < _away_m(ctx, best.ned_m):
            best = place
    return best


def nearest_rally(ctx: FlightContext, rule: RallyRule) -> ReturnPlace | None:
    """The nearest rally point that the rule allows; None: there is none."""
    if not rule.used or ctx.rally is None:
        return None
    nearest: ReturnPlace | None = None
    for item in ctx.rally.items:
        if item.command != _RALLY_POINT:
            continue
        place = target_of(item, ctx)
        if place is None or (
            rule.within_fence and ctx.within_fence is not None and not ctx.within_fence(place)
        ):
            continue
        if nearest is not None and _away_m(ctx, place) >= _away_m(ctx, nearest.ned_m):
            continue
        ground = place.copy()
        altitude_down = math.nan
        if not rule.altitude_is_ground:
            altitude_down = float(place[2])
            ground[2] = ctx.home_ned_m[2]
        nearest = ReturnPlace(ned_m=ground, altitude_down_m=altitude_down, rally=True)
    if nearest is None or _away_m(ctx, nearest.ned_m) > rule.limit_m:
        return None
    return nearest


def way_back(
    ctx: FlightContext, store: MissionStore, first_item: int, landing: int | None, *, shorter: bool
) -> tuple[MissionStore, int | None]:
    """The way along a plan: (plan, first item) forward to its landing, or a plan back to home.

    The second value is None for the way back, which is a separate plan.

    Args:
        landing: where the plan's landing begins; None: no landing.
        shorter: take the way with fewer waypoints; else forward if there is a landing.
    """
    items = store.items
    current = max(first_item, min(store.current, len(items) - 1))
    if current == first_item:
        current = _closest(ctx, items, first_item)
    forward = sum(is_waypoint(item) for item in items[current:landing])
    behind = [item for item in items[first_item:current] if is_waypoint(item)]
    if landing is not None and not (shorter and len(behind) < forward):
        return store, min(current, landing)
    back = MissionStore()
    steps = [replace(item, param1=0.0, autocontinue=True) for item in reversed(behind)]
    north, east, down = (float(value) for value in ctx.home_ned_m)
    home = MissionItem(command=Command.NAV_LAND, frame=1, param4=math.nan, x=north, y=east, z=down)
    back.replace((*steps, home), 1)
    return back, None


def _closest(ctx: FlightContext, items: tuple[MissionItem, ...], first_item: int) -> int:
    """Sequence number of the waypoint closest to the vehicle."""
    best, best_m = first_item, math.inf
    for seq in range(first_item, len(items)):
        place = target_of(items[seq], ctx) if is_waypoint(items[seq]) else None
        if place is not None and _away_m(ctx, place) < best_m:
            best, best_m = seq, _away_m(ctx, place)
    return best


def _landing_place(ctx: FlightContext, store: MissionStore | None, landing: int | None) -> ReturnPlace | None:
    """The plan's landing, at the position of its landing item."""
    if store is None or landing is None:
        return None
    for item in store.items[landing:]:
        if item.command in _LANDINGS:
            place = target_of(item, ctx)
            return None if place is None else ReturnPlace(ned_m=place, landing=landing)
    return None


def _away_m(ctx: FlightContext, place: Array) -> float:
    here = ctx.nav[nav_layout.POS_NED_M]
    return math.hypot(float(place[0] - here[0]), float(place[1] - here[1]))


class HomewardTask:
    """A return that may fly the plan.

    Args:
        store: the plan, whose landing the parameters may send the return to; None: there is none.
        first_item: the first item that is flown, as in the mission task.
        rules: how the firmware flies a plan.
        plan_task: makes the mission task that flies the plan; None: the return flies no plan.

    Attributes:
        phase: see `ReturnPhase`.
        place: the target of the return; None: there is none.
    """

    def __init__(
        self,
        store: MissionStore | None = None,
        *,
        first_item: int = 0,
        rules: PlanRules = PX4_PLANS,
        plan_task: Callable[..., PlanTask] | None = None,
    ) -> None:
        super().__init__()
        self.phase = ReturnPhase.CLIMB
        self.place: ReturnPlace | None = None
        self._store = store
        self._first_item = first_item
        self._rules = rules
        self._plan_task = plan_task
        self._wait_s = 0.0

    def _plan_home(
        self, ctx: FlightContext, destination: ReturnDestination, place: ReturnPlace | None
    ) -> PlanTask | None:
        """The task that flies the plan to `place`, from the item where that begins, without the waiting times
        of the way; the way back is a separate plan. None: there is no plan."""
        store, first_item, rules = self._store, self._first_item, self._rules
        if store is None or self._plan_task is None or len(store.items) <= first_item:
            return None
        begin = None if place is None else place.landing
        if destination in ALONG_PLAN:
            shorter = destination is ReturnDestination.ALONG_PLAN_SHORTER
            own, begin = way_back(ctx, store, first_item, plan_landing(store), shorter=shorter)
            rules = replace(rules, hurries=True, silent=own is not store)
            if own is not store:
                store, first_item = own, 0
        if begin is not None:
            store.current = begin
        return self._plan_task(store, first_item=first_item, rules=rules)
