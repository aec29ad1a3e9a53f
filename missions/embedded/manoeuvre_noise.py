"""What the motion of an aircraft adds to its magnetometer's readings where it is not compensated.

The permanent and induced fields of the aircraft turn with it, so that roll, pitch and yaw in turbulence are
in the readings (Leliak 1961, IRE Transactions on Aerospace and Navigational Electronics). Each axis is a
damped oscillation that gusts excite; gusts come and go.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["manoeuvre_noise"]

Array = NDArray[np.float64]

_AXES: Final = ((2.5, 0.4, 0.8), (5.0, 0.3, 0.6))  # period s, damping ratio and share: pitch; roll and yaw
_GUST_S: Final = 15.0  # time in which the strength of gusts changes
_GUST_SPREAD: Final = 0.3  # standard deviation of its logarithm
_SETTLING_S: Final = 60.0


def manoeuvre_noise(rng: np.random.Generator, count: int, step_s: float) -> Array:
    """A stretch of noise (count,) whose root mean square is one in the long run.

    Args:
        rng: its random numbers.
        count: number of readings.
        step_s: time between them.
    """
    settling = round(_SETTLING_S / step_s)
    total = settling + count
    decay = math.exp(-step_s / _GUST_S)
    drive = math.sqrt(1.0 - decay * decay)
    gusts = np.empty(total)
    gusts[0] = rng.standard_normal()
    for k, value in enumerate(rng.standard_normal(total - 1).tolist()):
        gusts[k + 1] = decay * gusts[k] + drive * value
    # the mean of the square of a log-normal number is exp(2 s^2)
    strength = np.exp(_GUST_SPREAD * gusts - _GUST_SPREAD**2)
    found = np.zeros(total)
    for period_s, damping, share in _AXES:
        found += share * _oscillation(strength * rng.standard_normal(total), period_s, damping, step_s)
    return found[settling:]


def _oscillation(driven: Array, period_s: float, damping: float, step_s: float) -> Array:
    """A damped oscillation that white noise with unit variance drives, with unit variance itself."""
    pole = math.exp(-damping * math.tau / period_s * step_s)
    angle = math.tau / period_s * math.sqrt(1.0 - damping**2) * step_s
    first, second = 2.0 * pole * math.cos(angle), -pole * pole
    # variance of the autoregressive process of second order (Box and Jenkins, section 3.2)
    variance = (1.0 - second) / ((1.0 + second) * ((1.0 - second) ** 2 - first**2))
    out = np.zeros(len(driven))
    for k in range(2, len(driven)):
        out[k] = first * out[k - 1] + second * out[k - 2] + driven[k]
    scaled: Array = out / math.sqrt(variance)
    return scaled
