"""What is true in the world of an orbit, and the mission does not know."""

from dataclasses import dataclass

from flightsim.foundation.options import option
from missions.base.options import PlanOptions
from missions.worlds.motion_kind import MotionKind


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetMotion(PlanOptions):
    """How the target really moves."""

    kind: MotionKind | None = option(
        None,
        name="target-motion",
        varies="straight on, or static",
        help="Motion of the target; one that wanders stays within 100 m.",
    )
