"""Euler angles of arrays of quaternions."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def euler_from_quaternions(q: NDArray[np.floating]) -> tuple[Array, Array, Array]:
    """Roll, pitch, yaw (ZYX, rad) of Hamilton quaternions q_ned_from_frd, (n, 4), w first."""
    w, x, y, z = (q[:, index].astype(np.float64) for index in range(4))
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, pitch, yaw
