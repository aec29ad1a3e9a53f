"""What a hypothesis about one anomaly takes and gives, and the hypotheses without a signature: the error of
the map, the edge of a tile of it, and a body of unknown shape. Those with a signature are in
`particle_hypotheses`.

The evidence of a hypothesis is the probability density of all measurements under it, given that they begin an
anomaly.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Before",
    "Control",
    "EdgeHypothesis",
    "Hypothesis",
    "Measurement",
    "ShapelessHypothesis",
    "Update",
    "log_beyond",
]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """A differential measurement.

    Attributes:
        residual_nt: reading less map, less level.
        white_nt2: variance of its white noise.
        height_m: height of the sensor above the map's home.
        course_rad: course of the vehicle.
    """

    residual_nt: float
    white_nt2: float
    height_m: float
    course_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Control:
    """The motion between two measurements, and what it does to the error of the map.

    Attributes:
        forward_m, right_m: displacement along and across the course at the earlier measurement.
        turn_rad: change of the course.
        forward_sigma_m, turn_sigma_rad: standard deviations of displacement and turn.
        decay, drive_nt2: factor of the error of the map, and the variance that is added.
    """

    forward_m: float
    right_m: float
    turn_rad: float
    forward_sigma_m: float
    turn_sigma_rad: float
    decay: float
    drive_nt2: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Before:
    """The last measurement within the threshold, before the first one beyond it.

    An anomaly begins where a track enters it: a vehicle that flies outwards, or along the edge, crosses the
    threshold seldom or never.

    Attributes:
        seen: the measurement.
        control: the motion from it to the first one beyond.
    """

    seen: Measurement
    control: Control


@dataclass(frozen=True, slots=True, kw_only=True)
class Update:
    """What a measurement says about a hypothesis.

    Attributes:
        log_density: logarithm of its density, given the measurements before it, 1/nT.
        confidence: the paper's (7), 0..1.
        misfit: square of the difference between measurement and prediction, over the variance that is
            predicted for it: one in the mean where the hypothesis is right, whatever came before.
    """

    log_density: float
    confidence: float
    misfit: float


class Hypothesis(Protocol):
    """One explanation of an anomaly."""

    def start(
        self, seen: Measurement, map_nt2: float, threshold_nt: float = 0.0, before: Before | None = None
    ) -> float:
        """Begin with the first measurement beyond a threshold.

        Args:
            seen: the measurement.
            map_nt2: variance of the error of the map.
            threshold_nt: there is an anomaly because the measurement is beyond it.
            before: the measurement before; None: there is none, or it was beyond the threshold too.

        Returns:
            Logarithm of the density of the measurements, given that they begin an anomaly.
        """

    def step(self, control: Control, seen: Measurement) -> Update:
        """One more measurement."""


class ShapelessHypothesis:
    """An anomaly without a signature: a Gauss-Markov process along the track, whose evidence is exact.

    Args:
        sigma_nt: standard deviation of the process.
        correlation_m: its correlation distance; None: that of the map's error, whose process this is.
    """

    def __init__(self, sigma_nt: float, correlation_m: float | None = None) -> None:
        self._sigma_nt2 = sigma_nt * sigma_nt
        self._correlation_m = correlation_m
        self._mean_nt = 0.0
        self._variance_nt2 = 0.0

    def start(
        self, seen: Measurement, map_nt2: float, threshold_nt: float = 0.0, before: Before | None = None
    ) -> float:
        variance_nt2 = map_nt2 if self._correlation_m is None else self._sigma_nt2
        self._mean_nt, self._variance_nt2 = 0.0, variance_nt2
        if before is None:
            beyond = log_beyond(threshold_nt, np.array([math.sqrt(variance_nt2 + seen.white_nt2)]))
            return self._update(seen).log_density - beyond
        total_nt = math.sqrt(variance_nt2 + before.seen.white_nt2)
        shared_nt2 = self._decay(before.control)[0] * variance_nt2
        beginning = _log_entering(threshold_nt, total_nt, total_nt, shared_nt2)
        first = self._update(before.seen).log_density
        return first + self.step(before.control, seen).log_density - beginning

    def step(self, control: Control, seen: Measurement) -> Update:
        decay, drive_nt2 = self._decay(control)
        self._mean_nt *= decay
        self._variance_nt2 = decay * decay * self._variance_nt2 + drive_nt2
        return self._update(seen)

    def _decay(self, control: Control) -> tuple[float, float]:
        """Factor of the process since the last measurement, and the variance that is added."""
        if self._correlation_m is None:
            return control.decay, control.drive_nt2
        decay = math.exp(-math.hypot(control.forward_m, control.right_m) / self._correlation_m)
        return decay, (1.0 - decay * decay) * self._sigma_nt2

    def _update(self, seen: Measurement) -> Update:
        total_nt2 = self._variance_nt2 + seen.white_nt2
        residual_nt = seen.residual_nt - self._mean_nt
        fit = residual_nt * residual_nt / total_nt2
        gain = self._variance_nt2 / total_nt2
        self._mean_nt += gain * residual_nt
        self._variance_nt2 *= 1.0 - gain
        return _update_of(fit, total_nt2)


class EdgeHypothesis:
    """The edge of a tile of the map, or of a line that is levelled wrongly: an offset that begins with the
    anomaly and stays, beside the error of the map. Its evidence is exact.

    Args:
        sigma_nt: standard deviation of the offset.
    """

    def __init__(self, sigma_nt: float) -> None:
        self._sigma_nt2 = sigma_nt * sigma_nt
        self._mean_nt: Array = np.zeros(2)  # offset, error of the map
        self._covariance_nt2: Array = np.zeros((2, 2))

    def start(
        self, seen: Measurement, map_nt2: float, threshold_nt: float = 0.0, before: Before | None = None
    ) -> float:
        self._mean_nt = np.zeros(2)
        self._covariance_nt2 = np.diag((self._sigma_nt2, map_nt2))
        now_nt = math.sqrt(self._sigma_nt2 + map_nt2 + seen.white_nt2)
        if before is None:
            return self._update(seen, 1.0).log_density - log_beyond(threshold_nt, np.array([now_nt]))
        then_nt = math.sqrt(map_nt2 + before.seen.white_nt2)
        beginning = _log_entering(threshold_nt, then_nt, now_nt, before.control.decay * map_nt2)
        first = self._update(before.seen, 0.0).log_density
        return first + self.step(before.control, seen).log_density - beginning

    def step(self, control: Control, seen: Measurement) -> Update:
        decays = np.array([1.0, control.decay])
        self._mean_nt *= decays
        self._covariance_nt2 *= np.outer(decays, decays)
        self._covariance_nt2[1, 1] += control.drive_nt2
        return self._update(seen, 1.0)

    def _update(self, seen: Measurement, offset: float) -> Update:
        """Correct by a measurement behind the edge (offset 1) or before it (0)."""
        row = np.array([offset, 1.0])
        gain = self._covariance_nt2 @ row
        total_nt2 = float(row @ gain) + seen.white_nt2
        residual_nt = seen.residual_nt - float(row @ self._mean_nt)
        self._mean_nt += gain * (residual_nt / total_nt2)
        self._covariance_nt2 -= np.outer(gain, gain) / total_nt2
        return _update_of(residual_nt * residual_nt / total_nt2, total_nt2)


def _update_of(fit: float, total_nt2: float) -> Update:
    """What a measurement says about a hypothesis that predicts a normal number."""
    return Update(
        log_density=-0.5 * (fit + math.log(math.tau * total_nt2)), confidence=math.exp(-0.5 * fit), misfit=fit
    )


def log_beyond(threshold_nt: float, sigmas_nt: Array) -> float:
    """Logarithm of the mean probability that normal numbers without a mean are beyond a threshold."""
    scaled = threshold_nt / math.sqrt(2.0) / sigmas_nt
    shares = [math.erfc(value) for value in scaled.tolist()]
    return math.log(max(sum(shares) / len(shares), 1e-300))


def _log_entering(threshold_nt: float, then_nt: float, now_nt: float, shared_nt2: float) -> float:
    """Logarithm of the probability that the first of two normal numbers without a mean is within a threshold
    and the second one beyond it.

    Args:
        threshold_nt: the threshold.
        then_nt, now_nt: their standard deviations.
        shared_nt2: their covariance.
    """
    second = threshold_nt + now_nt * np.linspace(0.0, 8.0, 161)
    slope = shared_nt2 / (now_nt * now_nt)
    apart = math.sqrt(max(1e-12 * then_nt * then_nt, then_nt * then_nt - slope * shared_nt2)) * math.sqrt(2.0)
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
    return math.log(max(2.0 * float(np.trapezoid(density, second)), 1e-300))
