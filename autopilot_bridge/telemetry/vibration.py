"""Vibration metrics as VIBRATION reports them: the level of what the accelerometers feel faster than 5 Hz."""

import math

import numpy as np
from numpy.typing import NDArray

from flightsim.kernels import compiled_for, kernel

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
        accel_frd_m_s2: newest accelerometer sample, shape (3,), written in place by the sensor; what is not a
            finite number is passed over.
        rate_hz: calls of `update` per second.
    """

    __slots__ = ("_accel", "_blend_level", "_blend_slow", "_level", "_slow", "_take")

    def __init__(self, accel_frd_m_s2: Array, *, rate_hz: float) -> None:
        self._accel = accel_frd_m_s2
        self._slow = np.array([0.0, 0.0, -9.80665])
        self._level = np.zeros(3)
        self._blend_slow = min(1.0, 2.0 * math.pi * 5.0 / rate_hz)
        self._blend_level = min(1.0, 2.0 * math.pi * 2.0 / rate_hz)
        self._take = compiled_for(_update, accel_frd_m_s2, self._slow, self._level, 0.0, 0.0)

    def update(self) -> None:
        """Take the newest sample."""
        self._take(self._accel, self._slow, self._level, self._blend_slow, self._blend_level)

    @property
    def rms_m_s2(self) -> tuple[float, float, float]:
        """RMS per axis (x, y, z)."""
        x, y, z = np.sqrt(self._level).tolist()
        return x, y, z
