"""What a hypothesis about one anomaly takes and gives, and the hypotheses without a signature: the error of
the map, the edge of a tile of it, and a field of unknown shape. Those with a signature are in
`source_hypotheses`.

The evidence of a hypothesis is the probability density of all measurements under it, given that they begin an
anomaly.
"""

import math
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.measurements import Measurements
from flightsim.foundation.kernels import kernel

__all__ = [
    "BackgroundHypothesis",
    "Beginning",
    "EdgeHypothesis",
    "Hypothesis",
    "ShapelessHypothesis",
    "Update",
]

Array = NDArray[np.float64]

_LENGTHS: Final = (0.35, 0.6, 1.0)  # of a field of unknown shape, over the stated one
_SIZES: Final = (0.6, 1.2, 2.4)  # likewise of its standard deviation
_ROOM: Final = 64  # measurements
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
_BEYOND: Final = 2.5 * (1.0 + _NODES)  # standard deviations: beyond five there is nothing
_BEYOND_WEIGHTS: Final = 2.5 * _WEIGHTS


@dataclass(frozen=True, slots=True, kw_only=True)
class Beginning:
    """How an anomaly begins: a measurement within a threshold, then one beyond it.

    An anomaly begins where a track enters it: a vehicle that flies outwards, or along the edge, crosses the
    threshold seldom or never.

    Attributes:
        threshold_nt: the threshold.
        north_m, east_m: place of the measurement beyond it.
        step_ne_m: from the measurement before to it; None: there is none, or it was beyond the threshold too.
        map_nt2: variance of the error of the map.
        shared_nt2: covariance of that error at both.
        white_nt2: variance of the white noise of a measurement.
    """

    threshold_nt: float
    north_m: float
    east_m: float
    step_ne_m: tuple[float, float] | None
    map_nt2: float
    shared_nt2: float
    white_nt2: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Update:
    """What a measurement says about a hypothesis.

    Attributes:
        log_density: logarithm of its density, given the measurements before it, 1/nT.
        misfit: square of the difference between measurement and prediction, over the variance that is
            predicted for it: one in the mean where the hypothesis is right, whatever came before.
    """

    log_density: float
    misfit: float


class Hypothesis(Protocol):
    """One explanation of an anomaly."""

    def start(self, seen: Measurements, beginning: Beginning) -> float:
        """Begin with the measurements up to the first one beyond a threshold.

        Returns:
            Logarithm of their density, given that the last one begins an anomaly.
        """

    def step(self, seen: Measurements) -> Update:
        """One more measurement, the newest one."""


class BackgroundHypothesis:
    """There is only the error of the map. Its evidence is exact."""

    def start(self, seen: Measurements, beginning: Beginning) -> float:
        map_nt2 = beginning.map_nt2
        return seen.log_density() - _log_entering(beginning, map_nt2, map_nt2, beginning.shared_nt2)

    def step(self, seen: Measurements) -> Update:
        return Update(log_density=seen.log_density(seen.count - 1), misfit=float(seen.white[-1] ** 2))


class EdgeHypothesis:
    """The edge of a tile of the map, or of a line that is levelled wrongly: an offset that begins with the
    anomaly and stays, beside the error of the map. Its evidence is exact.

    Args:
        sigma_nt: standard deviation of the offset.
    """

    def __init__(self, sigma_nt: float) -> None:
        self._sigma_nt2 = sigma_nt * sigma_nt
        self._signals: Array = np.zeros(0)
        self._log_density = 0.0

    def start(self, seen: Measurements, beginning: Beginning) -> float:
        offset = np.zeros(seen.count)
        offset[-1] = 1.0
        self._signals = seen.whitened(offset)
        self._log_density = self._density(seen)
        map_nt2 = beginning.map_nt2
        entering = _log_entering(beginning, map_nt2, self._sigma_nt2 + map_nt2, beginning.shared_nt2)
        return self._log_density - entering

    def step(self, seen: Measurements) -> Update:
        before = self._log_density
        precision, product = float(self._signals @ self._signals), float(self._signals @ seen.white[:-1])
        signal = float(seen.whitened_next(np.ones(1), self._signals[:, None])[0])
        variance = self._sigma_nt2 / (1.0 + self._sigma_nt2 * precision)
        misfit = (seen.white[-1] - signal * variance * product) ** 2 / (1.0 + signal * signal * variance)
        self._signals = np.append(self._signals, signal)
        self._log_density = self._density(seen)
        return Update(log_density=self._log_density - before, misfit=float(misfit))

    def _density(self, seen: Measurements) -> float:
        precision, product = float(self._signals @ self._signals), float(self._signals @ seen.white)
        one = 1.0 + self._sigma_nt2 * precision
        return seen.log_density() + 0.5 * (self._sigma_nt2 * product * product / one - math.log(one))


