"""The relative pose as particles (Tolman et al. 2021, section III)."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.relative_pose import particles as kernels
from estimators.relative_pose.belief import (
    STATES,
    LevelMotion,
    PoseMeasurement,
    PoseMode,
    RelativePoseBelief,
    joined_modes,
)
from estimators.relative_pose.parameters import RelativePoseParameters
from estimators.tracking.resampling import effective_count, systematic
from flightsim.foundation.random_streams import RandomStreams

Array = NDArray[np.float64]

_NARROW: Final = 0.5  # of the standard deviation of a converged pose


class ParticlePose(RelativePoseBelief):
    """Particles with low-variance, selective resampling.

    Args:
        parameters: noise, numbers and limits.

    Attributes:
        poses: (POSE, n), layout in `estimators.relative_pose.particles`.
        weights: (n,), sum one.
        resamplings: number of times that the particles were resampled.
    """

    def __init__(self, parameters: RelativePoseParameters | None = None) -> None:
        super().__init__(parameters)
        p = self.parameters
        self.poses: Array = np.zeros((kernels.POSE, 0))
        self.weights: Array = np.zeros(0)
        self.resamplings = 0
        self._random = RandomStreams(p.seed).generator("relative_pose")
        self._make_room(p.start_particles)
        self._measured, self._spreads = np.empty(3), np.empty(3)
        self._sigmas = np.array([p.range_sigma_m, p.height_sigma_m, p.heading_sigma_rad])
        self._walks = np.array([p.walk_m_sqrt_s, p.climb_walk_m_sqrt_s, p.heading_walk_rad_sqrt_s])
        self._groups = (
            np.empty(kernels.BINS),
            np.empty((kernels.BINS, STATES)),
            np.empty((kernels.BINS, STATES, STATES)),
        )

    def _make_room(self, count: int) -> None:
        self._next = np.empty((kernels.POSE, count))
        self._noise = np.empty((kernels.NOISES, count))
        self._fits = np.empty(count)
        self._chosen = np.empty(count, dtype=np.int64)

    def _start(self, measured: PoseMeasurement) -> None:
        n = self.parameters.start_particles
        self._make_room(n)
        self.poses, self.weights = np.empty((kernels.POSE, n)), np.full(n, 1.0 / n)
        noise = self._random.standard_normal((3, n))
        bearing = math.tau * (np.arange(n) + self._random.random(n)) / n
        down = measured.down_m + self._sigmas[1] * noise[1]
        slant = measured.range_m + self._sigmas[0] * noise[0]
        rho = np.sqrt(np.maximum(0.0, slant * slant - down * down))
        heading = measured.heading_rad + self._first_heading_sigma_rad * noise[2]
        self.poses[kernels.FORWARD], self.poses[kernels.RIGHT] = rho * np.cos(bearing), rho * np.sin(bearing)
        self.poses[kernels.DOWN] = down
        self.poses[kernels.COS], self.poses[kernels.SIN] = np.cos(heading), np.sin(heading)

    def _move(self, dt_s: float, own: LevelMotion, other: LevelMotion) -> None:
        self._random.standard_normal(out=self._noise)
        kernels.move(
            self.poses,
            motion_array(own),
            motion_array(other),
            dt_s,
            self._noise,
            math.sqrt(dt_s) * self._walks,
        )

    def _fuse(self, measured: PoseMeasurement) -> float:
        self._measured[:] = measured.range_m, measured.down_m, measured.heading_rad
        self._sigmas[2] = self._heading_sigma_rad
        nis = kernels.weigh(self.poses, self.weights, self._measured, self._sigmas, self._fits)
        p, count = self.parameters, self.weights.size
        if effective_count(self.weights) < p.resample_below * count:
            fewer = count > p.particles and self._narrow()
            self._resample(p.particles if fewer else count, ranged=math.isfinite(nis))
        return nis

    def _narrow(self) -> bool:
        """Whether the smaller number of particles is enough."""
        best, p = self.best, self.parameters
        return self.converged and best is not None and best.horizontal_sigma_m < _NARROW * p.converged_sigma_m

    def _resample(self, count: int, *, ranged: bool) -> None:
        kernels.spreads(self.poses, self.weights, self._spreads)
        if not ranged:  # nothing selects places then, and noise on them would only add up
            self._spreads[0] = 0.0
        if count != self.weights.size:
            self._make_room(count)
        systematic(self.weights, self._random.random(), self._chosen)
        noise = self._random.standard_normal(out=self._noise)
        # noise of the range's spread in all directions: across the circle as much as it may, along it less
        noise *= self.parameters.jitter * self._spreads[[0, 0, 1, 2]][:, None]
        if count != self.weights.size:
            self.weights = np.empty(count)
        before = self.poses
        kernels.copy_chosen(self._chosen, before, self.weights, noise, self._next)
        self.poses = self._next
        self._next = before if before.shape == self.poses.shape else np.empty_like(self.poses)
        self._modes = None
        self.resamplings += 1

    def _find_modes(self) -> tuple[PoseMode, ...]:
        p = self.parameters
        count = kernels.bearing_groups(self.poses, self.weights, *self._groups)
        weights, means, covariances = (values[:count] for values in self._groups)
        return joined_modes(
            weights / weights.sum(),
            means,
            covariances,
            apart_sigmas=p.apart_sigmas,
            least_weight=1.0 - p.converged_weight,
        )


def motion_array(motion: LevelMotion) -> Array:
    """Motion in the layout of the kernels."""
    return np.array([motion.forward_m_s, motion.right_m_s, motion.down_m_s, motion.yaw_rate_rad_s])
