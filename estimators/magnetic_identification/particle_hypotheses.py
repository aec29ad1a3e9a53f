"""The hypotheses with a signature: a particle filter for each, with its evidence. They are the classes, and
`BodyHypothesis`, a body of any extent and strength.

The evidence is the product of the means of the particles' likelihoods. The paper's confidence (7) is the same
mean without memory, each weight over its greatest possible value.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification import particles as p
from estimators.magnetic_identification.classes import DipoleClass, GaussianClass
from estimators.magnetic_identification.hypotheses import Before, Control, Measurement, Update, log_beyond
from estimators.tracking.resampling import effective_count, roulette, systematic

__all__ = ["BodyHypothesis", "DipoleHypothesis", "GaussianHypothesis", "ParticleHypothesis"]

Array = NDArray[np.float64]

_FARTHEST: Final = 3.5  # standard deviations at which an anomaly of a Gaussian class can begin
_RESAMPLED_BELOW: Final = 0.5  # of the particles: effective number
_LEAST_INSIDE: Final = 0.01  # share of that ellipse beyond the threshold, for a class that hardly exceeds it
_DRAWS: Final = 4096  # simulated passes for the probability of a beginning
_LEAST_BEGINNINGS: Final = 1e-4  # share of those that begin an anomaly, for a class that hardly does
_SPREAD_EVERY: Final = 4  # one particle of so many starts anywhere in that ellipse
_ATYPICAL_EVERY: Final = 6  # one particle of so many is of a member of the class with an unusual amplitude
_ATYPICAL_SPREAD: Final = 0.5  # relative standard deviation of that amplitude
_BODY_M: Final = (20.0, 500.0)  # standard deviations of a body of any kind, along and across its axis
_BODY_NT: Final = (8.0, 80.0)  # standard deviation of its amplitude
_KINDS: Final = 5  # one body of so many is any; two are long, and two resemble a class
_LONG_KINDS: Final = 2
_LIKE_SIZE: Final = 0.35  # standard deviation of the logarithm of their extents over those of the class
_LIKE_AMPLITUDE: Final = 0.6  # relative standard deviation of their amplitude
_LOG_LONG: Final = (math.log(2.0), math.log(10.0))  # of length over width of a long body
_BODY_FARTHEST: Final = 3.0
_TURNED: Final = (
    0.8  # share of the particles that would leave a body, and enter it at the opposite side instead
)
_JITTER: Final = 0.02  # relative change of the extents of a class when its particles are resampled
_BODY_JITTER: Final = 0.005  # likewise of a body's


class ParticleHypothesis(ABC):
    """What the filters of both forms share: motion and resampling.

    Attributes:
        particles: (width, n), see `particles`.
        weights: (n,), sum one.
    """

    def __init__(
        self, width: int, count: int, rng: np.random.Generator, *, first: int = 1, by_roulette: bool
    ) -> None:
        """Make room for the particles.

        Args:
            width: numbers of a particle.
            count: number of particles.
            rng: random numbers of the filter.
            first: so many times more particles begin, until the first resampling: where they begin decides
                how well the few that fit are sampled.
            by_roulette: resample by the paper's roulette wheel.
        """
        self._count = count
        self._rng = rng
        self._by_roulette = by_roulette
        self.particles: Array = np.zeros((width, first * count))
        self._allocate(first * count)

    def _allocate(self, count: int) -> None:
        """Weights and working arrays for so many particles."""
        self.weights: Array = np.full(count, 1.0 / count)
        self._noise = np.empty((2, (count + 3) // 4))
        self._fits = np.empty((3, count))
        self._other = np.empty((len(self.particles), self._count))
        self._chosen = np.empty(self._count, dtype=np.int64)

    @abstractmethod
    def _weigh(self, seen: Measurement, decay: float, drive_nt2: float) -> Update:
        """Take a measurement; sets the weights."""

    def _weigh_beginning(self, seen: Measurement, before: Before) -> float:
        """Weigh by the last measurement within the threshold and by the first one beyond it, where the
        particles are now; logarithm of the density of both.
        """
        control, still = before.control, np.zeros_like(self._noise)
        p.move(self.particles, -control.forward_m, -control.right_m, 0.0, still, 0.0, 0.0)
        density = self._weigh(before.seen, 1.0, 0.0).log_density
        p.move(self.particles, control.forward_m, control.right_m, 0.0, still, 0.0, 0.0)
        return density + self._weigh(seen, control.decay, control.drive_nt2).log_density

    def _log_beginnings(
        self, signals: tuple[Array, Array], map_nt2: float, threshold_nt: float, before: Before
    ) -> float:
        """Logarithm of the share of simulated places at which an anomaly begins.

        Args:
            signals: (n,) each: signals at the place of the measurement before, and here.
            map_nt2, threshold_nt, before: as of `start`.
        """
        errors = self._rng.standard_normal((4, signals[0].size))
        map_then = math.sqrt(map_nt2) * errors[0]
        map_now = before.control.decay * map_then + math.sqrt(before.control.drive_nt2) * errors[1]
        white_nt = math.sqrt(before.seen.white_nt2)
        then_nt = signals[0] + map_then + white_nt * errors[2]
        now_nt = signals[1] + map_now + white_nt * errors[3]
        begins = (np.abs(then_nt) <= threshold_nt) & (np.abs(now_nt) > threshold_nt)
        return math.log(max(float(np.mean(begins)), _LEAST_BEGINNINGS))

    def step(self, control: Control, seen: Measurement) -> Update:
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
        return self._weigh(seen, control.decay, control.drive_nt2)

    def _resample(self) -> None:
        if self._by_roulette:
            marks = np.sort(self._rng.random(self._count))
            roulette(self.weights, marks, self._chosen)
        else:
            systematic(self.weights, float(self._rng.random()), self._chosen)
        p.copy_chosen(self._chosen, self.particles, self._other)
        self.particles, self._other = self._other, self.particles
        if self.particles.shape != self._other.shape:
            self._allocate(self._count)
        self.weights[:] = 1.0 / self._count

    def predicted_nt(self, forward_m: Array, right_m: Array, height_m: float, count: int) -> Array:
        """Anomaly at places in the frame of the vehicle, (count, places), for as many equally probable
        particles.
        """
        chosen = np.empty(count, dtype=np.int64)
        systematic(self.weights, 0.5, chosen)
        columns = self.particles[:, chosen]
        cosine, sine = columns[p.COS, :, None], columns[p.SIN, :, None]
        x = columns[p.X, :, None] + cosine * forward_m - sine * right_m
        y = columns[p.Y, :, None] + sine * forward_m + cosine * right_m
        return self._signals(columns, x, y, height_m)

    @abstractmethod
    def _signals(self, columns: Array, x: Array, y: Array, height_m: float) -> Array:
        """Signals, nT, that particles predict at places of their target's frame.

        Args:
            columns: (width, n) particles.
            x, y: (n, places).
        """

    def mean_place_m(self) -> tuple[float, float]:
        """Mean place of the source, forward and right of the vehicle."""
        x, y, cosine, sine = (self.particles[k] for k in (p.X, p.Y, p.COS, p.SIN))
        return float(self.weights @ (-cosine * x - sine * y)), float(self.weights @ (sine * x - cosine * y))

    def sources(self) -> Array:
        """(n, 3) forward and right of the vehicle, and axis relative to its course (8)."""
        out = np.empty((self.weights.size, 3))
        p.relative_sources(self.particles, out)
        return out


class _GaussianParticles(ParticleHypothesis):
    """Particles with a Gaussian signature.

    Args:
        amplitude_nt: what their amplitudes are relative to.
    """

    def __init__(
        self,
        amplitude_nt: float,
        count: int,
        rng: np.random.Generator,
        *,
        first: int = 1,
        by_roulette: bool = False,
    ) -> None:
        super().__init__(p.GAUSSIAN, count, rng, first=first, by_roulette=by_roulette)
        self._amplitude_nt = amplitude_nt

    @abstractmethod
    def _drawn(self, count: int) -> tuple[Array, Array, Array]:
        """Extents along and across, and amplitudes, nT, of sources as they are expected; (count,) each."""

    def _simulated(self, control: Control, farthest: float) -> tuple[Array, Array]:
        """Signals before a step and after it, for steps that end anywhere in the ellipse of so many standard
        deviations.
        """
        rng = self._rng
        along_m, across_m, amplitude_nt = self._drawn(_DRAWS)
        distance, angle = farthest * np.sqrt(rng.random(_DRAWS)), rng.uniform(-math.pi, math.pi, _DRAWS)
        x, y = distance * np.cos(angle) * along_m, distance * np.sin(angle) * across_m
        course, step_m = (
            rng.uniform(-math.pi, math.pi, _DRAWS),
            math.hypot(control.forward_m, control.right_m),
        )
        then_x, then_y = x - step_m * np.cos(course), y - step_m * np.sin(course)
        then_nt, now_nt = (
            amplitude_nt * np.exp(-0.5 * ((a / along_m) ** 2 + (b / across_m) ** 2))
            for a, b in ((then_x, then_y), (x, y))
        )
        return then_nt, now_nt

    def _signals(self, columns: Array, x: Array, y: Array, height_m: float) -> Array:
        square = (x * columns[p.PER_ALONG, :, None]) ** 2 + (y * columns[p.PER_ACROSS, :, None]) ** 2
        signals: Array = self._amplitude_nt * columns[p.AMPLITUDE, :, None] * np.exp(-0.5 * square)
        return signals

    def _weigh(self, seen: Measurement, decay: float, drive_nt2: float) -> Update:
        density, confidence, misfit = p.weigh_gaussian(
            self.particles,
            self.weights,
            self._amplitude_nt,
            seen.residual_nt,
            seen.white_nt2,
            decay,
            drive_nt2,
            self._fits,
        )
        return Update(log_density=density, confidence=confidence, misfit=misfit)


class GaussianHypothesis(_GaussianParticles):
    """The anomaly is of a class with a Gaussian signature.

    Some members of a class are not as it is stated (a ship that is degaussed, or heads east): the amplitude
    of one particle of six may be any. A class without spread has none of these.
    """

    def __init__(
        self,
        of: GaussianClass,
        count: int,
        rng: np.random.Generator,
        *,
        first: int = 1,
        by_roulette: bool = False,
    ) -> None:
        super().__init__(of.amplitude_nt, count, rng, first=first, by_roulette=by_roulette)
        self._class = of

    def start(
        self, seen: Measurement, map_nt2: float, threshold_nt: float = 0.0, before: Before | None = None
    ) -> float:
        """Put the particles on the level curves of the first measurement (section III-C).

        Before the measurement every place is as probable within the ellipse of 3.5 standard deviations. The
        level of a particle is drawn around the measurement, some are drawn from the whole ellipse, and the
        weight is the ratio of both densities (importance sampling).
        """
        of, rng, count = self._class, self._rng, self.weights.size
        amplitude_nt, level_nt = abs(of.amplitude_nt), math.copysign(1.0, of.amplitude_nt) * seen.residual_nt
        sigma_nt = math.sqrt(seen.white_nt2 + map_nt2 + (of.amplitude_spread * level_nt) ** 2)
        lowest_nt = amplitude_nt * math.exp(-0.5 * _FARTHEST**2)
        # the square of the distance in standard deviations is uniform over the area of an ellipse
        square = _FARTHEST**2 * rng.random(count)
        drawn_nt = level_nt + sigma_nt * rng.standard_normal(count)
        on_level = (np.arange(count) % _SPREAD_EVERY > 0) & (drawn_nt > lowest_nt) & (drawn_nt < amplitude_nt)
        square[on_level] = -2.0 * np.log(drawn_nt[on_level] / amplitude_nt)
        there_nt = amplitude_nt * np.exp(-0.5 * square)
        density = np.exp(-0.5 * ((there_nt - level_nt) / sigma_nt) ** 2) / (sigma_nt * math.sqrt(math.tau))
        share = float(np.mean(on_level))
        ratio = (
            share
            * 0.5
            * _FARTHEST**2
            * density
            * there_nt
            / max(
                _normal_share((lowest_nt - level_nt) / sigma_nt, (amplitude_nt - level_nt) / sigma_nt), 1e-12
            )
            + 1.0
            - share
        )
        self.weights[:] = 1.0 / (count * ratio)
        particles = self.particles
        particles[:] = 0.0
        angle, axis = rng.uniform(-math.pi, math.pi, (2, count))
        size = np.exp(of.size_spread * rng.standard_normal(count))
        particles[p.X] = np.sqrt(square) * np.cos(angle) * of.sigma_along_m * size
        particles[p.Y] = np.sqrt(square) * np.sin(angle) * of.sigma_across_m * size
        particles[p.COS], particles[p.SIN] = np.cos(axis), np.sin(axis)
        particles[p.PER_ALONG] = 1.0 / (of.sigma_along_m * size)
        particles[p.PER_ACROSS] = 1.0 / (of.sigma_across_m * size)
        particles[p.AMPLITUDE] = 1.0
        particles[p.AMPLITUDE_VAR] = self._spreads(count) ** 2
        particles[p.MAP_VAR] = map_nt2
        if before is not None:
            signals = self._simulated(before.control, _FARTHEST)
            return self._weigh_beginning(seen, before) - self._log_beginnings(
                signals, map_nt2, threshold_nt, before
            )
        inside = -2.0 * math.log(min(1.0, max(threshold_nt, lowest_nt) / amplitude_nt)) / _FARTHEST**2
        return self._weigh(seen, 1.0, 0.0).log_density - math.log(max(inside, _LEAST_INSIDE))

    def _resample(self) -> None:
        """Resample, and change the extents a little, so that copies of a particle are not all alike."""
        super()._resample()
        if self._class.size_spread:
            factor = 1.0 + _JITTER * self._rng.standard_normal(self._count)
            self.particles[p.PER_ALONG] *= factor
            self.particles[p.PER_ACROSS] *= factor

    def _spreads(self, count: int) -> Array:
        """Relative standard deviations of the amplitudes of so many members."""
        usual = self._class.amplitude_spread
        atypical = np.arange(count) // _SPREAD_EVERY % _ATYPICAL_EVERY == 0
        return np.where(atypical, max(usual, _ATYPICAL_SPREAD if usual else 0.0), usual)

    def _drawn(self, count: int) -> tuple[Array, Array, Array]:
        of, rng = self._class, self._rng
        size = np.exp(of.size_spread * rng.standard_normal(count))
        amplitude_nt = of.amplitude_nt * (1.0 + self._spreads(count) * rng.standard_normal(count))
        return of.sigma_along_m * size, of.sigma_across_m * size, amplitude_nt


class BodyHypothesis(_GaussianParticles):
    """The anomaly is that of a body of no class, compact or elongated: a Gaussian.

    One of five of these bodies has any extent, amplitude and sign. The others are what is taken for a target:
    two resemble a class that is sought, with several times its spread and any ratio of their extents, and two
    are about as wide as it is and much longer.
    """

    def __init__(
        self,
        sought: Sequence[GaussianClass],
        count: int,
        rng: np.random.Generator,
        *,
        first: int = 1,
        by_roulette: bool = False,
    ) -> None:
        super().__init__(1.0, count, rng, first=first, by_roulette=by_roulette)
        self._sought = tuple(sought)

    def start(
        self, seen: Measurement, map_nt2: float, threshold_nt: float = 0.0, before: Before | None = None
    ) -> float:
        """Spread the particles over the places from which such an anomaly can begin. Few begin where the
        vehicle leaves the body; fewer particles are there, with more weight.
        """
        rng, count = self._rng, self.weights.size
        along_m, across_m, mean_nt, spread_nt = self._bodies(count)
        distance, (angle, axis) = (
            _BODY_FARTHEST * np.sqrt(rng.random(count)),
            rng.uniform(-math.pi, math.pi, (2, count)),
        )
        x, y = distance * np.cos(angle), distance * np.sin(angle)
        leaving = x * np.cos(axis) / along_m + y * np.sin(axis) / across_m > 0.0
        turned = leaving & (rng.random(count) < _TURNED)
        x[turned] *= -1.0
        y[turned] *= -1.0
        particles = self.particles
        particles[:] = 0.0
        particles[p.X], particles[p.Y] = x * along_m, y * across_m
        particles[p.COS], particles[p.SIN] = np.cos(axis), np.sin(axis)
        particles[p.PER_ALONG], particles[p.PER_ACROSS] = 1.0 / along_m, 1.0 / across_m
        particles[p.AMPLITUDE] = mean_nt
        particles[p.AMPLITUDE_VAR] = spread_nt**2
        particles[p.MAP_VAR] = map_nt2
        self.weights[:] = np.where(leaving & ~turned, 1.0 / (1.0 - _TURNED), 1.0 / (1.0 + _TURNED)) / count
        if before is not None:
            signals = self._simulated(before.control, _BODY_FARTHEST)
            return self._weigh_beginning(seen, before) - self._log_beginnings(
                signals, map_nt2, threshold_nt, before
            )
        density = self._weigh(seen, 1.0, 0.0).log_density
        return density - log_beyond(threshold_nt, np.sqrt(self._fits[1] + self._fits[2] ** 2))

    def _bodies(self, count: int) -> tuple[Array, Array, Array, Array]:
        """Extents along and across, and mean and standard deviation of amplitudes, nT, of so many bodies."""
        rng = self._rng
        length, width, strength = rng.random((3, count))
        length *= math.log(_BODY_M[1] / _BODY_M[0])
        width *= length
        along_m, across_m = _BODY_M[0] * np.exp(length), _BODY_M[0] * np.exp(width)
        mean_nt = np.zeros(count)
        spread_nt = _BODY_NT[0] * np.exp(math.log(_BODY_NT[1] / _BODY_NT[0]) * strength)
        if not self._sought:
            return along_m, across_m, mean_nt, spread_nt
        kind = np.arange(count) % _KINDS
        of_class = np.arange(count) // _KINDS % len(self._sought)
        for number, of in enumerate(self._sought):
            like = (kind > 0) & (of_class == number)
            sizes = np.exp(_LIKE_SIZE * rng.standard_normal((2, int(like.sum()))))
            along_m[like], across_m[like] = of.sigma_along_m * sizes[0], of.sigma_across_m * sizes[1]
            mean_nt[like] = of.amplitude_nt
            spread_nt[like] = _LIKE_AMPLITUDE * abs(of.amplitude_nt)
        long = (kind > 0) & (kind <= _LONG_KINDS)
        along_m[long] = across_m[long] * np.exp(rng.uniform(*_LOG_LONG, int(long.sum())))
        return along_m, across_m, mean_nt, spread_nt

    def _drawn(self, count: int) -> tuple[Array, Array, Array]:
        along_m, across_m, mean_nt, spread_nt = self._bodies(count)
        return along_m, across_m, mean_nt + spread_nt * self._rng.standard_normal(count)

    def _resample(self) -> None:
        """Resample, and change the extents a little, so that copies of a particle are not all alike."""
        super()._resample()
        for row in (p.PER_ALONG, p.PER_ACROSS):
            self.particles[row] *= 1.0 + _BODY_JITTER * self._rng.standard_normal(self._count)


class DipoleHypothesis(ParticleHypothesis):
    """The anomaly is of a class of dipoles."""

    def __init__(
        self,
        of: DipoleClass,
        count: int,
        rng: np.random.Generator,
        *,
        field_ned: Array,
        first: int = 1,
        by_roulette: bool = False,
    ) -> None:
        super().__init__(p.DIPOLE, count, rng, first=first, by_roulette=by_roulette)
        self._class = of
        self._field_ned = field_ned

    def start(
        self, seen: Measurement, map_nt2: float, threshold_nt: float = 0.0, before: Before | None = None
    ) -> float:
        """Spread the particles over the places from which an anomaly of the class can begin."""
        of, rng, count = self._class, self._rng, self.weights.size
        depth_m = of.least_m * (of.most_m / of.least_m) ** rng.random(count)
        distance_m = 2.0 * depth_m * np.sqrt(rng.random(count))
        angle = rng.uniform(-math.pi, math.pi, count)
        particles = self.particles
        particles[:] = 0.0
        particles[p.X], particles[p.Y] = distance_m * np.cos(angle), distance_m * np.sin(angle)
        particles[p.COS], particles[p.SIN] = math.cos(seen.course_rad), math.sin(seen.course_rad)
        particles[p.HEIGHT] = seen.height_m - depth_m
        particles[p.RANGE] = depth_m
        for diagonal in p.STRENGTH_VARIANCES:
            particles[diagonal] = of.strength_nt**2
        particles[p.DIPOLE_MAP_VAR] = map_nt2
        self.weights[:] = 1.0 / count
        if before is not None:
            signals = self._simulated(seen, before.control)
            return self._weigh_beginning(seen, before) - self._log_beginnings(
                signals, map_nt2, threshold_nt, before
            )
        density = self._weigh(seen, 1.0, 0.0).log_density
        return density - log_beyond(threshold_nt, np.sqrt(self._fits[1]))

    def _simulated(self, seen: Measurement, control: Control) -> tuple[Array, Array]:
        """Signals before a step and after it, of dipoles with strengths of the class at the particles'
        places.
        """
        columns = self.particles.copy()
        drawn = self._rng.standard_normal((columns.shape[1], p.TERMS - 1))
        columns[p.MEANS : p.MEANS + p.TERMS - 1] = self._class.strength_nt * drawn.T
        x, y, cosine, sine = (columns[k, :, None] for k in (p.X, p.Y, p.COS, p.SIN))
        then_x = x - cosine * control.forward_m + sine * control.right_m
        then_y = y - sine * control.forward_m - cosine * control.right_m
        then_nt = self._signals(columns, then_x, then_y, seen.height_m)[:, 0]
        return then_nt, self._signals(columns, x, y, seen.height_m)[:, 0]

    def _signals(self, columns: Array, x: Array, y: Array, height_m: float) -> Array:
        up = np.maximum(1.0, height_m - columns[p.HEIGHT, :, None])
        distance = np.sqrt(x * x + y * y + up * up)
        offset = (x / distance, y / distance, -up / distance)
        along = sum(self._field_ned[k] * offset[k] for k in range(3))
        total = sum(
            columns[p.MEANS + k, :, None] * (3.0 * along * offset[k] - self._field_ned[k]) for k in range(3)
        )
        signals: Array = (columns[p.RANGE, :, None] / distance) ** 3 * total
        return signals

    def _weigh(self, seen: Measurement, decay: float, drive_nt2: float) -> Update:
        density, confidence, misfit = p.weigh_dipole(
            self.particles,
            self.weights,
            self._field_ned,
            seen.height_m,
            seen.residual_nt,
            seen.white_nt2,
            decay,
            drive_nt2,
            self._fits,
        )
        return Update(log_density=density, confidence=confidence, misfit=misfit)


def _normal_share(low: float, high: float) -> float:
    """Probability of a standard normal number between two bounds."""
    return 0.5 * (math.erf(high / math.sqrt(2.0)) - math.erf(low / math.sqrt(2.0)))
