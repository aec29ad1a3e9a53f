"""Parameters of the vision search."""

import math
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Final

import numpy as np

from estimators.errors import EstimatorError
from estimators.tracking.area_belief import AreaBelief
from estimators.tracking.camera_sight import DetectionRate, PoseErrors, SightModel
from estimators.tracking.grid import GridLayout
from estimators.tracking.intensity import Motion, MotionKind
from estimators.tracking.search_grid import Scale, SearchGrid
from estimators.tracking.search_particles import SearchParticles
from flightsim.foundation.random_streams import RandomStreams

__all__ = ["BeliefKind", "VisionSearchParameters"]

_MOST_CELLS: Final = 16_000_000


class BeliefKind(StrEnum):
    """How the belief is represented."""

    GRID = "grid"
    PARTICLES = "particles"


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionSearchParameters:
    """Parameters of `VisionSearchEstimator`. Places are metres from the home of the centre vehicle.

    Attributes:
        south_m, west_m, north_m, east_m: edges of the searched area; the target is in it.
        tag_id: number of the tag that is searched for; others are counted only.
        belief: grid or particles.
        cell_m: side of a cell (paper: 12.5 and 0.67 m).
        log_scale: store logarithms of the cells' probabilities.
        single_precision: store the cells as float32.
        particles: number of particles (paper: 6400).
        resample_share: resample when the effective number is below this share.
        walk_m_sqrt_s: standard deviation per axis of the target's random walk in a second; 0: it is static.
        target_size_m: side of the tag.
        detect_peak, detect_half_px, detect_width_px: probability of detection by the pixels of the tag's
            side: bound, half of it, and the width of its rise (docs/vision.md has the detector's measured
                rates).
        false_rate, pixel_sigma_px, border_sides: as in `SightModel`.
        forward_sigma_m, right_sigma_m, height_sigma_m, yaw_sigma_rad, pitch_sigma_rad, roll_sigma_rad,
            mount_sigma_rad, place_time_s, attitude_time_s: errors of the pose, as in `PoseErrors`.
        frame_period_s: frames that follow a used one sooner are not used (paper: about 4 a second).
        estimate_period_s: time between estimates; a detection gives one at once.
        least_height_m: frames from below this height above home are not used.
        own_vehicle: system id of the vehicle on board of which the estimator runs: frames of others are used
            when their likelihood is received; 0: the frames of all are received.
        centre_vehicle: system id of the vehicle whose home is the origin; 0: of the first one that looks.
        seed: of the particles' random numbers.
    """

    south_m: float = -200.0
    west_m: float = -200.0
    north_m: float = 200.0
    east_m: float = 200.0
    tag_id: int = 0
    belief: BeliefKind = BeliefKind.GRID
    cell_m: float = 1.0
    log_scale: bool = False
    single_precision: bool = False
    particles: int = 6400
    resample_share: float = 0.5
    walk_m_sqrt_s: float = 0.0
    target_size_m: float = 2.0
    detect_peak: float = 0.97
    detect_half_px: float = 17.0
    detect_width_px: float = 1.5
    false_rate: float = 1e-4
    pixel_sigma_px: float = 0.5
    border_sides: float = 0.65
    forward_sigma_m: float = 0.3
    right_sigma_m: float = 0.3
    height_sigma_m: float = 0.6
    yaw_sigma_rad: float = 0.02
    pitch_sigma_rad: float = 0.01
    roll_sigma_rad: float = 0.01
    mount_sigma_rad: float = 0.0
    place_time_s: float = 20.0
    attitude_time_s: float = 5.0
    frame_period_s: float = 0.25
    estimate_period_s: float = 1.0
    least_height_m: float = 5.0
    own_vehicle: int = 0
    centre_vehicle: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.belief not in tuple(BeliefKind):
            raise ValueError(f"belief {self.belief!r} is not one of {', '.join(BeliefKind)}")
        object.__setattr__(self, "belief", BeliefKind(self.belief))
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float) and not math.isfinite(value):
                raise ValueError(f"{field.name} {value} is not a finite number")
        for name in ("frame_period_s", "estimate_period_s", "least_height_m", "walk_m_sqrt_s"):
            if getattr(self, name) < 0.0:
                raise ValueError(f"{name} {getattr(self, name):g} is not possible; give 0 or more")
        if not 0 <= self.tag_id <= 254:
            raise ValueError(f"tag_id {self.tag_id} is not in 0..254, what LANDING_TARGET can report")
        for name in ("own_vehicle", "centre_vehicle"):
            if not 0 <= getattr(self, name) <= 255:
                raise ValueError(f"{name} {getattr(self, name)} is not in 0..255")
        try:
            _ = self.layout, self.sight_model, self.pose_errors
        except EstimatorError as error:
            raise ValueError(str(error)) from None

    @property
    def layout(self) -> GridLayout:
        """Cells over the area; also for particles, which take its edges only."""
        if not (self.north_m > self.south_m and self.east_m > self.west_m):
            raise EstimatorError("north_m must be above south_m, and east_m above west_m")
        return GridLayout.over(
            width_m=self.east_m - self.west_m,
            height_m=self.north_m - self.south_m,
            cell_m=self.cell_m,
            centre_ne_m=(0.5 * (self.north_m + self.south_m), 0.5 * (self.east_m + self.west_m)),
            most_cells=_MOST_CELLS,
        )

    @property
    def sight_model(self) -> SightModel:
        """What is known about detector and target."""
        return SightModel(
            rate=DetectionRate.rising(
                half_px=self.detect_half_px, width_px=self.detect_width_px, peak=self.detect_peak
            ),
            target_size_m=self.target_size_m,
            false_rate=self.false_rate,
            pixel_sigma_px=self.pixel_sigma_px,
            border_sides=self.border_sides,
        )

    @property
    def pose_errors(self) -> PoseErrors:
        """Errors of the vehicles' poses."""
        return PoseErrors(
            forward_m=self.forward_sigma_m,
            right_m=self.right_sigma_m,
            height_m=self.height_sigma_m,
            yaw_rad=self.yaw_sigma_rad,
            pitch_rad=self.pitch_sigma_rad,
            roll_rad=self.roll_sigma_rad,
            mount_rad=self.mount_sigma_rad,
            place_time_s=self.place_time_s,
            attitude_time_s=self.attitude_time_s,
        )

    def new_belief(self) -> AreaBelief:
        """A uniform belief over the area."""
        if self.belief is BeliefKind.PARTICLES:
            walks = self.walk_m_sqrt_s > 0.0
            return SearchParticles(
                self.layout,
                self.sight_model,
                motion=Motion(
                    kind=MotionKind.RANDOM_WALK if walks else MotionKind.STATIC,
                    walk_m_sqrt_s=self.walk_m_sqrt_s,
                ),
                count=self.particles,
                resample_share=self.resample_share,
                seed=RandomStreams(self.seed).child("vision_search"),
            )
        return SearchGrid(
            self.layout,
            self.sight_model,
            scale=Scale.LOG if self.log_scale else Scale.LINEAR,
            dtype=np.float32 if self.single_precision else np.float64,
            walk_m_sqrt_s=self.walk_m_sqrt_s,
        )
