"""Rotation matrices for pictures."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.rotations import rotate


def rotation_of(q: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation matrix (3, 3) of a quaternion (w, x, y, z)."""
    columns = np.empty((3, 3))
    quaternion = np.array(q, dtype=np.float64)
    for axis in range(3):
        rotate(quaternion, np.eye(3)[axis], columns[axis])
    return np.ascontiguousarray(columns.T)
