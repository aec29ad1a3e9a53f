"""The belief about the relative pose of two aircraft: its role, its inputs, and its modes.

Frames (Tolman et al. 2021, figure 1): the level frame of an aircraft has its origin at the aircraft, axes
forward, right and down, and is its body frame without roll and pitch. The pose is that of the tracking
aircraft in the level frame of the handoff aircraft: the position (forward, right, down), equation 20, and the
relative heading psi_h - psi_r, which takes vectors of the tracker's level frame to the handoff aircraft's.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.relative_pose.parameters import RelativePoseParameters
from flightsim.foundation.kernels import kernel
from flightsim.foundation.vectors import wrap_pi

Array = NDArray[np.float64]

FORWARD: Final = 0
RIGHT: Final = 1
DOWN: Final = 2
HEADING: Final = 3
STATES: Final = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelMotion:
    """Motion of one aircraft in its own level frame.

    Attributes:
        forward_m_s, right_m_s, down_m_s: velocity; both aircraft against the same air, or both against the
            ground (a common wind cancels).
        yaw_rate_rad_s: rate of the level frame about the vertical, e_3' R omega.
    """

    forward_m_s: float
    right_m_s: float = 0.0
    down_m_s: float = 0.0
    yaw_rate_rad_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseMeasurement:
    """What is measured at one time (the paper's y); NaN: not measured.

    Attributes:
        range_m: slant range.
        down_m: the tracker's depth below the handoff aircraft, from two pressures.
        heading_rad: psi_h - psi_r, from two magnetometers.
    """

    range_m: float = math.nan
    down_m: float = math.nan
    heading_rad: float = math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseMode:
    """One Gaussian of the belief.

    Attributes:
        weight: its probability.
        forward_m, right_m, down_m, heading_rad: mean.
        covariance: (4, 4) of forward, right, down and heading.
    """

    weight: float
    forward_m: float
    right_m: float
    down_m: float
    heading_rad: float
    covariance: Array

    @property
    def horizontal_range_m(self) -> float:
        """rho."""
        return math.hypot(self.forward_m, self.right_m)

    @property
    def bearing_rad(self) -> float:
        """Relative bearing of the tracker from the nose of the handoff aircraft, clockwise."""
        return math.atan2(self.right_m, self.forward_m)

    @property
    def horizontal_sigma_m(self) -> float:
        """Root of the sum of both horizontal variances."""
        return math.sqrt(float(self.covariance[0, 0] + self.covariance[1, 1]))

    def from_tracker(self, forward_m: float, right_m: float) -> tuple[float, float]:
        """A horizontal place of the tracker's level frame, in the handoff aircraft's (equation 33)."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return (self.forward_m + c * forward_m + s * right_m, self.right_m - s * forward_m + c * right_m)

    def place_covariance(self, forward_m: float, right_m: float) -> Array:
        """(2, 2) covariance of `from_tracker`, to first order."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        jacobian = np.array(
            [[1.0, 0.0, 0.0, -s * forward_m + c * right_m], [0.0, 1.0, 0.0, -c * forward_m - s * right_m]]
        )
        found: Array = jacobian @ self.covariance @ jacobian.T
        return found


class RelativePoseBelief(ABC):
    """A belief that is moved by both aircraft's motion and updated by range, height and heading.

    It starts with the first complete measurement, with any bearing. It starts anew when its predictions of
    the range have been inconsistent with the measurements for some time (`reset_nis`).

    Args:
        parameters: noise, numbers and limits.

    Attributes:
        known: whether it has started.
        resets: number of times that it was inconsistent and started anew.
    """

    def __init__(self, parameters: RelativePoseParameters | None = None) -> None:
        self.parameters = parameters or RelativePoseParameters()
        self.known = False
        self.resets = 0
        self._nis = 1.0
        self._since_heading_s = 0.0
        self._modes: tuple[PoseMode, ...] | None = None

    def reset(self) -> None:
        """Discard the pose; the next complete measurement starts it."""
        self.known = False
        self._nis = 1.0
        self._modes = None

    def predict(self, dt_s: float, own: LevelMotion, other: LevelMotion) -> None:
        """Move the pose by a time (equation 26 with the tracker's yaw rate).

        Args:
            dt_s: time step; not above 0: nothing happens.
            own: motion of the handoff aircraft.
            other: motion of the tracking aircraft.
        """
        if self.known and dt_s > 0.0:
            self._modes = None
            self._since_heading_s += dt_s
            self._move(dt_s, own, other)

    def update(self, measured: PoseMeasurement) -> None:
        """Fuse the measurements of one time."""
        self._modes = None
        if not self.known:
            if math.isfinite(measured.range_m + measured.down_m + measured.heading_rad):
                self._start(measured)
                self.known, self._nis = True, 1.0
            return
        nis = self._fuse(measured)
        if math.isfinite(measured.heading_rad):
            self._since_heading_s = 0.0
        if math.isfinite(nis):
            p = self.parameters
            # one outlier must not reset: a single value counts with at most ten times the limit
            self._nis += (min(nis, 10.0 * p.reset_nis) - self._nis) / p.reset_after
            if self._nis > p.reset_nis:
                self.resets += 1
                self.reset()

    @property
    def _first_heading_sigma_rad(self) -> float:
        """Standard deviation of a single relative heading."""
        p = self.parameters
        return math.hypot(p.heading_sigma_rad, p.heading_bias_rad)

    @property
    def _heading_sigma_rad(self) -> float:
        """Standard deviation with which the next relative heading is fused.

        Slow errors are nearly the same in headings that follow one another, so each counts only as far as its
        error is a new one: white noise of the same density, 2 T sigma^2, has the variance 2 T / dt sigma^2.
        """
        p = self.parameters
        repeated = max(1.0, 2.0 * p.heading_bias_s / max(self._since_heading_s, 1e-3))
        return math.hypot(p.heading_sigma_rad, p.heading_bias_rad * math.sqrt(repeated))

    @property
    def consistency(self) -> float:
        """Moving average of the squared innovation of the range over its variance; consistent: about 1."""
        return self._nis

    @property
    def modes(self) -> Sequence[PoseMode]:
        """The modes, the most probable first; none before the start. Several: the bearing is ambiguous."""
        if self._modes is None:
            self._modes = self._find_modes() if self.known else ()
        return self._modes

    @property
    def best(self) -> PoseMode | None:
        """The most probable mode."""
        return self.modes[0] if self.known else None

    @property
    def converged(self) -> bool:
        """Whether one mode holds nearly all probability, and its place is narrow enough."""
        best, p = self.best, self.parameters
        return (
            best is not None
            and best.weight >= p.converged_weight
            and best.horizontal_sigma_m <= p.converged_sigma_m
        )

    @abstractmethod
    def _start(self, measured: PoseMeasurement) -> None:
        """Start with a complete measurement and any bearing."""

    @abstractmethod
    def _move(self, dt_s: float, own: LevelMotion, other: LevelMotion) -> None:
        """Move the pose by a time."""

    @abstractmethod
    def _fuse(self, measured: PoseMeasurement) -> float:
        """Fuse measurements; returns the squared innovation of the range over its predicted variance, NaN
        without a range.
        """

    @abstractmethod
    def _find_modes(self) -> tuple[PoseMode, ...]:
        """The modes, the most probable first."""


def joined_modes(
    weights: Array, means: Array, covariances: Array, *, apart_sigmas: float, least_weight: float
) -> tuple[PoseMode, ...]:
    """Gaussians joined to modes: groups whose horizontal means are far apart against their spread.

    Args:
        weights: (n,), sum one.
        means: (n, 4) of forward, right, down and heading.
        covariances: (n, 4, 4).
        apart_sigmas: two Gaussians are joined within this distance (`close`).
        least_weight: lighter modes are left out; the remaining weights add up to one.
    """
    heaviest = np.argsort(-weights, kind="stable")
    weights, means, covariances = weights[heaviest], means[heaviest], covariances[heaviest]
    count = _join(weights, means, covariances, apart_sigmas)
    chosen = np.flatnonzero(weights[:count] >= least_weight)
    if not len(chosen):
        chosen = np.arange(min(1, count))
    total = sum(weights[chosen].tolist())
    return tuple(
        PoseMode(
            weight=float(weights[k]) / total,
            forward_m=float(means[k, FORWARD]),
            right_m=float(means[k, RIGHT]),
            down_m=float(means[k, DOWN]),
            heading_rad=wrap_pi(float(means[k, HEADING])),
            covariance=covariances[k].copy(),
        )
        for k in chosen[np.argsort(-weights[chosen], kind="stable")]
    )


@kernel
def _join(weights: Array, means: Array, covariances: Array, apart_sigmas: float) -> int:
    """Join Gaussians that are close to each other, until none are; returns the number that is left, which
    are moved to the front.
    """
    count, i = weights.size, 0
    while i < count:
        for j in range(i + 1, count):
            if close(means, covariances, i, j, apart_sigmas):
                merge(weights, means, covariances, i, j)
                for k in range(j, count - 1):
                    weights[k] = weights[k + 1]
                    means[k] = means[k + 1]
                    covariances[k] = covariances[k + 1]
                count -= 1
                i = -1  # the sum is wider, and may be close to any other
                break
        i += 1
    return count


@kernel
def close(means: Array, covariances: Array, a: int, b: int, apart_sigmas: float) -> bool:
    """Whether the horizontal distance of two Gaussians is at most this many standard deviations of both along
    the line between them.

    Args:
        means, covariances: (n, 4), (n, 4, 4) of all.
        a, b: the two.
        apart_sigmas: number of standard deviations.
    """
    x, y = means[b, FORWARD] - means[a, FORWARD], means[b, RIGHT] - means[a, RIGHT]
    distance = math.sqrt(x * x + y * y)
    if distance > 0.0:
        x, y = x / distance, y / distance
    sigmas = 0.0
    for k in (a, b):
        p = covariances[k]
        sigmas += math.sqrt(max(0.0, p[0, 0] * x * x + 2.0 * p[0, 1] * x * y + p[1, 1] * y * y))
    return distance <= apart_sigmas * sigmas


@kernel
def merge(weights: Array, means: Array, covariances: Array, a: int, b: int) -> None:
    """Give the first of two Gaussians the weight, the mean and the covariance of both together.

    Args:
        weights, means, covariances: (n,), (n, 4), (n, 4, 4) of all.
        a, b: the two.
    """
    weight = weights[a] + weights[b]
    share = weights[b] / weight if weight > 0.0 else 0.0
    off = means[b] - means[a]
    off[HEADING] -= math.tau * round(off[HEADING] / math.tau)
    for i in range(STATES):
        for j in range(STATES):
            covariances[a, i, j] = (
                (1.0 - share) * covariances[a, i, j]
                + share * covariances[b, i, j]
                + share * (1.0 - share) * off[i] * off[j]
            )
        means[a, i] += share * off[i]
    weights[a] = weight
