"""Vibration metrics as VIBRATION reports them: the level of what the accelerometers feel faster than 5 Hz."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit(cache=True)
def _update(accel_frd: Array, slow: Array, level: Array, blend_slow: float, blend_level: float) -> None:
    for i in range(3):
        slow[i] += blend_slow * (accel_frd[i] - slow[i])
        fast = accel_frd[i] - slow[i]
        level[i] += blend_level * (fast * fast - level[i])


class VibrationMeter:
    """High-passed accelerometer RMS per body axis (ArduPilot's definition: 5 Hz high pass, 2 Hz smoothing)."""

    __slots__ = ("_level", "_slow")

    def __init__(self) -> None:
        self._slow = np.array([0.0, 0.0, -9.80665])
        self._level = np.zeros(3)

    def update(self, accel_frd_m_s2: Array, dt_s: float) -> None:
        """Take one accelerometer sample (shape (3,), m/s^2)."""
        if np.isfinite(accel_frd_m_s2).all():
            slow = min(1.0, dt_s * 2.0 * np.pi * 5.0)
            level = min(1.0, dt_s * 2.0 * np.pi * 2.0)
            _update(accel_frd_m_s2, self._slow, self._level, slow, level)

    @property
    def rms_m_s2(self) -> tuple[float, float, float]:
        """RMS per axis (x, y, z)."""
        x, y, z = np.sqrt(self._level).tolist()
        return x, y, z
