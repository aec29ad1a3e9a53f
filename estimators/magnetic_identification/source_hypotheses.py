"""The hypotheses with a signature: a source at a fixed place, of a class or of no class, with its evidence.

What is unknown about a source does not change from pass to pass, so each hypothesis is a sequential Monte
Carlo sampler of static parameters (Chopin 2002, "A sequential particle filter method for static models"): the
sources are weighted by each measurement. Where few of them are left, they are resampled, and moved by steps
that keep their distribution given all measurements so far. The steps are differences of two other sources
(ter Braak 2006, differential evolution), so they have the extent of what is still unknown, and the sources
never become copies of a few: the evidence hardly depends on the random numbers.

The measurements depend linearly on the strength of a source, which is therefore not sampled
(Rao-Blackwellization): its likelihood is a normal density, and its integral over the strengths that are
expected has a closed form.

The place is uniform around the first measurement of the anomaly, over an ellipse of so many standard
deviations, or depths of a dipole. An anomaly has begun there, and that says nothing about the extent of the
source: each extent is as probable as it is among all sources.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification import signatures as s
from estimators.magnetic_identification.classes import DipoleClass, GaussianClass
from estimators.magnetic_identification.hypotheses import Beginning, Update
from estimators.magnetic_identification.measurements import Measurements
from estimators.tracking.resampling import effective_count, systematic

__all__ = ["BodyHypothesis", "DipoleHypothesis", "GaussianHypothesis", "SourceHypothesis"]

Array = NDArray[np.float64]

_FARTHEST: Final = 3.5  # standard deviations at which an anomaly of a Gaussian can begin
_FARTHEST_DIPOLE: Final = 2.0  # depths
_FIRST: Final = 5000  # sources that begin: the first measurements say most about where a source is
_FEW: Final = 0.1  # of the sources: where so few are effective, they are moved more often
_MORE: Final = 2  # times
_RESAMPLED_BELOW: Final = 0.5  # of the sources: effective number
_OPTIMAL: Final = 2.38  # of a step, over the square root of twice the number of unknowns (ter Braak 2006)
_SWEEPS: Final = ((0.4, 0.1), (0.6, 0.2), (1.0, 1.0))
"""Steps of each source after a resampling: the length over the optimal one, and the share of all sources,
next to each other along some direction, of which two are drawn. Near ones are of the same mode; any two also
reach another.
"""
_BEGINNINGS: Final = 2048  # simulated tracks for the probability of a beginning
_LEAST_BEGINNINGS: Final = 1e-4  # share of those that begin an anomaly, for a class that hardly does
_ATYPICAL: Final = 1.0 / 6.0  # share of a class with an unusual strength: degaussed, or heading east
_ATYPICAL_SPREAD: Final = 0.5  # relative standard deviation of that strength
_LEAST_SPREAD: Final = 1e-3  # likewise of a class that states none
_OF_NO_CLASS_M: Final = 70.0  # extent of bodies where no class of Gaussians is sought
_OF_NO_CLASS_NT: Final = 30.0
_BODY_SIZES: Final = (0.35, 0.8)
"""Standard deviations of the logarithm of a body's mean extent over that of a class: one of two bodies
resembles a class, the other one is any. Likewise the next ones.
"""
_BODY_RATIOS: Final = (0.5, 1.3)  # standard deviations of the logarithm of the ratio of its extents
_BODY_STRENGTHS: Final = ((0.5, 1.0, 0.6), (0.2, 0.0, 0.4), (0.2, 0.0, 1.0), (0.1, 0.0, 2.0))
"""Shares, means and standard deviations of the strengths of bodies over that of a class."""


class SourceHypothesis(ABC):
    """What the hypotheses of all signatures share.

    Attributes:
        sources: (width, n).
        weights: (n,), sum one.

    Args:
        count: number of sources.
        terms: number of the signature's linear terms.
        rng: random numbers.
        speed_m_s: largest speed of the source, twice the standard deviation of each component.
    """

    def __init__(self, count: int, terms: int, rng: np.random.Generator, speed_m_s: float) -> None:
        self._count = count
        self._terms = terms
        self._rng = rng
        self._speed_m_s = speed_m_s
        self._began_ne_m = (0.0, 0.0)
        self._course_rad = self._height_m = self._time_s = 0.0
        self.sources: Array = np.zeros((0, 0))
        self.weights: Array = np.zeros(0)
        self._white: Array = np.zeros((0, terms, 0))  # whitened terms of all measurements
        self._precision: Array = np.zeros((terms, terms, 0))  # of the strengths, by the measurements
        self._product: Array = np.zeros((terms, 0))  # that times their most likely value
        self._gains: Array = np.zeros(0)  # logarithm of the density over that without a source
        self._means: Array = np.zeros((terms, 0))  # of the strengths, given the measurements
        self._covariances: Array = np.zeros((terms, terms, 0))

    @abstractmethod
    def _draw(self, count: int, rng: np.random.Generator) -> Array:
        """Sources (width, n) around the origin as they are expected; places uniform over an area that grows
        with their extent.
        """

    @abstractmethod
    def _log_extent(self, sources: Array) -> Array:
        """Logarithm of the extent of the sources along the course at the beginning."""

    @abstractmethod
    def _log_prior(self, sources: Array) -> Array:
        """Logarithm of the density of which `_draw` draws, but for a constant."""

    @abstractmethod
    def _signals(self, sources: Array, places: Array) -> Array:
        """Terms of the signatures (m, terms, n) at places (4, m): north, east, height and time."""

    @abstractmethod
    def _integrated(self, precision: Array, product: Array) -> tuple[Array, Array, Array]:
        """Logarithm of the density of the measurements over that without a source, (n,), and the strengths
        given the measurements: means (terms, n) and covariances (terms, terms, n).
        """

    @abstractmethod
    def _draw_strengths(self, count: int, rng: np.random.Generator) -> Array:
        """Strengths (terms, n) as they are expected."""

    def start(self, seen: Measurements, beginning: Beginning) -> float:
        self._began_ne_m = (beginning.north_m, beginning.east_m)
        self._course_rad, self._height_m = seen.course_rad, seen.height_m
        count = max(_FIRST, self._count)
        self.sources = self._draw(count, self._rng)
        logs = self._log_extent(self.sources)
        self.sources[s.NORTH] += beginning.north_m
        self.sources[s.EAST] += beginning.east_m
        if self._speed_m_s:
            speeds = 0.5 * self._speed_m_s * self._rng.standard_normal((2, count))
            self.sources[s.NORTH_SPEED], self.sources[s.EAST_SPEED] = speeds
        self.weights = np.exp(logs - logs.max())
        self.weights /= self.weights.sum()
        self._gains = np.zeros(count)
        self._white, self._precision, self._product = self._weighed(self.sources, seen, seen.count)
        gained = self._reweigh()
        return seen.log_density() + gained - self._log_beginnings(beginning)

    def step(self, seen: Measurements) -> Update:
        newest = seen.count - 1
        effective = effective_count(self.weights) / self._count
        if effective < _RESAMPLED_BELOW or self.weights.size > self._count:
            # of many that begin, and are all different, as many as needed go on as they are
            self._renew(seen, newest, 0 if effective > 1.0 else _MORE if effective < _FEW else 1)
        places = seen.places()
        self._time_s = float(places[3, newest])
        signals = self._signals(self.sources, places[:, newest:])
        white = seen.whitened_next(signals[0], self._white)
        misfit = s.predict(white, seen.white[newest], self._means, self._covariances, self.weights)
        self._white = np.concatenate((self._white, white[None]))
        s.add_to_strengths(white[None], seen.white[newest:], self._precision, self._product)
        gained = self._reweigh()
        return Update(log_density=seen.log_density(newest) + gained, misfit=misfit)

    def _weighed(self, sources: Array, seen: Measurements, count: int) -> tuple[Array, Array, Array]:
        """Whitened terms of the first measurements, and what those say about the strengths."""
        white = seen.whitened(self._signals(sources, seen.places()[:, :count]))
        precision = np.zeros((self._terms, self._terms, sources.shape[1]))
        product = np.zeros((self._terms, sources.shape[1]))
        s.add_to_strengths(white, seen.white[:count], precision, product)
        return white, precision, product

    def _reweigh(self) -> float:
        """Weigh by what has been gained; logarithm of its mean."""
        before = self._gains
        self._gains, self._means, self._covariances = self._integrated(self._precision, self._product)
        return s.reweigh(self.weights, before, self._gains)

    def _renew(self, seen: Measurements, count: int, times: int) -> None:
        """Resample the sources and move them so many times, given the first measurements."""
        chosen = np.empty(self._count, dtype=np.int64)
        systematic(self.weights, float(self._rng.random()), chosen)
        self.sources, self._gains = self.sources[:, chosen], self._gains[chosen]
        self._white, self._product = self._white[..., chosen], self._product[..., chosen]
        self._precision = self._precision[..., chosen]
        self._means, self._covariances = self._means[..., chosen], self._covariances[..., chosen]
        self.weights = np.full(self._count, 1.0 / self._count)
        before = self._log_density(self.sources)
        for length, share in times * _SWEEPS:
            before = self._move(seen, count, before, length, share)

    def _move(self, seen: Measurements, count: int, before: Array, length: float, share: float) -> Array:
        """One Metropolis step of each source; takes and returns the logarithm of their density before the
        measurements.
        """
        steps = self._differences(share)
        unknowns = max(1, int(np.count_nonzero(np.any(steps != 0.0, axis=1))))
        moved = self.sources + length * _OPTIMAL / math.sqrt(2.0 * unknowns) * steps
        log_density = self._log_density(moved)
        white, precision, product = self._weighed(moved, seen, count)
        gains, means, covariances = self._integrated(precision, product)
        taken = np.log(self._rng.random(self._count)) < gains - self._gains + log_density - before
        pairs = (
            *((moved, self.sources), (white, self._white), (precision, self._precision)),
            *((product, self._product), (means, self._means), (covariances, self._covariances)),
        )
        for new, old in pairs:
            s.replace_taken(taken, new.reshape(-1, self._count), old.reshape(-1, self._count))
        self._gains = np.where(taken, gains, self._gains)
        return np.where(taken, log_density, before)

    def _differences(self, share: float) -> Array:
        """Differences of pairs of sources, which are within a share of all along some direction."""
        rng, count = self._rng, self._count
        order = np.arange(count)
        if share < 1.0:
            angle = rng.uniform(-math.pi, math.pi)
            along = math.cos(angle) * self.sources[s.NORTH] + math.sin(angle) * self.sources[s.EAST]
            order = np.argsort(along)
        widest = max(2, round(0.5 * share * count))
        apart = rng.integers(1 - widest, widest, count)
        first = (np.arange(count) + rng.integers(count)) % count
        second = (first + apart + (apart >= 0)) % count
        steps = self.sources[:, order[first]] - self.sources[:, order[second]]
        return self._wrap(steps)

    @staticmethod
    def _wrap(steps: Array) -> Array:
        """Differences of sources with the short ones of angles."""
        return steps

    def _log_density(self, sources: Array) -> Array:
        """Logarithm of the density of sources before the measurements."""
        around = sources.copy()
        around[s.NORTH] -= self._began_ne_m[0]
        around[s.EAST] -= self._began_ne_m[1]
        found = self._log_prior(around) + self._log_extent(around)
        if self._speed_m_s:
            speeds = around[s.NORTH_SPEED : s.EAST_SPEED + 1] / (0.5 * self._speed_m_s)
            found = found - 0.5 * np.sum(speeds**2, axis=0)
        return found

    def _log_beginnings(self, beginning: Beginning) -> float:
        """Logarithm of the share of tracks that begin an anomaly here.

        The random numbers are the same for every anomaly: what they are off by is so, too.
        """
        rng, threshold_nt = np.random.Generator(np.random.SFC64(1)), beginning.threshold_nt
        sources = self._draw(_BEGINNINGS, rng)
        strengths = self._draw_strengths(_BEGINNINGS, rng)
        errors = rng.standard_normal((4, _BEGINNINGS))
        sigma_nt, white_nt = math.sqrt(beginning.map_nt2), math.sqrt(beginning.white_nt2)
        map_nt = sigma_nt * errors[0]
        here = self._expected(sources, strengths, 0.0, 0.0) + map_nt + white_nt * errors[1]
        begins = np.abs(here) > threshold_nt
        if beginning.step_ne_m is not None:
            alike = beginning.shared_nt2 / beginning.map_nt2 if beginning.map_nt2 else 0.0
            map_nt = alike * map_nt + math.sqrt(1.0 - alike * alike) * sigma_nt * errors[2]
            then = self._expected(sources, strengths, -beginning.step_ne_m[0], -beginning.step_ne_m[1])
            begins &= np.abs(then + map_nt + white_nt * errors[3]) <= threshold_nt
        logs = self._log_extent(sources)
        weights = np.exp(logs - logs.max())
        return math.log(max(float(weights @ begins / weights.sum()), _LEAST_BEGINNINGS))

    def _expected(self, sources: Array, strengths: Array, north_m: float, east_m: float) -> Array:
        """Signals, nT, of sources around the origin with strengths (terms, n) at a place."""
        place = np.array([[north_m], [east_m], [self._height_m], [0.0]])
        found: Array = np.sum(self._signals(sources, place)[0] * strengths, axis=0)
        return found

    def _places(self) -> tuple[Array, Array]:
        """North and east of the sources at the newest measurement."""
        return (
            self.sources[s.NORTH] + self._time_s * self.sources[s.NORTH_SPEED],
            self.sources[s.EAST] + self._time_s * self.sources[s.EAST_SPEED],
        )

    def predicted_nt(self, north_m: Array, east_m: Array, height_m: float, count: int) -> Array:
        """Anomaly at places (m,), (count, m), for as many equally probable sources."""
        chosen = np.empty(count, dtype=np.int64)
        systematic(self.weights, 0.5, chosen)
        heights_m, times_s = np.full(len(north_m), height_m), np.full(len(north_m), self._time_s)
        signals = self._signals(self.sources[:, chosen], np.stack((north_m, east_m, heights_m, times_s)))
        return np.sum(signals * self._means[:, chosen], axis=1).T

    def mean_place_m(self) -> tuple[float, float]:
        """Mean north and east of the source."""
        north, east = self._places()
        return float(self.weights @ north), float(self.weights @ east)

    def places(self) -> Array:
        """(n, 3) north, east and axis from north, -pi..pi."""
        out = np.zeros((self.weights.size, 3))
        out[:, 0], out[:, 1] = self._places()
        return out


class _GaussianSources(SourceHypothesis):
    """Sources with a Gaussian signature.

    Args:
        members_nt: (m, 3) share, mean and standard deviation of each part of the strengths.
    """

    def __init__(
        self,
        members_nt: Sequence[tuple[float, float, float]],
        count: int,
        rng: np.random.Generator,
        speed_m_s: float,
    ) -> None:
        super().__init__(count, 1, rng, speed_m_s)
        self._parts = np.array([(math.log(share), mean, sigma**2) for share, mean, sigma in members_nt])

    @abstractmethod
    def _draw_extents(self, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """Logarithms of the extents along and across."""

    @abstractmethod
    def _log_extents(self, log_along: Array, log_across: Array) -> Array:
        """Logarithm of the density of which `_draw_extents` draws, but for a constant."""

    def _draw(self, count: int, rng: np.random.Generator) -> Array:
        sources = np.zeros((s.GAUSSIAN, count))
        sources[s.LOG_ALONG], sources[s.LOG_ACROSS] = self._draw_extents(count, rng)
        distance = _FARTHEST * np.sqrt(rng.random(count))
        angle, axis = rng.uniform(-math.pi, math.pi, (2, count))
        along = distance * np.cos(angle) * np.exp(sources[s.LOG_ALONG])
        across = distance * np.sin(angle) * np.exp(sources[s.LOG_ACROSS])
        sources[s.NORTH] = along * np.cos(axis) - across * np.sin(axis)
        sources[s.EAST] = along * np.sin(axis) + across * np.cos(axis)
        sources[s.AXIS] = axis
        return sources

    def _log_prior(self, sources: Array) -> Array:
        log_along, log_across = sources[s.LOG_ALONG], sources[s.LOG_ACROSS]
        square = _square(sources, sources[s.NORTH], sources[s.EAST])
        density = self._log_extents(log_along, log_across) - log_along - log_across
        return np.where(square <= _FARTHEST**2, density, -np.inf)

    def _log_extent(self, sources: Array) -> Array:
        cosine, sine = math.cos(self._course_rad), math.sin(self._course_rad)
        return -0.5 * np.log(
            _square(sources, np.full(sources.shape[1], cosine), np.full(sources.shape[1], sine))
        )

    @staticmethod
    def _wrap(steps: Array) -> Array:
        steps[s.AXIS] -= math.pi * np.round(steps[s.AXIS] / math.pi)
        return steps

    def _signals(self, sources: Array, places: Array) -> Array:
        out = np.empty((places.shape[1], 1, sources.shape[1]))
        s.gaussian_terms(sources, places, out)
        return out

    def _integrated(self, precision: Array, product: Array) -> tuple[Array, Array, Array]:
        gains, means, variances = np.empty((3, product.shape[1]))
        s.integrate_mixture(precision[0, 0], product[0], self._parts, gains, means, variances)
        return gains, means[None], variances[None, None]

    def _draw_strengths(self, count: int, rng: np.random.Generator) -> Array:
        part = rng.choice(len(self._parts), count, p=np.exp(self._parts[:, 0]))
        means_nt, sigmas_nt = self._parts[part, 1], np.sqrt(self._parts[part, 2])
        found: Array = (means_nt + sigmas_nt * rng.standard_normal(count))[None]
        return found

    def places(self) -> Array:
        out = super().places()
        out[:, 2] = np.mod(self.sources[s.AXIS] + math.pi, math.tau) - math.pi
        return out


def _square(sources: Array, off_n: Array, off_e: Array) -> Array:
    """Square of the distance from Gaussian sources, in their standard deviations."""
    cosine, sine = np.cos(sources[s.AXIS]), np.sin(sources[s.AXIS])
    per_along, per_across = np.exp(-sources[s.LOG_ALONG]), np.exp(-sources[s.LOG_ACROSS])
    along = off_n * (cosine * per_along) + off_e * (sine * per_along)
    across = off_e * (cosine * per_across) - off_n * (sine * per_across)
    found: Array = along * along + across * across
    return found


class GaussianHypothesis(_GaussianSources):
    """The anomaly is of a class with a Gaussian signature.

    Some members of a class are not as it is stated (a ship that is degaussed, or heads east): the strength
    of one of six may be any. A class without spread has none of these.
    """

    def __init__(
        self, of: GaussianClass, count: int, rng: np.random.Generator, *, speed_m_s: float = 0.0
    ) -> None:
        self._class = of
        size_nt, spread = abs(of.amplitude_nt), max(of.amplitude_spread, _LEAST_SPREAD)
        members = [(1.0, of.amplitude_nt, spread * size_nt)]
        if of.amplitude_spread:
            atypical_nt = max(spread, _ATYPICAL_SPREAD) * size_nt
            members = [
                (1.0 - _ATYPICAL, of.amplitude_nt, spread * size_nt),
                (_ATYPICAL, of.amplitude_nt, atypical_nt),
            ]
        super().__init__(members, count, rng, speed_m_s)

    def _draw_extents(self, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
        size = self._class.size_spread * rng.standard_normal(count)
        return math.log(self._class.sigma_along_m) + size, math.log(self._class.sigma_across_m) + size

    def _log_extents(self, log_along: Array, log_across: Array) -> Array:
        # the ratio of the extents is that of the class: differences of sources have none
        if not self._class.size_spread:
            return np.zeros(len(log_along))
        size = (log_along - math.log(self._class.sigma_along_m)) / self._class.size_spread
        return -0.5 * size * size


class BodyHypothesis(_GaussianSources):
    """The anomaly is that of a body of no class, compact or elongated, stronger or weaker: a Gaussian.

    Args:
        sought: the classes whose extents and strengths are the middle of those of bodies.
        count, rng, speed_m_s: see the base class.
    """

    def __init__(
        self, sought: Sequence[GaussianClass], count: int, rng: np.random.Generator, *, speed_m_s: float = 0.0
    ) -> None:
        extents = [0.5 * math.log(of.sigma_along_m * of.sigma_across_m) for of in sought]
        sizes = [math.log(abs(of.amplitude_nt)) for of in sought]
        self._log_size = float(np.mean(extents)) if extents else math.log(_OF_NO_CLASS_M)
        size_nt = math.exp(float(np.mean(sizes))) if sizes else _OF_NO_CLASS_NT
        sign = -1.0 if sought and all(of.amplitude_nt < 0.0 for of in sought) else 1.0
        parts = [(share, sign * mean * size_nt, sigma * size_nt) for share, mean, sigma in _BODY_STRENGTHS]
        super().__init__(parts, count, rng, speed_m_s)

    def _draw_extents(self, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
        size, ratio = rng.standard_normal((2, count))
        kind = np.arange(count) % len(_BODY_SIZES)
        middle = self._log_size + np.array(_BODY_SIZES)[kind] * size
        half = 0.5 * np.array(_BODY_RATIOS)[kind] * np.abs(ratio)
        return middle + half, middle - half

    def _log_extents(self, log_along: Array, log_across: Array) -> Array:
        size, ratio = 0.5 * (log_along + log_across) - self._log_size, log_along - log_across
        density = sum(
            np.exp(-0.5 * ((size / sizes) ** 2 + (ratio / ratios) ** 2)) / (sizes * ratios)
            for sizes, ratios in zip(_BODY_SIZES, _BODY_RATIOS, strict=True)
        )
        return np.where(ratio >= 0.0, np.log(np.maximum(density, 1e-300)), -np.inf)


class DipoleHypothesis(SourceHypothesis):
    """The anomaly is of a class of dipoles."""

    def __init__(
        self,
        of: DipoleClass,
        count: int,
        rng: np.random.Generator,
        *,
        field_ned: Array,
        speed_m_s: float = 0.0,
    ) -> None:
        super().__init__(count, 3, rng, speed_m_s)
        self._class = of
        north, east, down = field_ned.tolist()
        self._field_ned = (north, east, down)

    def _draw(self, count: int, rng: np.random.Generator) -> Array:
        sources = np.zeros((s.DIPOLE, count))
        sources[s.LOG_DEPTH] = rng.uniform(math.log(self._class.least_m), math.log(self._class.most_m), count)
        distance_m = _FARTHEST_DIPOLE * np.sqrt(rng.random(count)) * np.exp(sources[s.LOG_DEPTH])
        angle = rng.uniform(-math.pi, math.pi, count)
        sources[s.NORTH], sources[s.EAST] = distance_m * np.cos(angle), distance_m * np.sin(angle)
        return sources

    def _log_prior(self, sources: Array) -> Array:
        log_depth = sources[s.LOG_DEPTH]
        depths_away = np.hypot(sources[s.NORTH], sources[s.EAST]) * np.exp(-log_depth)
        inside = (log_depth >= math.log(self._class.least_m)) & (log_depth <= math.log(self._class.most_m))
        return np.where(inside & (depths_away <= _FARTHEST_DIPOLE), -2.0 * log_depth, -np.inf)

    def _log_extent(self, sources: Array) -> Array:
        return sources[s.LOG_DEPTH]

    def _signals(self, sources: Array, places: Array) -> Array:
        out = np.empty((places.shape[1], 3, sources.shape[1]))
        s.dipole_terms(sources, places, self._field_ned, self._height_m, out)
        return out

    def _integrated(self, precision: Array, product: Array) -> tuple[Array, Array, Array]:
        count = product.shape[1]
        gains, means, covariances = np.empty(count), np.empty((3, count)), np.empty((3, 3, count))
        variance_nt2 = self._class.strength_nt**2
        s.integrate_vectors(precision, product, variance_nt2, gains, means, covariances)
        return gains, means, covariances

    def _draw_strengths(self, count: int, rng: np.random.Generator) -> Array:
        found: Array = self._class.strength_nt * rng.standard_normal((3, count))
        return found
