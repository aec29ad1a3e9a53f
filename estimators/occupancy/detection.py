"""Detection of anomalies in magnetometer readings, and the probability that a passing searcher detects a
target.

Source: Lum, Rysdyk and Pongpunwattana 2005, sections III-C (an anomaly is a value that exceeds the noise)
and IV-B (detection model); docs/papers.md.
"""

import math
from collections import deque
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from estimators.occupancy.significance import LEAST_RATIO, signal_to_noise

Array = NDArray[np.float64]

_SQRT_2PI: Final = math.sqrt(2.0 * math.pi)
_QUADRATURE: Final = np.polynomial.legendre.leggauss(8)
# of the threshold: an anomaly ends below it, so that noise near the threshold does not divide it
_ENDS_AT: Final = 0.5
_SIGMAS: Final = 3.0  # standard deviations of map and noise together; the threshold is never lower
_POINT_M: Final = 10.0  # length of track over which readings are averaged for the test of a pass
_PASS_POINTS: Final = 80


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionModel:
    """Probability of detecting a target while flying by, p(D | searcher, target) of equation 10.

    Detection is a hazard along the track that falls off with distance as a Gaussian, so that a pass may be
    divided into stretches of any length: the product of their probabilities of a miss is that of the whole
    pass.

    Attributes:
        probability_overhead: probability to detect a target in one straight pass directly over it, 0..1.
        range_m: standard deviation of the fall-off with distance.

    Raises:
        EstimatorError: a value is out of its range.
    """

    probability_overhead: float = 0.95
    range_m: float = 60.0

    def __post_init__(self) -> None:
        if not 0.0 < self.probability_overhead < 1.0:
            raise EstimatorError(
                f"`detection_probability` {self.probability_overhead:g} is not between 0 and 1"
            )
        if not (math.isfinite(self.range_m) and self.range_m > 0.0):
            raise EstimatorError(
                f"`detection_range_m` {self.range_m:g} m is not possible; ask for more than 0"
            )

    def probability(
        self, north_m: Array, east_m: Array, start_ne_m: tuple[float, float], end_ne_m: tuple[float, float]
    ) -> Array:
        """Probability of detecting targets from a straight stretch of track.

        Args:
            north_m, east_m: positions of the targets; their shapes must broadcast.
            start_ne_m, end_ne_m: ends of the stretch.

        Returns:
            Probabilities, in the broadcast shape.
        """
        along_n, along_e = end_ne_m[0] - start_ne_m[0], end_ne_m[1] - start_ne_m[1]
        length_m = math.hypot(along_n, along_e)
        exposure = np.zeros(np.broadcast_shapes(np.shape(north_m), np.shape(east_m)))
        if length_m == 0.0:
            return exposure
        # pieces no longer than the fall-off, each integrated with the Gauss-Legendre rule
        pieces = max(1, math.ceil(length_m / (2.0 * self.range_m)))
        nodes, weights = (each.reshape(-1, *[1] * exposure.ndim) for each in _QUADRATURE)
        for piece in range(pieces):
            shares = (piece + 0.5 * (1.0 + nodes)) / pieces
            distance2 = (north_m - start_ne_m[0] - shares * along_n) ** 2 + (
                east_m - start_ne_m[1] - shares * along_e
            ) ** 2
            parts = 0.5 * weights / pieces * length_m * np.exp(-0.5 * distance2 / self.range_m**2)
            for part in parts:
                exposure += part
        hazard_1_m = -math.log1p(-self.probability_overhead) / (self.range_m * _SQRT_2PI)
        return -np.expm1(-hazard_1_m * exposure)


