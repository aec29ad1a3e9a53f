"""The measurements of an anomaly, and the errors that they have in common.

The error of a published map is interpolated between the lines of its survey, so it is smooth: its covariance
is that of a Matern process over the plane with one derivative (Rasmussen and Williams 2006, section 4.2.1).
Measurements along a track share most of it. Those of another vehicle or another pass don't, as the level is
another one, which is taken from each. The covariance does not depend on the source: one factor of it whitens
the measurements for every hypothesis.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.samples import Sample
from estimators.occupancy.detection import MapError

__all__ = ["AT_CORRELATION", "Measurements"]

Array = NDArray[np.float64]

_ROOM: Final = 64
_ONE_RUN_S: Final = 20.0  # time without measurements after which the level is another one
AT_CORRELATION: Final = 2.1462
"""(1 + x) exp(-x) = 1/e: the covariance falls to 1/e at the stated correlation distance."""
_LEAST_VARIANCE: Final = 1e-9  # of a measurement that says the same as others, over its own
_HALF_LOG_2PI: Final = 0.5 * math.log(math.tau)


class Measurements:
    """Whitened measurements, in the order of time.

    Attributes:
        count: their number.
        height_m: of the first one beyond the threshold, above the map's home.
        time_s: of that one.
        course_rad: course of the vehicle there.

    Args:
        map_error: of the published map.
        first: the first measurement beyond the threshold.
    """

    def __init__(self, map_error: MapError, first: Sample) -> None:
        self.count = 0
        self.height_m, self.time_s, self.course_rad = first.height_m, first.time_us * 1e-6, first.course_rad
        self._map_error = map_error
        self._runs: dict[int, tuple[float, float]] = {}  # number and newest time of each vehicle's run
        # north, east, height, time, whitened measurement, logarithm of its scale, measurement, run
        self._rows: Array = np.empty((8, _ROOM))
        self._covariance: Array = np.zeros((_ROOM, _ROOM))
        self._lower: Array = np.zeros((_ROOM, _ROOM))
        self._inverse: Array = np.zeros((_ROOM, _ROOM))

    def add(self, sample: Sample, white_nt2: float) -> None:
        """One more measurement.

        Args:
            sample: the measurement.
            white_nt2: variance of what it shares with no other one.
        """
        k = self.count
        if k == self._rows.shape[1]:
            self._rows = np.pad(self._rows, ((0, 0), (0, k)))
            self._covariance, self._lower, self._inverse = (
                np.pad(matrix, ((0, k), (0, k))) for matrix in (self._covariance, self._lower, self._inverse)
            )
        north_m, east_m = self._rows[0, :k], self._rows[1, :k]
        time_s = sample.time_us * 1e-6
        run, newest_s = self._runs.get(sample.vehicle, (math.nan, -math.inf))
        if time_s - newest_s > _ONE_RUN_S:
            run = float(k)
        self._runs[sample.vehicle] = run, time_s
        shared = self.map_covariance_nt2(np.hypot(north_m - sample.north_m, east_m - sample.east_m))
        shared *= self._rows[7, :k] == run
        total_nt2 = self._map_error.sigma_nt**2 + white_nt2
        row = self._inverse[:k, :k] @ shared
        scale = math.sqrt(max(total_nt2 - float(row @ row), _LEAST_VARIANCE * total_nt2))
        self._lower[k, :k], self._lower[k, k] = row, scale
        self._inverse[k, :k], self._inverse[k, k] = -(row @ self._inverse[:k, :k]) / scale, 1.0 / scale
        white = (sample.residual_nt - float(row @ self._rows[4, :k])) / scale
        self._rows[:, k] = (
            *(sample.north_m, sample.east_m, sample.height_m, time_s - self.time_s),
            *(white, math.log(scale), sample.residual_nt, run),
        )
        self._covariance[k, :k], self._covariance[k, k] = shared, total_nt2
        self.count = k + 1

    def map_covariance_nt2(self, apart_m: Array) -> Array:
        """Covariance of the errors of the map at places so far apart."""
        scaled = AT_CORRELATION / self._map_error.correlation_m * apart_m
        found: Array = self._map_error.sigma_nt**2 * (1.0 + scaled) * np.exp(-scaled)
        return found

    def places(self) -> Array:
        """(4, count) north, east, height, and time since the first one beyond the threshold."""
        return self._rows[:4, : self.count]

    def residual_nt(self, number: int) -> float:
        """Reading less map, less level."""
        return float(self._rows[6, number])

    def covariances_nt2(self, number: int) -> Array:
        """(number + 1,) of a measurement with those before it and, at the end, itself."""
        return self._covariance[number, : number + 1]

    @property
    def white(self) -> Array:
        """(count,) whitened measurements."""
        return self._rows[4, : self.count]

    def log_density(self, since: int = 0) -> float:
        """Logarithm of the density of the measurements from one on, given those before it, if there is only
        the error of the map.
        """
        rows = self._rows[4:6, since : self.count]
        return float(-0.5 * rows[0] @ rows[0] - rows[1].sum()) - _HALF_LOG_2PI * (self.count - since)

    def whitened(self, signals: Array) -> Array:
        """Signals at the first measurements (n, ...), whitened as those are."""
        count = len(signals)
        flat = self._inverse[:count, :count] @ signals.reshape(count, -1)
        return flat.reshape(signals.shape)

    def whitened_next(self, signals: Array, before: Array) -> Array:
        """(...) signals at the newest measurement, given the whitened ones (count - 1, ...) before."""
        k = self.count - 1
        shared = (self._lower[k, :k] @ before.reshape(k, -1)).reshape(signals.shape)
        found: Array = (signals - shared) / self._lower[k, k]
        return found
