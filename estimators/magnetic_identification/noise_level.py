"""The noise of a vehicle's measurements, estimated where there is no anomaly.

A magnetometer in flight is noisier than on its bench: what the aircraft's motion adds depends on the gusts of
the day and on whether the aircraft turns. Every measurement on quiet track is compared with what levels of
noise, from the stated one upwards, predict beside the error of the map. The levels' probabilities follow from
their evidences, which are forgotten over a minute, separately for straight and for turning flight.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.measurements import AT_CORRELATION
from estimators.occupancy.detection import MapError
from flightsim.foundation.kernels import kernel

__all__ = ["NoiseLevel"]

Array = NDArray[np.float64]

_EXCESS_NT: Final = np.array(
    [0.0, 0.3, 0.6, 1.0, 1.5, 2.2, 3.3, 5.0]
)  # standard deviations beyond the stated
_LOG_PRIOR: Final = math.log(0.75) * np.arange(len(_EXCESS_NT))
_REMEMBERED: Final = 60.0  # measurements
_TURNING_RAD: Final = 0.05  # change of course in a measurement
_OF_STRAIGHT: Final = 0.25  # weight of the evidence of straight flight for turning flight


class NoiseLevel:
    """Variance of the noise of a vehicle's measurements beyond the stated one.

    Args:
        map_error: of the published map.
    """

    def __init__(self, map_error: MapError) -> None:
        self._map_error = map_error
        levels = len(_EXCESS_NT)
        # error of the map and its slope, over the rate of the process: alike in size
        self._means_nt: Array = np.zeros((2, levels))
        self._covariances_nt2: Array = np.zeros((3, levels))  # of the error, of both, of the slope
        self._covariances_nt2[::2] = map_error.sigma_nt**2
        self._logs: Array = np.zeros((2, levels))
        self._expected_nt2: tuple[float, float] = (_expected(self._logs, 0), _expected(self._logs, 1))

    def excess_nt2(self, turn_rad: float) -> float:
        """Expected variance beyond the stated one.

        Args:
            turn_rad: change of the course since the measurement before.
        """
        return self._expected_nt2[int(abs(turn_rad) > _TURNING_RAD)]

    def take(self, residual_nt: float, stated_nt2: float, moved_m: float, turn_rad: float) -> None:
        """One measurement on quiet track.

        Args:
            residual_nt: reading less map, less level.
            stated_nt2: its stated variance.
            moved_m: distance from the measurement before.
            turn_rad: change of the course since then.
        """
        error = self._map_error
        _weigh_levels(
            self._means_nt,
            self._covariances_nt2,
            self._logs[int(abs(turn_rad) > _TURNING_RAD)],
            residual_nt,
            stated_nt2,
            AT_CORRELATION * moved_m / error.correlation_m,
            error.sigma_nt**2,
        )
        self._expected_nt2 = (_expected(self._logs, 0), _expected(self._logs, 1))


@kernel
def _weigh_levels(
    means_nt: Array,
    covariances_nt2: Array,
    logs: Array,
    residual_nt: float,
    stated_nt2: float,
    moved: float,
    map_nt2: float,
) -> None:
    """Add a measurement to the evidence of each level, by a Kalman filter of the error of the map for each.

    Args:
        means_nt: (2, levels) of the error of the map and its slope; changed in place.
        covariances_nt2: (3, levels) likewise: variance of the error, covariance, variance of the slope.
        logs: (levels,) logarithms of the evidences; changed in place.
        residual_nt, stated_nt2: as of `NoiseLevel.take`.
        moved: distance since the last measurement, over the scale of the error of the map.
        map_nt2: its variance.
    """
    # transition of a Matern process with one derivative (Hartikainen and Sarkka 2010)
    decay = math.exp(-moved)
    aa, ab, ba, bb = decay * (1.0 + moved), decay * moved, -decay * moved, decay * (1.0 - moved)
    for k in range(means_nt.shape[1]):
        error, slope = means_nt[0, k], means_nt[1, k]
        # beyond the variance of the process, which stays as it is
        ee, es, ss = covariances_nt2[0, k] - map_nt2, covariances_nt2[1, k], covariances_nt2[2, k] - map_nt2
        mean, slope = aa * error + ab * slope, ba * error + bb * slope
        variance = map_nt2 + aa * aa * ee + 2.0 * aa * ab * es + ab * ab * ss
        shared = aa * ba * ee + (aa * bb + ab * ba) * es + ab * bb * ss
        of_slope = map_nt2 + ba * ba * ee + 2.0 * ba * bb * es + bb * bb * ss
        total = variance + stated_nt2 + _EXCESS_NT[k] * _EXCESS_NT[k]
        off = residual_nt - mean
        logs[k] = math.exp(-1.0 / _REMEMBERED) * logs[k] - 0.5 * (off * off / total + math.log(total))
        means_nt[0, k], means_nt[1, k] = mean + variance / total * off, slope + shared / total * off
        covariances_nt2[0, k] = variance * (1.0 - variance / total)
        covariances_nt2[1, k] = shared * (1.0 - variance / total)
        covariances_nt2[2, k] = of_slope - shared * shared / total


@kernel
def _expected(logs: Array, turning: int) -> float:
    """Mean variance of the levels, nT^2.

    Args:
        logs: (2, levels) logarithms of the evidences in straight and in turning flight.
        turning: 0 or 1: in which.
    """
    best = -1e300
    for k in range(_EXCESS_NT.size):
        best = max(best, _LOG_PRIOR[k] + logs[turning, k] + turning * _OF_STRAIGHT * logs[0, k])
    total = summed = 0.0
    for k in range(_EXCESS_NT.size):
        share = math.exp(_LOG_PRIOR[k] + logs[turning, k] + turning * _OF_STRAIGHT * logs[0, k] - best)
        total += share
        summed += share * _EXCESS_NT[k] * _EXCESS_NT[k]
    return summed / total