@dataclass(frozen=True, slots=True, kw_only=True)
class MapError:
    """The error that a published map states.

    Attributes:
        sigma_nt: standard deviation; 0: the map is assumed to be exact.
        correlation_m: correlation distance of the error.
    """

    sigma_nt: float = 0.0
    correlation_m: float = 100.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.sigma_nt) and self.sigma_nt >= 0.0):
            raise EstimatorError(f"`map_error_nt` {self.sigma_nt:g} nT is not possible; ask for 0 or more")
        if not (math.isfinite(self.correlation_m) and self.correlation_m > 0.0):
            raise EstimatorError(
                f"the map's error is alike over {self.correlation_m:g} m; accepted: more than 0"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Anomaly:
    """A place where the field differs from the map by more than the threshold.

    Attributes:
        time_us: vehicle time of the greatest difference.
        north_m, east_m: place of that difference.
        peak_nt: the difference there, with its sign.
        samples: number of readings beyond the threshold.
        profile: (north m, east m, difference nT) of each reading from the first to the last beyond the
            threshold.
    """

    time_us: int
    north_m: float
    east_m: float
    peak_nt: float
    samples: int
    profile: tuple[tuple[float, float, float], ...] = field(default=(), repr=False)


class AnomalyDetector:
    """Detects anomalies by a threshold on the differential measurement (reading minus map) and a test of the
    whole pass.

    An anomaly begins beyond the threshold, or beyond the error of map and noise if that is larger, and ends
    below half of it. Then all readings of the pass must show a bump that the map's error doesn't explain
    (`significance`). Slow differences (bias of the sensor, daily variation, offset of the map) are tracked by
    a running level, which is not updated during an anomaly. An anomaly that lasts too long is not a target
    but a wrong level, and the level is restarted. Readings that aren't finite, or that come late, are dropped
    and counted.

    Attributes:
        residual_nt: newest differential measurement, level removed; NaN before the first.
        anomalous: whether an anomaly is in progress.
        dropped: number of unusable readings.
        insignificant: number of anomalies that may be errors of the map.
        restarts: number of levels that turned out to be wrong, because an anomaly lasted too long.
    """

    def __init__(
        self,
        *,
        threshold_nt: float,
        noise_nt: float = 0.5,
        map_error: MapError | None = None,
        least_samples: int = 2,
        level_time_s: float = 20.0,
        longest_s: float = 40.0,
    ) -> None:
        """Initialise the detector.

        Args:
            threshold_nt: smallest difference of an anomaly; several standard deviations of the noise.
            noise_nt: standard deviation of a reading.
            map_error: error of the map; None: no error.
            least_samples: smallest number of readings beyond the threshold in an anomaly, so that a single
                outlier is not one.
            level_time_s: time constant of the running level.
            longest_s: longest duration of an anomaly; a target is passed in less time.

        Raises:
            EstimatorError: a value is out of its range.
        """
        if not (math.isfinite(threshold_nt) and threshold_nt > 0.0):
            raise EstimatorError(f"`threshold_nt` {threshold_nt:g} nT is not possible; ask for more than 0")
        if least_samples < 1:
            raise EstimatorError(f"{least_samples} samples make no anomaly; at least 1 is needed")
        self.residual_nt = math.nan
        self.dropped = 0
        self.insignificant = 0
        self.restarts = 0
        self._map_error = map_error or MapError()
        self._noise_nt = noise_nt
        unexplained_nt = _SIGMAS * math.hypot(noise_nt, self._map_error.sigma_nt)
        self._threshold_nt = max(threshold_nt, unexplained_nt if self._map_error.sigma_nt else 0.0)
        self._points: deque[list[float]] = deque(maxlen=_PASS_POINTS)  # sums of n, e, difference; count
        self._least_samples = least_samples
        self._level_time_us = level_time_s * 1e6
        self._longest_us = longest_s * 1e6
        self._level_nt = math.nan
        self._level_began_us = -1
        self._level_readings = 0
        self._time_us = -1
        self._began_us = -1
        self._peak: Anomaly | None = None
        self._profile: list[tuple[float, float, float]] = []

    @property
    def anomalous(self) -> bool:
        return self._peak is not None

    @property
    def level_doubtful(self) -> bool:
        """Whether an anomaly is in progress that began before the level had settled: the level may be wrong
        because its first readings were near a source.
        """
        return self._peak is not None and self._began_us - self._level_began_us < self._level_time_us

    def update(
        self, time_us: int, reading_nt: float, map_nt: float, north_m: float, east_m: float
    ) -> Anomaly | None:
        """Process one reading and the map's value at its place.

        Returns:
            The anomaly that just ended, or None.
        """
        difference_nt = reading_nt - map_nt
        if time_us <= self._time_us or not math.isfinite(difference_nt + north_m + east_m):
            self.dropped += 1
            return None
        self._add_point(north_m, east_m, difference_nt)
        if self._peak is not None and time_us - self._began_us > self._longest_us:
            self._peak, self._level_nt = None, math.nan
            self.restarts += 1
        if math.isnan(self._level_nt):
            self._level_nt, self._level_began_us = difference_nt, time_us
            self._level_readings = 0
        elapsed_us = 0 if self._time_us < 0 else time_us - self._time_us
        self._time_us = time_us
        residual_nt = self.residual_nt = difference_nt - self._level_nt
        size_nt = abs(residual_nt)
        if size_nt > self._threshold_nt or (
            self._peak is not None and size_nt > _ENDS_AT * self._threshold_nt
        ):
            if self._peak is None:
                self._began_us = time_us
                self._profile = []
            self._profile.append((north_m, east_m, residual_nt))
            self._peak = self._grown(time_us, residual_nt, north_m, east_m)
            return None
        ended, self._peak = self._peak, None
        # the mean of all readings at first: the noise of the first one would be in the level for long
        self._level_readings += 1
        share = max(1.0 / self._level_readings, elapsed_us / self._level_time_us)
        self._level_nt += residual_nt * min(1.0, share)
        if ended is None or ended.samples < self._least_samples:
            return None
        if not self._significant():
            self.insignificant += 1
            return None
        return replace(ended, profile=tuple(self._profile))

    def _add_point(self, north_m: float, east_m: float, difference_nt: float) -> None:
        """Add a reading to the pass, in its newest point or in a new one."""
        if self._points:
            newest = self._points[-1]
            if math.hypot(north_m - newest[0] / newest[3], east_m - newest[1] / newest[3]) < _POINT_M:
                for k, value in enumerate((north_m, east_m, difference_nt, 1.0)):
                    newest[k] += value
                return
        self._points.append([north_m, east_m, difference_nt, 1.0])

    def _significant(self) -> bool:
        """Whether the pass shows more than the map's error explains."""
        error = self._map_error
        if error.sigma_nt == 0.0:
            return True
        sums = np.array(self._points)
        places = sums[:, :3] / sums[:, 3:]
        ratio = signal_to_noise(
            places[:, 0],
            places[:, 1],
            places[:, 2],
            noise_nt=self._noise_nt,
            map_error_nt=error.sigma_nt,
            correlation_m=error.correlation_m,
        )
        return ratio >= LEAST_RATIO

    def _grown(self, time_us: int, residual_nt: float, north_m: float, east_m: float) -> Anomaly:
        """The present anomaly with one more reading."""
        peak = self._peak
        beyond = int(abs(residual_nt) > self._threshold_nt)
        if peak is None or abs(residual_nt) > abs(peak.peak_nt):
            samples = beyond if peak is None else peak.samples + beyond
            return Anomaly(
                time_us=time_us, north_m=north_m, east_m=east_m, peak_nt=residual_nt, samples=samples
            )
        return replace(peak, samples=peak.samples + beyond)
