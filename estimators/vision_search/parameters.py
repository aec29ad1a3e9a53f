"""Parameters of the vision search."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from estimators.tracking.cell_count import cells_over
from flightsim.foundation.options import Options, option

__all__ = ["BeliefKind", "VisionSearchParameters"]

MOST_CELLS: Final = 16_000_000
_CELLS: Final = 400  # along the longer side
_LEAST_CELL_M: Final = 0.5


class BeliefKind(StrEnum):
    """How the belief is represented."""

    GRID = "grid"
    PARTICLES = "particles"


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionSearchParameters(Options):
    """Parameters of `VisionSearchEstimator`. Places are metres from the home of the centre vehicle."""

    south_m: float = option(-150.0, help="Southern edge of the searched area; the target is in it.")
    west_m: float = option(-150.0, help="Western edge of the searched area.")
    north_m: float = option(150.0, help="Northern edge of the searched area.")
    east_m: float = option(150.0, help="Eastern edge of the searched area.")
    tag_id: int = option(
        0,
        least=0,
        most=254,
        help="Number of the tag (AprilTag 36h11) that is searched for; others are counted only.",
    )
    belief: BeliefKind = option(BeliefKind.GRID, help="Representation of the belief.")
    cell_m: float | None = option(
        None,
        above=0.0,
        varies="1/400 of the longer side",
        help="Side of a cell of the grid (paper: 12.5 and 0.67 m).",
    )
    log_scale: bool = option(False, help="Logarithms of the cells' probabilities are stored.")
    single_precision: bool = option(False, help="Cells are stored as float32.")
    particles: int = option(6400, least=10, most=10_000_000, help="Number of particles (paper: 6400).")
    resample_share: float = option(
        0.5, least=0.0, most=1.0, help="Share of effective particles below which they are resampled."
    )
    walk_m_sqrt_s: float = option(
        0.0, least=0.0, help="Standard deviation of the target's walk, per axis, m in a second; 0: static."
    )
    target_size_m: float = option(2.0, above=0.0, help="Side of the tag's black square.")
    detect_peak: float = option(
        0.97, above=0.0, most=1.0, help="Bound of the probability of detection (docs/vision.md)."
    )
    detect_half_px: float = option(17.0, help="Side of the tag in the picture with half of that probability.")
    detect_width_px: float = option(
        1.5, above=0.0, help="Width of the rise of that probability over the side in the picture."
    )
    false_rate: float = option(
        1e-4, above=0.0, below=1.0, help="Probability of a false detection in a frame."
    )
    pixel_sigma_px: float = option(
        0.5, above=0.0, help="Standard deviation of a detection's place in the picture."
    )
    border_sides: float = option(
        0.65, least=0.0, most=10.0, help="Border of the picture without detections, in sides of the tag."
    )
    forward_sigma_m: float = option(
        0.15, least=0.0, help="Standard deviation of the vehicles' places along the heading."
    )
    right_sigma_m: float = option(
        0.15, least=0.0, help="Standard deviation of the vehicles' places across the heading."
    )
    height_sigma_m: float = option(0.4, least=0.0, help="Standard deviation of the vehicles' heights.")
    yaw_sigma_rad: float = option(
        math.radians(0.6), least=0.0, help="Standard deviation of the vehicles' yaw."
    )
    pitch_sigma_rad: float = option(
        math.radians(0.23), least=0.0, help="Standard deviation of the vehicles' pitch."
    )
    roll_sigma_rad: float = option(
        math.radians(0.23), least=0.0, help="Standard deviation of the vehicles' roll."
    )
    mount_sigma_rad: float = option(
        math.radians(1.0), least=0.0, help="Standard deviation of the angles of the cameras' mounts."
    )
    yaw_bias_sigma_rad: float = option(
        math.radians(3.0), least=0.0, help="Standard deviation of the part of the yaw's error that stays."
    )
    latency_sigma_s: float = option(
        0.1, least=0.0, help="Standard deviation of the error of the pictures' times, the same in all frames."
    )
    ground_sigma_m: float = option(
        4.0, least=0.0, help="Standard deviation of the ground's height at the target about that of home."
    )
    place_time_s: float = option(60.0, least=0.0, help="Correlation time of the places' errors.")
    attitude_time_s: float = option(60.0, least=0.0, help="Correlation time of the attitudes' errors.")
    frame_period_s: float = option(
        0.25, least=0.0, help="Shortest time between frames that are used (paper: 0.25 s)."
    )
    estimate_period_s: float = option(
        1.0, least=0.0, help="Time between estimates; a detection gives one at once."
    )
    least_height_m: float = option(5.0, least=0.0, help="Height above home below which frames are not used.")
    own_vehicle: int = option(
        0,
        least=0,
        most=255,
        help="System id of the vehicle that carries the estimator; 0: frames of all are received.",
    )
    centre_vehicle: int = option(
        0,
        least=0,
        most=255,
        help="System id of the vehicle whose home is the origin; 0: of the first that looks.",
    )
    seed: int = option(0, least=0, help="Seed of the random numbers of filter, planner and link.")

    def check_together(self) -> None:
        if not (self.north_m > self.south_m and self.east_m > self.west_m):
            raise ValueError("north_m must be above south_m, and east_m above west_m")
        cells_over(self.east_m - self.west_m, self.north_m - self.south_m, self.cell_side_m, MOST_CELLS)

    @property
    def cell_side_m(self) -> float:
        """Side of a cell of the grid."""
        longer_m = max(self.north_m - self.south_m, self.east_m - self.west_m)
        return self.cell_m or max(_LEAST_CELL_M, longer_m / _CELLS)
