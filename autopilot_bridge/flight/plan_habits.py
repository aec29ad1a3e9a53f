"""What firmwares do differently with the items of a plan. Data, not code."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanHabits:
    """How one firmware goes through a plan.

    Attributes:
        conditions: CONDITION_ items hold up the DO_ items behind them, beside the flight to the next place
            (ArduPilot); else they are passed over (PX4).
        tags: DO_JUMP_TAG finds its JUMP_TAG (ArduPilot).
        item_radius: a waypoint's own acceptance radius counts (PX4, ArduPlane; ArduCopter has one for all).
        holds: a waypoint's hold time is waited for (PX4, ArduCopter; ArduPlane has none).
        passes_by: a waypoint's param3 is how far beyond it the next leg begins (ArduPlane).
        hurries: loiters and delays are not waited for (a return along the plan).
        silent: items are not reported as begun and reached: the plan is not the stored one.
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
