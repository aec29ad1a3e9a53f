"""Differences between the firmwares in the flight of a plan. Data, not code."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanHabits:
    """How one firmware flies a plan.

    Attributes:
        conditions: CONDITION_ items delay the DO_ items after them, during the flight to the next position
            (ArduPilot); else they are skipped (PX4).
        tags: DO_JUMP_TAG jumps to its JUMP_TAG (ArduPilot).
        item_radius: a waypoint's own acceptance radius is used (PX4, ArduPlane; ArduCopter has one for all).
        holds: a waypoint's hold time is flown (PX4, ArduCopter; ArduPlane has none).
        passes_by: a waypoint's param3 is how far beyond it the next leg begins (ArduPlane).
        hurries: loiter times and delays are skipped (a return along the plan).
        silent: the start and end of items are not reported: the plan is not the stored one.
    """

    conditions: bool = False
    tags: bool = False
    item_radius: bool = True
    holds: bool = True
    passes_by: bool = False
    hurries: bool = False
    silent: bool = False


PX4_PLANS = PlanHabits()
ARDUCOPTER_PLANS = PlanHabits(conditions=True, tags=True, item_radius=False)
ARDUPLANE_PLANS = PlanHabits(conditions=True, tags=True, holds=False, passes_by=True)
