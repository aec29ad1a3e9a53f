"""The Bayes filter of a target's place by particles: an adaptive grid (Tisdale et al. 2008, section IV-B).

The paper resamples at every step and adds a random walk of 1 m, so that its covariance grows between
detections. Here particles are resampled when the weights have become unequal (Arulampalam et al. 2002,
effective sample size) and spread over the distance to their neighbours (regularization), so that a static
target needs no walk. A detection that is sharper than the particles are dense leaves a few of them: there the
prior gets new particles, drawn from the likelihood, before both are multiplied.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from estimators.tracking.camera_likelihood import FrameLikelihood
from estimators.tracking.camera_sight import CameraSight, SightModel
from estimators.tracking.grid import GridLayout
from estimators.tracking.motion import Motion, MotionKind
from estimators.tracking.particle_kernels import (
    DRAWS,
    add_particles,
    count_near,
    densities,
    reflect,
    regenerate,
    spiral,
)
from estimators.tracking.resampling import effective_count

__all__ = ["SearchParticles"]

Array = NDArray[np.float64]

_FEW: Final = 100  # particles within three standard deviations of a detection; with less it gets new ones
_NEW: Final = 0.1  # their share


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
        self.count, self.resample_share = count, resample_share
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
        reflect(places, self._rates, self._low, self._high)

    def update(self, sight: CameraSight) -> float:
        reach_m = math.dist(self._low, self._high) + math.dist(sight.place_ned_m[:2], self._low)
        frame = FrameLikelihood.of(sight, self.model, reach_m)
        places = frame.places()
        if len(places) and count_near(self._places, places) < _FEW:
            self._refine(places)
        self._weights *= frame.at(*self._places)
        evidence = float(self._weights.sum())
        self._detected = self._detected or bool(len(sight.detections))
        if not self._detected:
            self._undetected *= evidence
        if not evidence > 0.0:  # what was observed has contradicted every particle
            self._weights[:] = 1.0 / self._weights.size
            return 0.0
        self._weights /= evidence
        size = self._weights.size
        if size != self.count or effective_count(self._weights) < self.resample_share * size:
            self._resample()
        return evidence

    def _refine(self, detected: Array) -> None:
        """Add particles where detections are, (m, 5); what all represent stays the same."""
        drawn = math.ceil(_NEW * self.count)
        places, rates, weights = np.empty((2, drawn)), np.empty((2, drawn)), np.empty(drawn)
        unit = spiral(drawn, math.tau * float(self._rng.random()))
        add_particles(self._places, self._rates, self._weights, detected, unit, places, rates, weights)
        self._places = np.hstack((self._places, places))
        self._rates = np.hstack((self._rates, rates))
        self._weights = np.hstack((self._weights, weights))

    def _resample(self) -> None:
        count = self.count
        draws = self._rng.bit_generator.random_raw(count).astype("<u8").view("<u2").reshape(count, DRAWS)
        places, rates = np.empty((2, count)), np.empty((2, count))
        start = float(self._rng.random())
        regenerate(self._places, self._rates, self._weights, start, draws, places, rates)
        reflect(places, rates, self._low, self._high)
        self._places, self._rates = places, rates
        self._weights = np.full(count, 1.0 / count)
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
        out = np.empty(self._weights.size)
        densities(self._places, self._weights, out)
        return out

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
