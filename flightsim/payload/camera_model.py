"""Pinhole camera geometry, without noise and without time.

Camera frame: x right, y down, z forward along the optical axis. Gimbal frame: x forward along the optical
axis, y right, z down, so that a point changes frame by exchanging axes (Tolman et al. 2021, equation 38).
Image: u right from the left edge, v down from the top edge, in pixels; pixel (i, j) covers i..i+1, j..j+1,
and the optical axis meets the image in its middle.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import Positive
from flightsim.foundation.options import Options

Array = NDArray[np.float64]


def camera_from_gimbal(points_gimbal: Array) -> Array:
    """Points (..., 3) in the camera frame, from the gimbal frame."""
    return points_gimbal[..., [1, 2, 0]]


def gimbal_from_camera(points_camera: Array) -> Array:
    """Points (..., 3) in the gimbal frame, from the camera frame (equation 38)."""
    return points_camera[..., [2, 0, 1]]


@dataclass(frozen=True, slots=True, kw_only=True)
class PinholeModel(Options):
    """Square pixels, no distortion.

    Attributes:
        width_px, height_px: size of the image.
        horizontal_fov_rad: angle between the left and the right edge.
    """

    width_px: int = 1280
    height_px: int = 720
    horizontal_fov_rad: Positive = math.radians(60.0)

    def check_together(self) -> None:
        for name, value in (("width_px", self.width_px), ("height_px", self.height_px)):
            if not isinstance(value, int) or value <= 0:
                raise ValueError(f"{name} = {value!r} is not accepted: a positive whole number is")
        if self.horizontal_fov_rad >= math.pi:
            raise ValueError(
                f"horizontal_fov_rad = {self.horizontal_fov_rad} is not accepted: less than pi is"
            )

    @property
    def focal_px(self) -> float:
        """Focal length in pixels."""
        return 0.5 * self.width_px / math.tan(0.5 * self.horizontal_fov_rad)

    @property
    def vertical_fov_rad(self) -> float:
        """Angle between the upper and the lower edge."""
        return 2.0 * math.atan(0.5 * self.height_px / self.focal_px)

    @property
    def centre_px(self) -> tuple[float, float]:
        """Where the optical axis meets the image."""
        return 0.5 * self.width_px, 0.5 * self.height_px

    @property
    def matrix(self) -> Array:
        """Intrinsic matrix (3, 3): (u, v, 1) ~ matrix @ (x, y, z) in the camera frame."""
        u0, v0 = self.centre_px
        return np.array([[self.focal_px, 0.0, u0], [0.0, self.focal_px, v0], [0.0, 0.0, 1.0]])

    def normalised(self, points_camera: Array) -> Array:
        """Normalised image coordinates (..., 2), x / z and y / z; NaN for points not before the camera."""
        depth = points_camera[..., 2:]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(depth > 0.0, points_camera[..., :2] / depth, np.nan)

    def pixels(self, normalised: Array) -> Array:
        """Pixels (..., 2), u and v, from normalised image coordinates."""
        return self.focal_px * normalised + np.array(self.centre_px)

    def normalised_from_pixels(self, pixels: Array) -> Array:
        """Normalised image coordinates (..., 2) from pixels u and v."""
        return (pixels - np.array(self.centre_px)) / self.focal_px

    def project(self, points_camera: Array) -> Array:
        """Pixels (..., 2) of points in the camera frame; NaN for points not before the camera."""
        return self.pixels(self.normalised(points_camera))

    def inside(self, pixels: Array) -> NDArray[np.bool_]:
        """Whether pixels (..., 2) lie in the image; NaN does not."""
        u, v = pixels[..., 0], pixels[..., 1]
        inside: NDArray[np.bool_] = (u >= 0.0) & (u < self.width_px) & (v >= 0.0) & (v < self.height_px)
        return inside
