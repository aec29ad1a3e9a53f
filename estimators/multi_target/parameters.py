"""Parameters of the multi-target estimator."""

from dataclasses import dataclass
from enum import StrEnum

from estimators.errors import EstimatorError
from estimators.tracking.grid import GridLayout
from estimators.tracking.intensity import Motion, MotionKind
from estimators.tracking.range_bearing import RangeBearingSensor
from estimators.tracking.smc_phd import SmcPhdParameters
from flightsim.foundation.checks import check_fields, named, require_finite, require_members, require_positive

__all__ = ["Belief", "MultiTargetParameters"]


class Belief(StrEnum):
    """How the intensity of targets is represented."""

    PARTICLES = "particles"
    GAUSSIANS = "gaussians"


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiTargetParameters:
    """Parameters of `MultiTargetEstimator`. Places are metres from the home of the centre vehicle.

    Attributes:
        south_m, west_m, north_m, east_m: edges of the searched area (paper: -30..270 m).
        cell_m: side of a cell of the exploration map.
        gain, forward_scale_m, right_scale_m, reach_m, range_sigma_m, bearing_sigma_rad, clutter_per_scan: the
            sensor, as in `RangeBearingSensor`.
        belief: particles, or Gaussian components.
        birth_per_m2: targets per square metre expected before the search; times the exploration map, it is
            the intensity of targets that were never detected.
        motion, walk_m_sqrt_s, acceleration_m_s2_sqrt_hz, speed_sigma_m_s, survival_per_s: the targets, as in
            `Motion`.
        forget_s: time constant with which the exploration map returns to 1 when targets move.
        particles_per_target, births_per_measurement, max_particles: of the particle filter.
        found_width_m: T_W; a cluster is a found target when it is narrower, ...
        found_mass: T_m; ... and its mass is at least this (paper: 1; see docs/multi_target.md).
        found_distance_m: T_z; a measurement nearer to a found target belongs to it.
        reported_mass: clusters of at least this mass are reported as targets.
        least_height_m: scans from below this height above home are not used: the sensor looks from the air.
        centre_vehicle: system id of the vehicle whose home is the origin; 0: of the first one that scans.
        seed: of the random numbers of the particle filter.
    """

    south_m: float = -30.0
    west_m: float = -30.0
    north_m: float = 270.0
    east_m: float = 270.0
    cell_m: float = 5.0
    gain: float = 0.98
    forward_scale_m: float = 15.0
    right_scale_m: float = 15.0
    reach_m: float = 100.0
    range_sigma_m: float = 0.6
    bearing_sigma_rad: float = 0.035
    clutter_per_scan: float = 0.0
    belief: Belief = Belief.PARTICLES
    birth_per_m2: float = 2e-4
    motion: MotionKind = MotionKind.STATIC
    walk_m_sqrt_s: float = 0.03
    acceleration_m_s2_sqrt_hz: float = 0.1
    speed_sigma_m_s: float = 1.0
    survival_per_s: float = 1.0
    forget_s: float = 120.0
    particles_per_target: int = 500
    births_per_measurement: int = 250
    max_particles: int = 20_000
    found_width_m: float = 0.5
    found_mass: float = 0.9
    found_distance_m: float = 4.0
    reported_mass: float = 0.5
    least_height_m: float = 3.0
    centre_vehicle: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        require_members(self, belief=Belief, motion=MotionKind)
        check_fields(self, require_finite)
        require_positive(
            **named(self, "cell_m", "birth_per_m2", "found_width_m", "found_mass", "found_distance_m"),
            **named(self, "reported_mass", "forget_s"),
        )
        if not 0 <= self.centre_vehicle <= 255:
            raise ValueError(f"centre_vehicle {self.centre_vehicle} is not a system id, 0..255")
        if self.seed < 0:
            raise ValueError(f"seed {self.seed} is not accepted: 0 or more is")
        _ = self.sensor, self.target_motion, self.particles  # these constructors refuse impossible values
        try:
            _ = self.layout
        except EstimatorError as error:
            raise ValueError(str(error)) from error

    @property
    def layout(self) -> GridLayout:
        """Cells of the exploration map."""
        if not (self.north_m > self.south_m and self.east_m > self.west_m):
            raise ValueError(
                f"the area from {self.south_m:g},{self.west_m:g} to {self.north_m:g},{self.east_m:g} is "
                "empty; north_m must be above south_m, and east_m above west_m"
            )
        return GridLayout.over(
            width_m=self.east_m - self.west_m,
            height_m=self.north_m - self.south_m,
            cell_m=self.cell_m,
            centre_ne_m=(0.5 * (self.north_m + self.south_m), 0.5 * (self.east_m + self.west_m)),
        )

    @property
    def sensor(self) -> RangeBearingSensor:
        """What is known about the sensor."""
        return RangeBearingSensor(
            gain=self.gain,
            forward_scale_m=self.forward_scale_m,
            right_scale_m=self.right_scale_m,
            reach_m=self.reach_m,
            range_sigma_m=self.range_sigma_m,
            bearing_sigma_rad=self.bearing_sigma_rad,
            clutter_per_scan=self.clutter_per_scan,
        )

    @property
    def target_motion(self) -> Motion:
        """How targets move."""
        return Motion(
            kind=self.motion,
            walk_m_sqrt_s=self.walk_m_sqrt_s,
            acceleration_m_s2_sqrt_hz=self.acceleration_m_s2_sqrt_hz,
            speed_sigma_m_s=self.speed_sigma_m_s,
            survival_per_s=self.survival_per_s,
        )

    @property
    def particles(self) -> SmcPhdParameters:
        """Parameters of the particle filter; a cluster's radius is four found widths."""
        return SmcPhdParameters(
            particles_per_target=self.particles_per_target,
            births_per_measurement=self.births_per_measurement,
            max_particles=self.max_particles,
            min_particles=min(200, self.max_particles),
            cluster_radius_m=4.0 * self.found_width_m,
        )
