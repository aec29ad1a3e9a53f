"""Parameters of the team's search, of its decisions, and the way in which a target is named."""

from dataclasses import dataclass
from enum import StrEnum

from flightsim.foundation.options import option
from missions.base.options import PlanOptions


class Identify(StrEnum):
    """How a search decides that an anomaly is the target."""

    THRESHOLD = "threshold"
    """Enough passes have detected an anomaly at one place."""
    TRACE = "trace"
    """By a classifier on the trace of the paper's confidence."""
    BAYES = "bayes"
    """By the evidence of all classes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DecisionParameters(PlanOptions):
    """Parameters of one searcher's decisions."""

    neighbourhood: int = option(
        1, least=1, most=20, help="Cells that a decision looks at, in each direction (paper: 1)."
    )
    heading_penalty: float = option(
        0.3, above=0.0, help="Penalty of a turn by 180 degrees, in mean prior scores (paper: alpha)."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchParameters(PlanOptions):
    """Parameters of a team's search."""

    detection_probability: float = option(
        0.95, above=0.0, below=1.0, help="Probability that a pass right over a target detects it."
    )
    detection_range_m: float = option(
        80.0, above=0.0, help="Standard deviation of the fall of that probability to the sides."
    )
    raise_radius_m: float = option(
        300.0, above=0.0, help="Distance from an anomaly within which scores are raised."
    )
    raise_height: float = option(
        4.0, above=0.0, help="Increase of the scores at an anomaly, in mean prior scores."
    )
    confirmations: int = option(
        2, least=1, help="Passes that must detect an anomaly at one place, with `identify=threshold`."
    )
    same_place_m: float = option(180.0, above=0.0, help="Distance within which anomalies count as one.")
    no_target_prior: float = option(
        0.2, least=0.0, below=1.0, help="Probability, before the search, that the area has no target."
    )
