"""Image points of a levelled camera as places on level ground, with their covariance.

Source: Tolman et al. 2021, equations 36 to 40. The camera's axes in the level frame stand for the product
R_hb^hl R_g^hb R_c^g of equation 37.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
        along = np.array([forward_m, right_m, down_m]) / distance
        level = math.hypot(along[0], along[1])
        # straight down there is no horizontal part: the image's top is forward then
        right = np.array([-along[1], along[0], 0.0]) / level if level > 1e-9 else np.array([0.0, 1.0, 0.0])
        return cls(axes=np.array([right, np.cross(along, right), along]))

    def project(self, places: Array) -> Array:
        """Normalized image points (n, 2) of places (n, 3) of the level frame; NaN behind the camera."""
        x, y, depth = self.axes @ places.T
        ahead = np.where(depth > 1e-9, depth, np.nan)
        found: Array = np.column_stack((x / ahead, y / ahead))
        return found

    def directions(self, points: Array) -> Array:
        """Directions (n, 3) in the level frame of normalized image points (n, 2): equation 37."""
        found: Array = np.column_stack((points, np.ones(len(points)))) @ self.axes
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
    down = np.where(directions[:, 2] > 1e-6, directions[:, 2], np.nan)
    places = height_m * directions[:, :2] / down[:, None]
    away = np.hypot(places[:, 0], places[:, 1])
    slant = np.hypot(away, height_m)
    along, across = np.square(angle_sigma_rad * slant * slant / height_m), np.square(angle_sigma_rad * slant)
    unit = places / np.maximum(away, 1e-9)[:, None]
    outer = unit[:, :, None] * unit[:, None, :]
    return places, across[:, None, None] * np.eye(2) + (along - across)[:, None, None] * outer
