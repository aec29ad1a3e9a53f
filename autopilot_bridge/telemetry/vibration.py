"""Vibration metrics as in VIBRATION: the level of the accelerations above 5 Hz."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.kernels import bound, kernel

Array = NDArray[np.float64]


@kernel
def _update(accel_frd: Array, slow: Array, level: Array, blend_slow: float, blend_level: float) -> None:
    for i in range(3):
        if not math.isfinite(accel_frd[i]):
            continue
        slow[i] += blend_slow * (accel_frd[i] - slow[i])
        fast = accel_frd[i] - slow[i]
        level[i] += blend_level * (fast * fast - level[i])


class VibrationMeter:
    """High-passed accelerometer RMS per body axis (ArduPilot: 5 Hz high pass, 2 Hz smoothing).

    Args:
        accel_frd_m_s2: newest accelerometer sample, shape (3,), written in place by the sensor; values that
            are not finite are ignored.
        rate_hz: calls of `update` per second.

    Attributes:
        update: takes the newest sample.
    """

    def __init__(self, accel_frd_m_s2: Array, *, rate_hz: float) -> None:
        self._level = np.zeros(3)
        blend_slow = min(1.0, 2.0 * math.pi * 5.0 / rate_hz)
        blend_level = min(1.0, 2.0 * math.pi * 2.0 / rate_hz)
        slow = np.array([0.0, 0.0, -GRAVITY_M_S2])
        self.update: Callable[[], None] = bound(
            _update, accel_frd_m_s2, slow, self._level, blend_slow, blend_level
        )

    @property
    def rms_m_s2(self) -> tuple[float, float, float]:
        """RMS per axis (x, y, z)."""
        x, y, z = np.sqrt(self._level).tolist()
        return x, y, z
