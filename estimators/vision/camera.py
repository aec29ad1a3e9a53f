"""The geometry of a calibrated camera: pinhole with Brown's distortion.

Camera frame: x right, y down, z along the optical axis. Image: u right from the left edge, v down from the
top edge; pixel (i, j) covers i..i+1, j..j+1.
"""

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError

Array = NDArray[np.float64]

_ITERATIONS: Final = 30
_CONVERGED: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraGeometry:
    """Intrinsic parameters.

    Attributes:
        width_px, height_px: size of the image.
        focal_px: focal lengths, x and y.
        centre_px: principal point.
        distortion: k1, k2, p1, p2, k3 of Brown's model, in OpenCV's order; empty: none.

    Raises:
        EstimatorError: a value is not possible.
    """

    width_px: int
    height_px: int
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    distortion: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.width_px < 1 or self.height_px < 1:
            raise EstimatorError(
                f"width_px, height_px {self.width_px} x {self.height_px} is no picture; give 1 or more"
            )
        if not all(math.isfinite(f) and f > 0.0 for f in self.focal_px):
            raise EstimatorError(f"focal_px {self.focal_px} is not possible; give numbers above 0")
        if len(self.distortion) not in (0, 5) or not all(map(math.isfinite, self.distortion)):
            raise EstimatorError(
                f"distortion {self.distortion} is not possible; give none, or k1, k2, p1, p2, k3"
            )

    @classmethod
    def of_view(
        cls, *, width_px: int, height_px: int, horizontal_fov_rad: float, distortion: tuple[float, ...] = ()
    ) -> "CameraGeometry":
        """Square pixels, and the optical axis in the middle of the image."""
        if not 0.0 < horizontal_fov_rad < math.pi:
            raise EstimatorError(f"horizontal_fov_rad {horizontal_fov_rad:g} is not within 0..pi")
        focal_px = 0.5 * width_px / math.tan(0.5 * horizontal_fov_rad)
        return cls(
            width_px=width_px,
            height_px=height_px,
            focal_px=(focal_px, focal_px),
            centre_px=(0.5 * width_px, 0.5 * height_px),
            distortion=distortion,
        )

    def check_size(self, picture: NDArray[np.uint8]) -> None:
        """Refuse a picture of another size.

        Raises:
            EstimatorError: it has another size.
        """
        height, width = picture.shape[:2]
        if (width, height) != (self.width_px, self.height_px):
            raise EstimatorError(
                f"a picture of {width} x {height} pixels is not of the camera of {self.width_px} x "
                f"{self.height_px}; calibrate the camera for this size"
            )

    @property
    def matrix(self) -> Array:
        """Intrinsic matrix (3, 3) for pixels that are counted from the edge."""
        return np.array(
            [
                [self.focal_px[0], 0.0, self.centre_px[0]],
                [0.0, self.focal_px[1], self.centre_px[1]],
                [0.0, 0.0, 1.0],
            ]
        )

    def rays(self, pixels: Array) -> Array:
        """Normalised image coordinates (n, 2) of the rays that are seen at pixels (n, 2): x / z and y / z."""
        seen = np.asarray(pixels, dtype=np.float64)
        rays: Array = (seen - self.centre_px) / self.focal_px
        if self.distortion:
            # OpenCV's undistortPoints ends after five iterations; its versions differ in how to get more
            for _ in range(_ITERATIONS):
                step = (seen - self.pixels(np.column_stack((rays, np.ones(len(rays)))))) / self.focal_px
                rays += step
                if float(np.abs(step).max(initial=0.0)) < _CONVERGED:
                    break
        return rays

    def pixels(self, points_camera: Array) -> Array:
        """Pixels (n, 2) of points (n, 3) before the camera."""
        pixels, _ = cv2.projectPoints(
            np.asarray(points_camera, dtype=np.float64).reshape(-1, 1, 3),
            np.zeros(3),
            np.zeros(3),
            self.matrix,
            np.array(self.distortion) if self.distortion else None,
        )
        return np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
