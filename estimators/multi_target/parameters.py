"""Parameters of the multi-target estimator."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from estimators.tracking.cell_count import cells_over
from estimators.tracking.motion import MotionKind
from flightsim.foundation.options import Options, option

__all__ = ["Belief", "MultiTargetParameters"]

_REACH: Final = 100.0 / 15.0
"""Radius of the field of view, in scales of its fall: there the probability of detection is 0.035."""
_CELLS: Final = 60  # of the exploration map along the longer side
_LEAST_CELL_M: Final = 5.0


class Belief(StrEnum):
    """The filter of the detected targets."""

    PARTICLES = "particles"
    """PHD filter, its intensity as particles (the paper's)."""
    GAUSSIANS = "gaussians"
    """PHD filter, its intensity as Gaussian components."""
    BERNOULLIS = "bernoullis"
    """Poisson multi-Bernoulli filter: each target has a probability to exist."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiTargetParameters(Options):
    """Parameters of `MultiTargetEstimator`. Places are metres from the home of the centre vehicle."""

    south_m: float = option(-30.0, help="Southern edge of the searched area (paper: -30 m).")
    west_m: float = option(-30.0, help="Western edge of the searched area.")
    north_m: float = option(270.0, help="Northern edge of the searched area (paper: 270 m).")
    east_m: float = option(270.0, help="Eastern edge of the searched area.")
    cell_m: float | None = option(
        None, above=0.0, varies="1/60 of the longer side", help="Side of a cell of the exploration map."
    )
    gain: float = option(
        0.98, above=0.0, most=1.0, help="Probability to detect a target below the vehicle (paper: G)."
    )
    forward_scale_m: float = option(
        15.0, above=0.0, help="Scale of the sensor's fall ahead of the vehicle (paper: F_X)."
    )
    right_scale_m: float = option(
        15.0, above=0.0, help="Scale of the sensor's fall beside the vehicle (paper: F_Y)."
    )
    reach_m: float | None = option(
        None, above=0.0, varies="6.7 of the larger scale", help="Radius of the field of view."
    )
    range_sigma_m: float = option(0.5, above=0.0, help="Standard deviation of the sensor's range.")
    bearing_sigma_rad: float = option(
        math.radians(1.7), above=0.0, help="Standard deviation of the sensor's bearing."
    )
    place_sigma_m: float = option(0.3, least=0.0, help="Standard deviation of the vehicle's place.")
    heading_sigma_rad: float = option(
        0.02, least=0.0, help="Standard deviation of the vehicle's own heading."
    )
    range_bias_sigma_m: float = option(
        0.5, least=0.0, help="Standard deviation of a range error that all scans of a vehicle share."
    )
    bearing_bias_sigma_rad: float = option(
        math.radians(2.0),
        least=0.0,
        help="Standard deviation of a bearing or heading error that all scans of a vehicle share.",
    )
    clutter_per_scan: float = option(0.0, least=0.0, help="Mean number of false detections in a scan.")
    unknown_clutter_per_scan: float = option(
        0.2,
        least=0.0,
        help="Mean number of false detections in a scan allowed for beyond `clutter_per_scan`.",
    )
    belief: Belief = option(
        Belief.BERNOULLIS, help="Filter: PHD by particles (paper) or Gaussians, or Poisson multi-Bernoulli."
    )
    expected_targets: float = option(
        18.0, above=0.0, help="Number of targets in the area that is expected before the search."
    )
    motion: MotionKind = option(MotionKind.STATIC, help="Motion of the targets, as the filter expects it.")
    walk_m_sqrt_s: float | None = option(
        None,
        least=0.0,
        varies="0.5; static targets: 0.03",
        help="Standard deviation of a place, per axis, m after one second of motion.",
    )
    acceleration_m_s2_sqrt_hz: float = option(
        0.1, least=0.0, help="Spectral density of the acceleration's noise (constant velocity)."
    )
    speed_sigma_m_s: float = option(
        1.0, least=0.0, help="Standard deviation of a new target's velocity per axis (constant velocity)."
    )
    survival_per_s: float | None = option(
        None,
        above=0.0,
        most=1.0,
        varies="0.999; static targets: 1",
        help="Probability of a target to survive a second.",
    )
    forget_s: float = option(
        120.0, above=0.0, help="Time constant of the exploration map's return to 1, when targets move."
    )
    particles_per_target: int = option(
        500, least=1, most=1_000_000, help="Number of particles of each expected target."
    )
    births_per_measurement: int = option(
        250, least=1, most=1_000_000, help="Number of particles born at each measurement."
    )
    max_particles: int = option(20_000, least=1, most=1_000_000, help="Largest number of particles.")
    found_width_m: float = option(
        0.5, above=0.0, help="Width of a cluster below which it is a found target (paper: T_W)."
    )
    found_mass: float = option(
        0.9,
        above=0.0,
        help="Expected number of targets from which a cluster is a found target (paper: T_m, 1).",
    )
    found_distance_m: float = option(
        4.0, above=0.0, help="Distance from a found target within which measurements are of it (paper: T_z)."
    )
    reported_mass: float = option(
        0.5, above=0.0, help="Expected number of targets from which a cluster is reported as a target."
    )
    least_height_m: float = option(3.0, help="Height above home below which scans are not used.")
    centre_vehicle: int = option(
        0,
        least=0,
        most=255,
        help="System id of the vehicle whose home is the origin; 0: of the first that scans.",
    )
    seed: int = option(0, least=0, help="Seed of the random numbers of filter and planner.")

    def check_together(self) -> None:
        if not (self.north_m > self.south_m and self.east_m > self.west_m):
            raise ValueError(
                f"the area from {self.south_m:g},{self.west_m:g} to {self.north_m:g},{self.east_m:g} is "
                "empty; north_m must be above south_m, and east_m above west_m"
            )
        cells_over(self.east_m - self.west_m, self.north_m - self.south_m, self.cell_side_m)

    @property
    def cell_side_m(self) -> float:
        """Side of a cell of the exploration map."""
        longer_m = max(self.north_m - self.south_m, self.east_m - self.west_m)
        return self.cell_m or max(_LEAST_CELL_M, longer_m / _CELLS)

    @property
    def range_m(self) -> float:
        """Radius of the field of view."""
        return self.reach_m or _REACH * max(self.forward_scale_m, self.right_scale_m)

    @property
    def birth_per_m2(self) -> float:
        """Targets per square metre that are expected before the search; times the exploration map, the
        intensity of targets that were never detected.
        """
        return self.expected_targets / ((self.north_m - self.south_m) * (self.east_m - self.west_m))
