"""What is true in the world of a search for targets, and the mission does not know."""

from dataclasses import dataclass

from flightsim.foundation.checks import NotNegative, Positive
from flightsim.foundation.options import Options, option
from missions.base.options import PlanOptions
from missions.errors import PlanError


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetField(PlanOptions):
    """The true targets, what hides them, and how often they are scanned."""

    count: int = option(18, least=0, most=250, name="targets", help="Number of true targets.")
    clusters: int = option(3, least=0, help="Number of clusters of targets; 0: uniform over the area.")
    cluster_sigma_m: float = option(14.0, above=0.0, help="Standard deviation of a cluster, per axis.")
    speed_m_s: float = option(
        0.0, least=0.0, most=15.0, name="target-speed", help="Speed of each target; 0: it stays."
    )
    terrain_relief_m: float | None = option(
        None,
        name="terrain",
        metavar="RELIEF",
        varies="level ground",
        help="Standard deviation of the heights of terrain that hides targets, m.",
    )
    scan_period_s: float = option(1.0, help="Time between scans.")

    def check_together(self) -> None:
        if self.clusters > self.count:
            raise PlanError(f"`clusters` {self.clusters} is not in 0..{self.count}, the number of targets")


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviation(Options):
    """In what a world differs from what the estimator expects.

    Attributes:
        detection_scale: factor of the distances over which the probability of detection falls.
        clutter_per_scan: mean number of false detections; None: as the estimator expects.
        range_bias_m, bearing_bias_rad: of every measurement.
        walk_m_sqrt_s: of each target, standard deviation of its place per axis after one second; the paths
            are legs of 10 s in random directions.
    """

    detection_scale: Positive = 1.0
    clutter_per_scan: NotNegative | None = None
    range_bias_m: float = 0.0
    bearing_bias_rad: float = 0.0
    walk_m_sqrt_s: NotNegative = 0.0
