"""What a quaternion turns, written out once for the tests: nothing of it is the code's own."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray


def rotation_matrix(q: Any) -> NDArray[np.float64]:
    """r_a_from_b of the unit quaternion q_a_from_b (w x y z)."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def yaw_rad(q: Any) -> float:
    """Heading of q_ned_from_frd, clockwise from north."""
    w, x, y, z = q
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def pitch_rad(q: Any) -> float:
    """Pitch of q_ned_from_frd, nose up."""
    w, x, y, z = q
    return math.asin(2 * (w * y - z * x))
