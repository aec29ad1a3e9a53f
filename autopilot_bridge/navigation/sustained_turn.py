"""The effect of a sustained turn on the gyro biases of a fixed wing.

An aircraft can turn for minutes, and its gyro's scale and cross-axis errors then act as a bias: the filter
correctly learns this bias, and it is wrong as soon as the turn ends. When the turn rate, averaged over some
seconds, has changed, the variance of the gyro biases is therefore increased by the change multiplied by those
errors. Short rolls are covered by their angle in the covariance prediction.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.solution import Solution
from autopilot_bridge.navigation.states import GYRO_BIAS, SUM_GYRO, SUM_GYRO_TIME, X_GYRO_BIAS

_TIME_S: Final = 2.0
_STEP_RAD_S: Final = 0.05
_GRADUAL: Final = 2.0  # a rate that changes in steps changes all the same way: more than the steps' root sum


class SustainedTurn:
    """Follows the turn rate and widens the gyro biases of a `Solution`."""

    def __init__(self, parameters: NavigationParameters, *, solution: Solution) -> None:
        self._parameters = parameters
        self._solution = solution
        self._mean: NDArray[np.float64] = np.zeros(3)
        self._reference: NDArray[np.float64] = np.zeros(3)
        self._sum: NDArray[np.float64] = np.zeros(3)
        self.restart()

    def set_parameters(self, parameters: NavigationParameters) -> None:
        """New tuning for the turns to come."""
        self._parameters = parameters

    def restart(self) -> None:
        """Straight on."""
        self._mean[:] = 0.0
        self._reference[:] = 0.0
        self._sum[:] = 0.0
        self._sum_time_s = 0.0

    def update(self) -> None:
        """Take the mean rate since the last call; call it a few times a second."""
        core, p = self._solution.core, self._parameters
        newest, time_s = core[SUM_GYRO : SUM_GYRO + 3], float(core[SUM_GYRO_TIME])
        elapsed_s = time_s - self._sum_time_s
        if elapsed_s > 0.0:
            rate = (newest - self._sum) / elapsed_s - core[X_GYRO_BIAS : X_GYRO_BIAS + 3]
            self._mean += (rate - self._mean) * min(1.0, elapsed_s / _TIME_S)
        self._sum[:] = newest
        self._sum_time_s = time_s
        change = self._mean - self._reference
        squares = change * change
        if squares.max() < _STEP_RAD_S**2:
            return
        self._reference[:] = self._mean
        cross = p.gyro_cross_axis_error**2
        variances = _GRADUAL**2 * (cross * squares.sum() + (p.gyro_scale_error**2 - cross) * squares)
        for i in range(3):
            self._solution.p[GYRO_BIAS + i, GYRO_BIAS + i] += variances[i]
