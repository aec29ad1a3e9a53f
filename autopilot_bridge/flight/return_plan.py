"""A return along the plan: forward to its landing, or back along the flown way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from autopilot_bridge.flight.plan_rules import PlanHabits
from autopilot_bridge.flight.return_place import ReturnPlace, plan_landing, way_back
from autopilot_bridge.flight.return_rules import ALONG_PLAN, ReturnDestination
from autopilot_bridge.mission_plan import MissionStore

if TYPE_CHECKING:
    from autopilot_bridge.flight.context import FlightContext
    from autopilot_bridge.flight.plan_task import PlanTask


@dataclass(frozen=True, slots=True, kw_only=True)
class ReturnPlan:
    """The plan that a return flies.

    Attributes:
        store: the plan; for the way back a separate plan.
        first_item: the first item that is flown.
        habits: how it is flown; a return skips the waiting times.
    """

    store: MissionStore
    first_item: int
    habits: PlanHabits

    @classmethod
    def of(
        cls,
        ctx: FlightContext,
        store: MissionStore,
        first_item: int,
        habits: PlanHabits,
        destination: ReturnDestination,
        place: ReturnPlace | None,
    ) -> ReturnPlan:
        """The plan of a return to `place`, set to the item where it begins."""
        begin = None if place is None else place.landing
        if destination in ALONG_PLAN:
            shorter = destination is ReturnDestination.ALONG_PLAN_SHORTER
            own, begin = way_back(ctx, store, first_item, plan_landing(store), shorter=shorter)
            habits = replace(habits, hurries=True, silent=own is not store)
            if own is not store:
                return cls(store=own, first_item=0, habits=habits)
        if begin is not None:
            store.current = begin
        return cls(store=store, first_item=first_item, habits=habits)

    def task(self, make: Callable[..., PlanTask]) -> PlanTask:
        """The task that flies the plan."""
        return make(self.store, first_item=self.first_item, habits=self.habits)
