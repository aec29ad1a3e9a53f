"""The paper's filter: the pose of the vehicle in the frame of one target, and the confidence that it is one.

Source: Lum, Rysdyk and Pongpunwattana 2005, section III. The target has a Gaussian signature without spread,
and the noise of measurements is white.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification import particles as p
from estimators.magnetic_identification.classes import GaussianClass
from estimators.tracking.resampling import effective_count, roulette, systematic

__all__ = ["ConfidenceFilter", "Control"]

Array = NDArray[np.float64]

_FARTHEST: Final = 3.5  # standard deviations at which an anomaly can begin
_RESAMPLED_BELOW: Final = 0.5  # of the particles: effective number
_SPREAD_EVERY: Final = 4  # one particle of so many starts anywhere in that ellipse


@dataclass(frozen=True, slots=True, kw_only=True)
class Control:
    """The motion between two measurements.

    Attributes:
        forward_m, right_m: displacement along and across the course at the earlier measurement.
        turn_rad: change of the course.
        forward_sigma_m, turn_sigma_rad: standard deviations of displacement and turn.
    """

    forward_m: float
    right_m: float
    turn_rad: float
    forward_sigma_m: float
    turn_sigma_rad: float


class ConfidenceFilter:
    """A particle filter.

    Attributes:
        particles: (width, n), see `particles`.
        weights: (n,), sum one.

    Args:
        of: the target.
        count: number of particles.
        rng: random numbers of the filter.
        by_roulette: resample by the paper's roulette wheel.
    """

    def __init__(
        self, of: GaussianClass, count: int, rng: np.random.Generator, *, by_roulette: bool = False
    ) -> None:
        self._class = of
        self._signature = (of.amplitude_nt, 1.0 / of.sigma_along_m, 1.0 / of.sigma_across_m)
        self._rng = rng
        self._by_roulette = by_roulette
        self.particles: Array = np.zeros((p.POSE, count))
        self.weights: Array = np.full(count, 1.0 / count)
        self._noise = np.empty((2, (count + 3) // 4))
        self._fits = np.empty(count)
        self._other = np.empty((p.POSE, count))
        self._chosen = np.empty(count, dtype=np.int64)

    def start(self, residual_nt: float, variance_nt2: float) -> None:
        """Put the particles on the level curves of the first measurement (section III-C).

        Before the measurement every place is as probable within the ellipse of 3.5 standard deviations. The
        level of a particle is drawn around the measurement, some are drawn from the whole ellipse, and the
        weight is the ratio of both densities (importance sampling).
        """
        of, rng, count = self._class, self._rng, self.weights.size
        amplitude_nt, level_nt = abs(of.amplitude_nt), math.copysign(1.0, of.amplitude_nt) * residual_nt
        sigma_nt = math.sqrt(variance_nt2)
        lowest_nt = amplitude_nt * math.exp(-0.5 * _FARTHEST**2)
        # the square of the distance in standard deviations is uniform over the area of an ellipse
        square = _FARTHEST**2 * rng.random(count)
        drawn_nt = level_nt + sigma_nt * rng.standard_normal(count)
        on_level = (np.arange(count) % _SPREAD_EVERY > 0) & (drawn_nt > lowest_nt) & (drawn_nt < amplitude_nt)
        square[on_level] = -2.0 * np.log(drawn_nt[on_level] / amplitude_nt)
        there_nt = amplitude_nt * np.exp(-0.5 * square)
        density = np.exp(-0.5 * ((there_nt - level_nt) / sigma_nt) ** 2) / (sigma_nt * math.sqrt(math.tau))
        share = float(np.mean(on_level))
        within = _normal_share((lowest_nt - level_nt) / sigma_nt, (amplitude_nt - level_nt) / sigma_nt)
        ratio = share * 0.5 * _FARTHEST**2 * density * there_nt / max(within, 1e-12) + 1.0 - share
        self.weights[:] = 1.0 / (count * ratio)
        angle, axis = rng.uniform(-math.pi, math.pi, (2, count))
        self.particles[p.X] = np.sqrt(square) * np.cos(angle) * of.sigma_along_m
        self.particles[p.Y] = np.sqrt(square) * np.sin(angle) * of.sigma_across_m
        self.particles[p.COS], self.particles[p.SIN] = np.cos(axis), np.sin(axis)
        p.weigh(self.particles, self.weights, self._signature, residual_nt, variance_nt2, self._fits)

    def step(self, control: Control, residual_nt: float, variance_nt2: float) -> float:
        """One more measurement.

        Returns:
            The paper's confidence C_t (7), per particle and over its greatest value.
        """
        if effective_count(self.weights) < _RESAMPLED_BELOW * self.weights.size:
            self._resample()
        self._rng.standard_normal(out=self._noise)
        p.move(
            self.particles,
            control.forward_m,
            control.right_m,
            control.turn_rad,
            self._noise,
            control.forward_sigma_m,
            control.turn_sigma_rad,
        )
        return p.weigh(self.particles, self.weights, self._signature, residual_nt, variance_nt2, self._fits)

    def _resample(self) -> None:
        if self._by_roulette:
            roulette(self.weights, np.sort(self._rng.random(self.weights.size)), self._chosen)
        else:
            systematic(self.weights, float(self._rng.random()), self._chosen)
        p.copy_chosen(self._chosen, self.particles, self._other)
        self.particles, self._other = self._other, self.particles
        self.weights[:] = 1.0 / self.weights.size

    def sources(self) -> Array:
        """(n, 3) forward and right of the vehicle, and axis relative to its course (8)."""
        out = np.empty((self.weights.size, 3))
        p.relative_sources(self.particles, out)
        return out


def _normal_share(low: float, high: float) -> float:
    """Probability of a standard normal number between two bounds."""
    return 0.5 * (math.erf(high / math.sqrt(2.0)) - math.erf(low / math.sqrt(2.0)))
