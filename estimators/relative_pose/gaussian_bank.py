"""The relative pose as a sum of Gaussians, each with an unscented range update.

The alternative to the particles: Gaussians with different bearings start around the first range (Alspach and
Sorenson 1972, "Nonlinear Bayesian estimation using Gaussian sum approximations"). Motion, height and heading
are nearly linear in position and heading; the range is not, so its moments come from sigma points (Julier and
Uhlmann 2004, "Unscented filtering and nonlinear estimation", with kappa = 3 - n).
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.relative_pose.belief import (
    STATES,
    LevelMotion,
    PoseMeasurement,
    PoseMode,
    RelativePoseBelief,
    close,
    joined_modes,
    merge,
)
from estimators.relative_pose.parameters import RelativePoseParameters
from estimators.relative_pose.particle_belief import motion_array
from estimators.relative_pose.particles import YAW_RATE, displacements
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

_LEAST_WEIGHT: Final = 1e-6
_OVERLAP: Final = 0.6
"""Tangential standard deviation of a first Gaussian, over the distance between neighbours."""
_SAME: Final = 0.1
"""Gaussians are merged within this distance in standard deviations of both, along the line between them."""


class GaussianBank(RelativePoseBelief):
    """A bank of Gaussians.

    Args:
        parameters: noise, numbers and limits.

    Attributes:
        weights, means, covariances: (n,), (n, 4), (n, 4, 4): forward, right, down and heading.
    """

    def __init__(self, parameters: RelativePoseParameters | None = None) -> None:
        super().__init__(parameters)
        p = self.parameters
        self.weights: Array = np.zeros(0)
        self.means: Array = np.zeros((0, STATES))
        self.covariances: Array = np.zeros((0, STATES, STATES))
        self._measured = np.empty(3)
        self._variances = np.square([p.range_sigma_m, p.height_sigma_m, p.heading_sigma_rad])
        walks = (p.walk_m_sqrt_s, p.walk_m_sqrt_s, p.climb_walk_m_sqrt_s, p.heading_walk_rad_sqrt_s)
        self._walks = np.square(walks)

    def _start(self, measured: PoseMeasurement) -> None:
        n = self.parameters.components
        bearing = math.tau * np.arange(n) / n
        rho = math.sqrt(max(0.0, measured.range_m**2 - measured.down_m**2))
        along = self._variances[0] * (measured.range_m / max(rho, 1.0)) ** 2
        across = max((_OVERLAP * math.tau / n * rho) ** 2, along)
        c, s = np.cos(bearing), np.sin(bearing)
        self.weights = np.full(n, 1.0 / n)
        self.means = np.column_stack(
            (rho * c, rho * s, np.full(n, measured.down_m), np.full(n, measured.heading_rad))
        )
        self.covariances = np.zeros((n, STATES, STATES))
        self.covariances[:, 0, 0] = along * c * c + across * s * s
        self.covariances[:, 1, 1] = along * s * s + across * c * c
        self.covariances[:, 0, 1] = self.covariances[:, 1, 0] = (along - across) * c * s
        self.covariances[:, 2, 2] = self._variances[1]
        self.covariances[:, 3, 3] = self._first_heading_sigma_rad**2

    def _move(self, dt_s: float, own: LevelMotion, other: LevelMotion) -> None:
        _move(self.means, self.covariances, motion_array(own), motion_array(other), dt_s, self._walks)

    def _fuse(self, measured: PoseMeasurement) -> float:
        self._measured[:] = measured.range_m, measured.down_m, measured.heading_rad
        self._variances[2] = self._heading_sigma_rad**2
        nis = _fuse(self.weights, self.means, self.covariances, self._measured, self._variances)
        kept = _merge(self.weights, self.means, self.covariances)
        self.weights = self.weights[:kept] / self.weights[:kept].sum()
        self.means, self.covariances = self.means[:kept], self.covariances[:kept]
        return nis

    def _find_modes(self) -> tuple[PoseMode, ...]:
        p = self.parameters
        return joined_modes(
            self.weights,
            self.means,
            self.covariances,
            apart_sigmas=p.apart_sigmas,
            least_weight=1.0 - p.converged_weight,
        )


@kernel
def _move(means: Array, covariances: Array, own: Array, other: Array, dt_s: float, walks: Array) -> None:
    """Move all Gaussians by the motion of `particles.move`, linearized in the heading."""
    own_f, own_r, other_f, other_r, down, turn = displacements(own, other, dt_s)
    yaw = own[YAW_RATE] * dt_s
    yaw_c, yaw_s = math.cos(yaw), math.sin(yaw)
    jacobian = np.zeros((4, 4))
    jacobian[0, 0] = jacobian[1, 1] = yaw_c
    jacobian[0, 1], jacobian[1, 0] = yaw_s, -yaw_s
    jacobian[2, 2] = jacobian[3, 3] = 1.0
    for k in range(means.shape[0]):
        c, s = math.cos(means[k, 3]), math.sin(means[k, 3])
        dx, dy = c * other_f + s * other_r, -s * other_f + c * other_r
        x, y = means[k, 0] + dx - own_f, means[k, 1] + dy - own_r
        means[k, 0], means[k, 1] = yaw_c * x + yaw_s * y, -yaw_s * x + yaw_c * y
        means[k, 2] += down
        means[k, 3] += turn
        # derivative of (dx, dy) by the heading: (dy, -dx)
        jacobian[0, 3], jacobian[1, 3] = yaw_c * dy - yaw_s * dx, -yaw_s * dy - yaw_c * dx
        covariances[k] = jacobian @ covariances[k] @ jacobian.T
        for i in range(4):
            covariances[k, i, i] += walks[i] * dt_s


@kernel
def _linear(mean: Array, covariance: Array, axis: int, off: float, variance: float) -> float:
    """Update by a measurement of one state; returns the logarithm of its likelihood."""
    total = covariance[axis, axis] + variance
    gain = covariance[:, axis] / total
    mean += gain * off
    row = covariance[axis, :].copy()
    for i in range(4):
        for j in range(4):
            covariance[i, j] -= gain[i] * row[j]
    return -0.5 * (off * off / total + math.log(total))


@kernel
def _lower(a: Array, out: Array) -> None:
    """Cholesky factor of a covariance whose rounding errors may have made it slightly indefinite."""
    out[:] = 0.0
    for i in range(4):
        for j in range(i + 1):
            value = a[i, j]
            for k in range(j):
                value -= out[i, k] * out[j, k]
            if i == j:
                out[i, i] = math.sqrt(max(value, 1e-12))
            else:
                out[i, j] = value / out[j, j]


@kernel
def _slant_m(mean: Array, root: Array, column: int, scale: float) -> float:
    x = mean[0] + scale * root[0, column]
    y = mean[1] + scale * root[1, column]
    z = mean[2] + scale * root[2, column]
    return math.sqrt(x * x + y * y + z * z)


@kernel
def _fuse(weights: Array, means: Array, covariances: Array, measured: Array, variances: Array) -> float:
    """Update all Gaussians and their weights; returns the squared innovation of the range of the sum."""
    count = weights.size
    logs, root, cross, gain = np.empty(count), np.empty((4, 4)), np.empty(4), np.empty(4)
    spread = math.sqrt(3.0)  # n + kappa = 3
    mixed, square, inner = 0.0, 0.0, 0.0
    for k in range(count):
        mean, covariance = means[k], covariances[k]
        log = 0.0
        if not math.isnan(measured[1]):
            log += _linear(mean, covariance, 2, measured[1] - mean[2], variances[1])
        if not math.isnan(measured[2]):
            off = measured[2] - mean[3]
            off -= math.tau * round(off / math.tau)
            log += _linear(mean, covariance, 3, off, variances[2])
        if not math.isnan(measured[0]):
            _lower(covariance, root)
            centre = _slant_m(mean, root, 0, 0.0)
            predicted = -1.0 / 3.0 * centre  # weight kappa / (n + kappa) of the central point
            second = -1.0 / 3.0 * centre * centre
            cross[:] = 0.0
            for c in range(4):
                plus, minus = _slant_m(mean, root, c, spread), _slant_m(mean, root, c, -spread)
                predicted += (plus + minus) / 6.0
                second += (plus * plus + minus * minus) / 6.0
                for i in range(4):
                    cross[i] += root[i, c] * spread * (plus - minus) / 6.0
            # the negative central weight may make the spread too small: never below the linear one
            linear = 0.0
            for c in range(4):
                along = (mean[0] * root[0, c] + mean[1] * root[1, c] + mean[2] * root[2, c]) / max(
                    centre, 1e-9
                )
                linear += along * along
            own = max(second - predicted * predicted, linear)
            total = own + variances[0]
            off = measured[0] - predicted
            for i in range(4):
                gain[i] = cross[i] / total
            for i in range(4):
                mean[i] += gain[i] * off
                for j in range(4):
                    covariance[i, j] -= gain[i] * gain[j] * total
            log += -0.5 * (off * off / total + math.log(total))
            mixed += weights[k] * off
            square += weights[k] * off * off
            inner += weights[k] * total
        logs[k] = log
    best = logs.max()
    total = 0.0
    for k in range(count):
        weights[k] *= math.exp(logs[k] - best)
        total += weights[k]
    for k in range(count):
        weights[k] = weights[k] / total if total > 0.0 else math.exp(logs[k] - best)
    if math.isnan(measured[0]):
        return math.nan
    return mixed * mixed / (square - mixed * mixed + inner)


@kernel
def _merge(weights: Array, means: Array, covariances: Array) -> int:
    """Drop Gaussians without weight, merge those at the same place; returns the number that is left, which
    are moved to the front.
    """
    count = 0
    for k in range(weights.size):
        if weights[k] < _LEAST_WEIGHT:
            continue
        merged = False
        for m in range(count):
            if close(means, covariances, m, k, _SAME):
                merge(weights, means, covariances, m, k)
                merged = True
                break
        if not merged:
            if count != k:
                weights[count] = weights[k]
                means[count] = means[k]
                covariances[count] = covariances[k]
            count += 1
    return count