class ShapelessHypothesis:
    """A source of any shape: a Gaussian process over the plane, whose evidence is exact (Rasmussen and
    Williams 2006, section 2.7). Lines that cross measure the same field, so it knows what two passes have in
    common. Its extent and size are one of a few.

    Args:
        sigma_nt: standard deviation of the field.
        length_m: distance over which it is alike.
    """

    def __init__(self, sigma_nt: float, length_m: float) -> None:
        pairs = [(length * length_m, size * sigma_nt) for length in _LENGTHS for size in _SIZES]
        self._fields: Array = np.array(pairs).T  # lengths, standard deviations
        self._logs: Array = np.full(len(pairs), -math.log(len(pairs)))
        self._lower: Array = np.zeros((len(pairs), _ROOM, _ROOM))
        self._white: Array = np.zeros((len(pairs), _ROOM))

    def start(self, seen: Measurements, beginning: Beginning) -> float:
        density = sum(self._take(seen, number).log_density for number in range(seen.count))
        entering = 0.0
        for length_m, sigma_nt in self._fields.T.tolist():
            shared_nt2 = beginning.shared_nt2
            if beginning.step_ne_m is not None:
                step_m = math.hypot(*beginning.step_ne_m)
                shared_nt2 += sigma_nt**2 * math.exp(-0.5 * (step_m / length_m) ** 2)
            total_nt2 = sigma_nt**2 + beginning.map_nt2
            entering += math.exp(_log_entering(beginning, total_nt2, total_nt2, shared_nt2))
        return density - math.log(entering / self._fields.shape[1])

    def step(self, seen: Measurements) -> Update:
        return self._take(seen, seen.count - 1)

    def _take(self, seen: Measurements, number: int) -> Update:
        if number == self._white.shape[1]:
            self._white = np.pad(self._white, ((0, 0), (0, number)))
            self._lower = np.pad(self._lower, ((0, 0), (0, number), (0, number)))
        north_m, east_m = seen.places()[:2]
        off, variance = np.empty((2, len(self._logs)))
        _add_to_fields(
            self._lower,
            self._white,
            (north_m[: number + 1], east_m[: number + 1]),
            self._fields,
            seen.covariances_nt2(number),
            seen.residual_nt(number),
            off,
            variance,
        )
        shares = np.exp(self._logs - self._logs.max())
        shares /= shares.sum()
        logs = -0.5 * (off**2 / variance + np.log(math.tau * variance))
        self._logs = self._logs + logs
        mean = float(shares @ off)
        spread = float(shares @ (off**2 + variance)) - mean * mean
        best = float(logs.max())
        density = best + math.log(float(shares @ np.exp(logs - best)))
        return Update(log_density=density, misfit=mean * mean / spread)


@kernel
def _add_to_fields(
    lower: Array,
    white: Array,
    places_m: tuple[Array, Array],
    fields: Array,
    covariances_nt2: Array,
    residual_nt: float,
    off: Array,
    variance: Array,
) -> None:
    """One more row of the Cholesky factors of the covariances of the measurements.

    Args:
        lower: (fields, room, room) those factors; changed in place.
        white: (fields, room) whitened measurements; changed in place.
        places_m: north and east (n,) of the measurements, the new one last.
        fields: (2, fields) lengths and standard deviations.
        covariances_nt2: (n,) of the errors of the new one.
        residual_nt: the measurement.
        off, variance: (fields,) out: of the measurement, given those before.
    """
    north_m, east_m = places_m
    new = north_m.size - 1
    for f in range(fields.shape[1]):
        square, size = 2.0 * fields[0, f] * fields[0, f], fields[1, f] * fields[1, f]
        row = lower[f, new]
        left, innovation = size + covariances_nt2[new], residual_nt
        for j in range(new):
            off_n, off_e = north_m[new] - north_m[j], east_m[new] - east_m[j]
            total = size * math.exp(-(off_n * off_n + off_e * off_e) / square) + covariances_nt2[j]
            for i in range(j):
                total -= row[i] * lower[f, j, i]
            row[j] = total / lower[f, j, j]
            left -= row[j] * row[j]
            innovation -= row[j] * white[f, j]
        left = max(left, 1e-9 * (size + covariances_nt2[new]))
        row[new] = math.sqrt(left)
        white[f, new] = innovation / row[new]
        off[f], variance[f] = innovation, left


def _log_entering(beginning: Beginning, then_nt2: float, now_nt2: float, shared_nt2: float) -> float:
    """Logarithm of the probability that the measurement before is within the threshold and the next one
    beyond it; without one before, that it is beyond.

    Args:
        beginning: the threshold and the noise.
        then_nt2, now_nt2: variances of what they measure, which has no mean.
        shared_nt2: its covariance.
    """
    threshold_nt = beginning.threshold_nt
    now_nt = math.sqrt(now_nt2 + beginning.white_nt2)
    if beginning.step_ne_m is None:
        return math.log(max(math.erfc(threshold_nt / (math.sqrt(2.0) * now_nt)), 1e-300))
    then_nt2 += beginning.white_nt2
    second = threshold_nt + now_nt * _BEYOND
    slope = shared_nt2 / (now_nt * now_nt)
    apart = math.sqrt(2.0 * max(1e-12 * then_nt2, then_nt2 - slope * shared_nt2))
    within = np.array(
        [
            0.5
            * (
                math.erf((threshold_nt - slope * value) / apart)
                - math.erf((-threshold_nt - slope * value) / apart)
            )
            for value in second.tolist()
        ]
    )
    density = np.exp(-0.5 * (second / now_nt) ** 2) / (now_nt * math.sqrt(math.tau)) * within
    return math.log(max(2.0 * now_nt * float(density @ _BEYOND_WEIGHTS), 1e-300))
