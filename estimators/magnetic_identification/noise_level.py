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
        self._mean_nt: Array = np.zeros(levels)
        self._variance_nt2: Array = np.full(levels, map_error.sigma_nt**2)
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
            self._mean_nt,
            self._variance_nt2,
            self._logs[int(abs(turn_rad) > _TURNING_RAD)],
            residual_nt,
            stated_nt2,
            math.exp(-moved_m / error.correlation_m),
            error.sigma_nt**2,
        )
        self._expected_nt2 = (_expected(self._logs, 0), _expected(self._logs, 1))


@kernel
def _weigh_levels(
    mean_nt: Array,
    variance_nt2: Array,
    logs: Array,
    residual_nt: float,
    stated_nt2: float,
    decay: float,
    map_nt2: float,
) -> None:
    """Add a measurement to the evidence of each level, by a Kalman filter of the error of the map for each.

    Args:
        mean_nt, variance_nt2: (levels,) of the error of the map; changed in place.
        logs: (levels,) logarithms of the evidences; changed in place.
        residual_nt, stated_nt2: as of `NoiseLevel.take`.
        decay: factor of the error of the map since the last measurement.
        map_nt2: its variance.
    """
    for k in range(mean_nt.size):
        mean = decay * mean_nt[k]
        variance = decay * decay * variance_nt2[k] + (1.0 - decay * decay) * map_nt2
        total = variance + stated_nt2 + _EXCESS_NT[k] * _EXCESS_NT[k]
        off = residual_nt - mean
        logs[k] = math.exp(-1.0 / _REMEMBERED) * logs[k] - 0.5 * (off * off / total + math.log(total))
        mean_nt[k] = mean + variance / total * off
        variance_nt2[k] = variance * (1.0 - variance / total)


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
