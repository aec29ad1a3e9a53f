"""Image points of a levelled camera as places on level ground, with their covariance.

Source: Tolman et al. 2021, equations 36 to 40. The camera's axes in the level frame stand for the product
R_hb^hl R_g^hb R_c^g of equation 37.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CameraAxes:
    """Axes of a camera without roll, in the level frame (forward, right, down).

    Attributes:
        axes: (3, 3) rows: to the right in the image, down in the image, along the optical axis.
    """

    axes: Array

    @classmethod
    def towards(cls, forward_m: float, right_m: float, down_m: float) -> "CameraAxes":
        """A camera that points at a place of the level frame.

        Raises:
            ValueError: the place is the camera's own.
        """
        distance = math.sqrt(forward_m**2 + right_m**2 + down_m**2)
        if not distance > 0.0:
            raise ValueError("a camera cannot point at its own place")
        x, y, z = forward_m / distance, right_m / distance, down_m / distance
        level = math.hypot(x, y)
        # straight down there is no horizontal part: the image's top is forward then
        u, v = (-y / level, x / level) if level > 1e-9 else (0.0, 1.0)
        # the image's down is along x right
        return cls(axes=np.array([[u, v, 0.0], [-z * v, z * u, x * v - y * u], [x, y, z]]))

    def project(self, places: Array) -> Array:
        """Normalized image points (n, 2) of places (n, 3) of the level frame; NaN behind the camera."""
        x, y, depth = self.axes @ places.T
        ahead = np.where(depth > 1e-9, depth, np.nan)
        found = np.empty((len(places), 2))
        found[:, 0], found[:, 1] = x / ahead, y / ahead
        return found

    def directions(self, points: Array) -> Array:
        """Directions (n, 3) in the level frame of normalized image points (n, 2): equation 37."""
        found: Array = points @ self.axes[:2] + self.axes[2]
        return found


def on_ground(directions: Array, height_m: float, angle_sigma_rad: float) -> tuple[Array, Array]:
    """Places on level ground and their covariances (equation 40).

    Args:
        directions: (n, 3) forward, right, down; those that do not point down give NaN.
        height_m: height of the camera over the ground.
        angle_sigma_rad: standard deviation of the directions, per axis.

    Returns:
        (n, 2) forward and right, and (n, 2, 2).
    """
    places, covariances = np.empty((len(directions), 2)), np.empty((len(directions), 2, 2))
    _project(directions, height_m, angle_sigma_rad, places, covariances)
    return places, covariances


@kernel
def _project(
    directions: Array, height_m: float, angle_sigma_rad: float, places: Array, covariances: Array
) -> None:
    for k in range(directions.shape[0]):
        down = directions[k, 2]
        if not down > 1e-6:
            places[k] = math.nan
            covariances[k] = math.nan
            continue
        x, y = height_m * directions[k, 0] / down, height_m * directions[k, 1] / down
        away = math.hypot(x, y)
        slant = math.hypot(away, height_m)
        along, across = (angle_sigma_rad * slant * slant / height_m) ** 2, (angle_sigma_rad * slant) ** 2
        u, v = x / max(away, 1e-9), y / max(away, 1e-9)
        places[k, 0], places[k, 1] = x, y
        covariances[k, 0, 0] = across + (along - across) * (u * u)
        covariances[k, 0, 1] = covariances[k, 1, 0] = (along - across) * (u * v)
        covariances[k, 1, 1] = across + (along - across) * (v * v)
