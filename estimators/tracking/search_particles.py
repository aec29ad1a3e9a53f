"""The Bayes filter of a target's place by particles: an adaptive grid (Tisdale et al. 2008, section IV-B).

The paper resamples at every step and adds a random walk of 1 m, so that its covariance grows between
detections. Here particles are resampled when the weights have become unequal (Arulampalam et al. 2002,
effective sample size) and spread over the distance to their neighbours (regularization), so that a static
target needs no walk.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from estimators.tracking.camera_likelihood import FrameLikelihood
from estimators.tracking.camera_sight import CameraSight, SightModel
from estimators.tracking.grid import GridLayout
from estimators.tracking.intensity import Motion, MotionKind
from estimators.tracking.resampling import effective_count, systematic
from flightsim.foundation.kernels import kernel

__all__ = ["SearchParticles"]

Array = NDArray[np.float64]
Draws = NDArray[np.uint16]

_BINS: Final = 64  # along each axis, over the particles: for the distance to neighbours
_SPREAD: Final = 0.4  # of that distance, standard deviation per axis; of a uniform cell it is 0.29
_DRAWS: Final = 4  # numbers of 16 bits in one of the generator's: two for each axis
_DRAW_UNIT: Final = (
    math.sqrt(6.0) / 2.0**16
)  # the sum of two of them has the standard deviation 1 in this unit


class SearchParticles:
    """Particles of a target's place.

    Args:
        layout: the area; its cells have no meaning here.
        model: detector and target.
        motion: of the target; a static one does not move.
        count: number of particles (paper: 6400).
        resample_share: resample when the effective number falls below this share; 1: at every frame, as the
            paper does.
        seed: of the random numbers.

    Raises:
        EstimatorError: a value is not possible.
    """

    def __init__(
        self,
        layout: GridLayout,
        model: SightModel,
        *,
        motion: Motion | None = None,
        count: int = 6400,
        resample_share: float = 0.5,
        seed: np.random.SeedSequence,
    ) -> None:
        if not 10 <= count <= 10_000_000:
            raise EstimatorError(f"`particles` {count} is not in 10..10000000")
        if not 0.0 < resample_share <= 1.0:
            raise EstimatorError(f"resample_share {resample_share:g} is not in 0..1, or is 0")
        self.layout, self.model = layout, model
        self.motion = motion or Motion()
        self.resample_share = resample_share
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._low: Array = np.array([layout.south_m, layout.west_m])
        self._high: Array = np.array([layout.north_m, layout.east_m])
        self._places: Array = _even(self._low, self._high, count, self._rng)
        self._rates: Array = np.zeros((2, count))
        if self.motion.kind is MotionKind.CONSTANT_VELOCITY:
            self._rates = self.motion.speed_sigma_m_s * self._rng.standard_normal((2, count))
        self._weights: Array = np.full(count, 1.0 / count)
        self._undetected = 1.0
        self._detected = False
        self.resampled = 0

    @property
    def places(self) -> Array:
        """(2, n): north and east."""
        return self._places

    @property
    def weights(self) -> Array:
        """(n,), sum one."""
        return self._weights

    def predict(self, dt_s: float) -> None:
        motion = self.motion
        if not motion.moves or not dt_s > 0.0:
            return
        places, shape = self._places, self._places.shape
        if motion.kind is MotionKind.CONSTANT_VELOCITY:
            change = motion.acceleration_m_s2_sqrt_hz * math.sqrt(dt_s) * self._rng.standard_normal(shape)
            places += dt_s * (self._rates + 0.5 * change)
            self._rates += change
        else:
            places += motion.walk_m_sqrt_s * math.sqrt(dt_s) * self._rng.standard_normal(shape)
        _reflect(places, self._rates, self._low, self._high)

    def update(self, sight: CameraSight) -> float:
        reach_m = math.dist(self._low, self._high) + math.dist(sight.place_ned_m[:2], self._low)
        frame = FrameLikelihood.of(sight, self.model, reach_m)
        self._weights *= frame.at(*self._places)
        evidence = float(self._weights.sum())
        self._detected = self._detected or bool(len(sight.detections))
        if not self._detected:
            self._undetected *= evidence
        if not evidence > 0.0:  # what was observed has contradicted every particle
            self._weights[:] = 1.0 / self._weights.size
            return 0.0
        self._weights /= evidence
        if effective_count(self._weights) < self.resample_share * self._weights.size:
            self._resample()
        return evidence

    def _resample(self) -> None:
        count = self._weights.size
        draws = self._rng.bit_generator.random_raw(count).astype("<u8").view("<u2").reshape(count, _DRAWS)
        places, rates = np.empty_like(self._places), np.empty_like(self._rates)
        start = float(self._rng.random())
        _regenerate(self._places, self._rates, self._weights, start, draws, places, rates)
        _reflect(places, rates, self._low, self._high)
        self._places, self._rates = places, rates
        self._weights[:] = 1.0 / count
        self.resampled += 1

    @property
    def probability_of_detection(self) -> float:
        return 1.0 - self._undetected

    def moments(self) -> tuple[Array, Array]:
        mean = self._places @ self._weights
        off = self._places - mean[:, None]
        return mean, (self._weights * off) @ off.T

    @property
    def mode_ne_m(self) -> tuple[float, float]:
        """The particle in the densest place."""
        best = int(np.argmax(self._density()))
        return float(self._places[0, best]), float(self._places[1, best])

    @property
    def entropy_nats(self) -> float:
        density = self._density()
        return float(-self._weights @ np.log(density))

    def _density(self) -> Array:
        """Probability per square metre about each particle: of its bin."""
        south, west, side_n, side_e = _box_of(self._places)
        share = np.zeros((_BINS, _BINS))
        rows = np.minimum((self._places[0] - south) / side_n, _BINS - 1).astype(np.int64)
        columns = np.minimum((self._places[1] - west) / side_e, _BINS - 1).astype(np.int64)
        np.add.at(share, (rows, columns), self._weights)
        return np.maximum(share[rows, columns], 1e-300) / (side_n * side_e)

    def shares(self, layout: GridLayout) -> Array:
        out = np.zeros((layout.rows, layout.columns))
        rows = np.clip((self._places[0] - layout.south_m) / layout.cell_m, 0, layout.rows - 1)
        columns = np.clip((self._places[1] - layout.west_m) / layout.cell_m, 0, layout.columns - 1)
        np.add.at(out, (rows.astype(np.int64), columns.astype(np.int64)), self._weights)
        return out


def _even(low: Array, high: Array, count: int, rng: np.random.Generator) -> Array:
    """Places (2, n) spread over a rectangle, one in each of the cells of nearly square shape; the rest at
    random.
    """
    height, width = high - low
    rows = max(1, round(math.sqrt(count * height / width)))
    columns = max(1, count // rows)
    index = np.arange(rows * columns)[:count]
    within = rng.random((2, count))
    places = within.copy()
    places[0, : index.size] = (index // columns + within[0, : index.size]) / rows
    places[1, : index.size] = (index % columns + within[1, : index.size]) / columns
    return np.asarray(low[:, None] + places * (high - low)[:, None])


def _box_of(places: Array) -> tuple[float, float, float, float]:
    """South, west, and the sides of a bin, of the bins over all particles."""
    low, high = places.min(axis=1), places.max(axis=1)
    sides = np.maximum((high - low) / _BINS, 1e-6)
    return float(low[0]), float(low[1]), float(sides[0]), float(sides[1])


@kernel
def _reflect(places: Array, rates: Array, low: Array, high: Array) -> None:
    """Particles that have left the area come back, as at a wall."""
    for axis in range(places.shape[0]):
        span = high[axis] - low[axis]
        for i in range(places.shape[1]):
            past = places[axis, i] - low[axis]
            if past < 0.0 or past > span:
                past = past % (2.0 * span)
                if past > span:
                    past = 2.0 * span - past
                    rates[axis, i] = -rates[axis, i]
                places[axis, i] = low[axis] + past


@kernel
def _regenerate(
    places: Array,
    rates: Array,
    weights: Array,
    start: float,
    draws: Draws,
    new_places: Array,
    new_rates: Array,
) -> None:
    """Resample, and spread each copy by its share of the distance to the neighbours of its original: the root
    of a bin's area for each particle in it. The spread has a triangular density along each axis, close to the
    optimal kernel (Musso, Oudjane and Le Gland 2001), and costs a tenth of a Gaussian's.

    Args:
        places, rates: (2, n).
        weights: (n,), sum one.
        start: uniform in 0..1.
        draws: (n, 4) uniform in 0..65535.
        new_places, new_rates: (2, n), the result.
    """
    count = weights.size
    south, west, north, east = places[0, 0], places[1, 0], places[0, 0], places[1, 0]
    for i in range(count):
        south, north = min(south, places[0, i]), max(north, places[0, i])
        west, east = min(west, places[1, i]), max(east, places[1, i])
    side_n, side_e = max((north - south) / _BINS, 1e-6), max((east - west) / _BINS, 1e-6)
    bins = np.zeros(_BINS * _BINS)
    where = np.empty(count, np.int64)
    for i in range(count):
        row = min(_BINS - 1, int((places[0, i] - south) / side_n))
        where[i] = row * _BINS + min(_BINS - 1, int((places[1, i] - west) / side_e))
        bins[where[i]] += 1.0
    for k in range(bins.size):
        if bins[k] > 0.0:
            bins[k] = _SPREAD * _DRAW_UNIT * math.sqrt(side_n * side_e / bins[k])
    chosen = np.empty(count, np.int64)
    systematic(weights, start, chosen)
    for i in range(count):
        one = chosen[i]
        spread = bins[where[one]]
        for axis in range(2):
            off = float(draws[i, 2 * axis]) + float(draws[i, 2 * axis + 1]) - 65535.0
            new_places[axis, i] = places[axis, one] + spread * off
            new_rates[axis, i] = rates[axis, one]
