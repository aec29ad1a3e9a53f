"""The PHD filter by sequential Monte Carlo: particles whose weights sum to the expected number of targets.

Sources: Vo, Singh and Doucet 2005, "Sequential Monte Carlo methods for multitarget filtering with random
finite sets"; births driven by the measurements as in Ristic, Clark, Vo and Vo 2012, "Adaptive target birth
intensity for PHD and CPHD filters": particles born from a scan are weighted by its detections only.
docs/multi_target.md has the equations and the differences from Yousuf, Lendek and Busoniu.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.clusters import find_clusters, inside
from estimators.tracking.intensity import BirthIntensity, Cluster
from estimators.tracking.motion import Motion, MotionKind
from estimators.tracking.range_bearing import (
    BEARING_SIGMA,
    FORWARD,
    GAIN,
    RANGE_SIGMA,
    REACH,
    RIGHT,
    RangeBearingSensor,
    Viewpoint,
)
from estimators.tracking.resampling import systematic
from flightsim.foundation.checks import Positive
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options

__all__ = ["SmcPhd", "SmcPhdParameters", "update_weights"]

Array = NDArray[np.float64]

NORTH: Final = 0
EAST: Final = 1
NORTH_RATE: Final = 2
EAST_RATE: Final = 3
WEIGHT: Final = 4
ROWS: Final = 5

_GATE: Final = 80.0  # squared distance; beyond it a likelihood is below 1e-17 of its peak
_BIRTH_SIGMAS: Final = 3.0  # radius within which particles are born, in standard deviations
_BIRTH_SHARE: Final = 1.0 - math.exp(-0.5 * _BIRTH_SIGMAS**2)


@dataclass(frozen=True, slots=True, kw_only=True)
class SmcPhdParameters(Options):
    """Parameters of the particle filter.

    Attributes:
        particles_per_target: l; after resampling there are l N_hat particles.
        births_per_measurement: particles born from each measurement.
        min_particles, max_particles: bounds of the number after resampling.
        birth_floor_m: least standard deviation of a birth, per axis.
        cluster_radius_m: radius of a cluster.
    """

    particles_per_target: int = 500
    births_per_measurement: int = 250
    min_particles: int = 200
    max_particles: int = 20_000
    birth_floor_m: Positive = 0.2
    cluster_radius_m: Positive = 2.0

    def check_together(self) -> None:
        for name in ("particles_per_target", "births_per_measurement", "min_particles", "max_particles"):
            if not 1 <= getattr(self, name) <= 1_000_000:
                raise ValueError(f"{name} {getattr(self, name)} is not in 1..1000000")
        if self.min_particles > self.max_particles:
            raise ValueError(
                f"min_particles {self.min_particles} is more than max_particles {self.max_particles}"
            )


class SmcPhd:
    """The intensity as particles.

    Args:
        sensor: what is known about the sensor.
        motion: of the targets.
        parameters: of the filter.
        seed: of its random numbers.

    Attributes:
        parameters, sensor, motion: as given.
    """

    def __init__(
        self,
        sensor: RangeBearingSensor,
        motion: Motion | None = None,
        parameters: SmcPhdParameters | None = None,
        *,
        seed: np.random.SeedSequence,
    ) -> None:
        self.sensor = sensor
        self.motion = motion or Motion()
        self.parameters = parameters or SmcPhdParameters()
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._values: Array = sensor.values
        self._particles: Array = np.zeros((ROWS, 0))

    @property
    def particles(self) -> Array:
        """(5, n): north, east, their rates, weight."""
        return self._particles

    @property
    def expected_targets(self) -> float:
        return float(self._particles[WEIGHT].sum())

    def predict(self, dt_s: float) -> None:
        moved, motion = self._particles, self.motion
        count = moved.shape[1]
        if not count or not dt_s > 0.0:
            return
        if motion.survival_per_s < 1.0:
            moved[WEIGHT] *= motion.survival_per_s**dt_s
        if motion.kind is MotionKind.CONSTANT_VELOCITY:
            sigma_m_s = motion.acceleration_m_s2_sqrt_hz * math.sqrt(dt_s)
            change = sigma_m_s * self._rng.standard_normal((2, count))
            moved[NORTH : EAST + 1] += dt_s * (moved[NORTH_RATE : EAST_RATE + 1] + 0.5 * change)
            moved[NORTH_RATE : EAST_RATE + 1] += change
        if motion.walk_m_sqrt_s > 0.0:
            sigma_m = motion.walk_m_sqrt_s * math.sqrt(dt_s)
            moved[NORTH : EAST + 1] += sigma_m * self._rng.standard_normal((2, count))

    def update(self, scan: Array, viewpoint: Viewpoint, birth: BirthIntensity) -> None:
        scan = np.ascontiguousarray(scan, dtype=np.float64).reshape(-1, 2)
        old = self._particles.shape[1]
        if len(scan):
            self._particles = np.hstack((self._particles, self._born(scan, viewpoint, birth)))
        particles = self._particles
        if not particles.shape[1]:
            return
        update_weights(
            particles[NORTH],
            particles[EAST],
            particles[WEIGHT],
            old,
            self._values,
            viewpoint.values,
            scan,
            self.sensor.clutter_density(scan[:, 0]),
        )
        self._resize(always=len(scan) > 0)

    def _born(self, scan: Array, viewpoint: Viewpoint, birth: BirthIntensity) -> Array:
        """Particles around each measurement, drawn from a Gaussian in range and bearing that ends at three
        standard deviations; their weights are the birth intensity over the density they are drawn from.
        """
        p, sensor = self.parameters, self.sensor
        count = p.births_per_measurement
        uniform = self._rng.random((2, len(scan), count))
        radius = np.sqrt(-2.0 * np.log1p(-_BIRTH_SHARE * uniform[0]))
        turn = math.tau * uniform[1]
        range_m = scan[:, :1]
        range_sigma = math.hypot(sensor.range_sigma_m, p.birth_floor_m)
        bearing_sigma = np.hypot(sensor.bearing_sigma_rad, p.birth_floor_m / np.maximum(range_m, 1.0))
        ranges = np.abs(range_m + range_sigma * radius * np.cos(turn)).ravel()
        bearings = scan[:, 1:] + viewpoint.heading_rad + bearing_sigma * radius * np.sin(turn)
        density = np.exp(-0.5 * radius**2) / (math.tau * range_sigma * bearing_sigma * _BIRTH_SHARE)
        born = np.zeros((ROWS, ranges.size))
        born[NORTH] = viewpoint.north_m + ranges * np.cos(bearings.ravel())
        born[EAST] = viewpoint.east_m + ranges * np.sin(bearings.ravel())
        if self.motion.kind is MotionKind.CONSTANT_VELOCITY:
            born[NORTH_RATE : EAST_RATE + 1] = self.motion.speed_sigma_m_s * self._rng.standard_normal(
                (2, ranges.size)
            )
        # an area of range * d range * d bearing belongs to a density in range and bearing
        born[WEIGHT] = birth(born[NORTH], born[EAST]) * ranges / (count * density.ravel())
        return born

    def _resize(self, *, always: bool) -> None:
        """Resample to l N_hat particles; without new particles only when few of them carry the weight."""
        p, weights = self.parameters, self._particles[WEIGHT]
        total = float(weights.sum())
        if not total > 1e-6:
            self._particles = np.zeros((ROWS, 0))
            return
        if not always and total * total >= 0.5 * len(weights) * float(weights @ weights):
            return
        size = min(p.max_particles, max(p.min_particles, math.ceil(p.particles_per_target * total)))
        chosen = np.empty(size, dtype=np.int64)
        systematic(weights / total, float(self._rng.random()), chosen)
        self._particles = np.ascontiguousarray(self._particles[:, chosen])
        self._particles[WEIGHT] = total / size

    def clusters(self) -> Sequence[Cluster]:
        particles = self._particles
        return find_clusters(
            particles[NORTH], particles[EAST], particles[WEIGHT], radius_m=self.parameters.cluster_radius_m
        )

    def remove(self, cluster: Cluster) -> None:
        particles = self._particles
        own = inside(particles[NORTH], particles[EAST], cluster, self.parameters.cluster_radius_m)
        mass = float(particles[WEIGHT, own].sum())
        if mass > 1.0:
            particles[WEIGHT, own] *= 1.0 - 1.0 / mass
        else:
            self._particles = np.ascontiguousarray(particles[:, ~own])

    def points(self) -> tuple[Array, Array, Array]:
        return self._particles[NORTH], self._particles[EAST], self._particles[WEIGHT]


@kernel
def update_weights(
    north_m: Array,
    east_m: Array,
    weight: Array,
    old: int,
    sensor: Array,
    viewpoint: Array,
    scan: Array,
    clutter: Array,
) -> None:
    """The PHD update of the particles' weights, in place (Vo, Singh and Doucet 2005, equation 20).

    w <- [1 - p_D + sum_z p_D g(z|x) / C(z)] w, C(z) = clutter(z) + sum p_D g w. Particles from index `old` on
    are born from this scan and have no part 1 - p_D. Likelihoods beyond a squared distance of 80 count as 0.

    Args:
        north_m, east_m, weight: (n,) of each particle.
        old: number of particles that were there before the scan.
        sensor: `RangeBearingSensor.values`.
        viewpoint: `Viewpoint.values`.
        scan: (m, 2) range and bearing.
        clutter: (m,) density of false detections at each measurement.
    """
    count, m = weight.size, scan.shape[0]
    gain, inverse_f, inverse_r = sensor[GAIN], 1.0 / sensor[FORWARD], 1.0 / sensor[RIGHT]
    reach_squared = sensor[REACH] * sensor[REACH]
    inverse_range, inverse_bearing = 1.0 / sensor[RANGE_SIGMA], 1.0 / sensor[BEARING_SIGMA]
    peak = inverse_range * inverse_bearing / math.tau
    cosine, sine = math.cos(viewpoint[2]), math.sin(viewpoint[2])
    widest = math.sqrt(_GATE) * sensor[BEARING_SIGMA]
    narrow = widest < 1.5
    tangent = math.tan(widest) if narrow else 0.0
    along_f, along_r = np.empty(m), np.empty(m)
    for j in range(m):
        along_f[j], along_r[j] = math.cos(scan[j, 1]), math.sin(scan[j, 1])
    explained = np.zeros(m)  # C(z)
    hits = 0
    hit_particle = np.empty(max(64, 2 * count), dtype=np.int64)
    hit_scan = np.empty(max(64, 2 * count), dtype=np.int64)
    hit_value = np.empty(max(64, 2 * count))
    for i in range(count):
        n, e, w = north_m[i] - viewpoint[0], east_m[i] - viewpoint[1], weight[i]
        squared = n * n + e * e
        if squared > reach_squared:
            if i >= old:
                weight[i] = 0.0
            continue
        forward, right = cosine * n + sine * e, cosine * e - sine * n
        scaled_f, scaled_r = forward * inverse_f, right * inverse_r
        detected = gain * math.exp(-0.5 * math.sqrt(scaled_f * scaled_f + scaled_r * scaled_r))
        weight[i] = 0.0 if i >= old else (1.0 - detected) * w
        if m == 0:
            continue
        range_m = math.sqrt(squared)
        scale = detected * peak * w
        for j in range(m):
            off_range = (range_m - scan[j, 0]) * inverse_range
            distance = off_range * off_range
            if distance > _GATE:
                continue
            across = right * along_f[j] - forward * along_r[j]
            ahead = forward * along_f[j] + right * along_r[j]
            if narrow and abs(across) > tangent * ahead:
                continue
            bearing = math.atan(across / ahead) if narrow else math.atan2(across, ahead)
            off_bearing = bearing * inverse_bearing
            distance += off_bearing * off_bearing
            if distance > _GATE:
                continue
            value = scale * math.exp(-0.5 * distance)
            if hits == hit_value.size:
                hit_particle = np.concatenate((hit_particle, np.empty_like(hit_particle)))
                hit_scan = np.concatenate((hit_scan, np.empty_like(hit_scan)))
                hit_value = np.concatenate((hit_value, np.empty_like(hit_value)))
            hit_particle[hits], hit_scan[hits], hit_value[hits] = i, j, value
            hits += 1
            explained[j] += value
    for j in range(m):
        explained[j] = 1.0 / (explained[j] + clutter[j])
    for hit in range(hits):
        weight[hit_particle[hit]] += hit_value[hit] * explained[hit_scan[hit]]
