"""One frame of a video with the pose of its camera: the input of the detectors of moving objects."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from estimators.vision.ground_points import CameraAxes

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CameraPose:
    """Attitude of a camera against the horizon, and its height, as the vehicle and its gimbal report them.

    Attributes:
        axes: of the camera in the level frame of the vehicle (forward, right, down): the product
            R_hb^hl R_g^hb R_c^g of Tolman et al. 2021, equation 37.
        height_m: over the ground.
        tilt_sigma_rad, height_sigma_m: standard deviations of the part of their errors that changes from
            frame to frame; slower ones move all measurements together.

    Raises:
        EstimatorError: a value is not possible.
    """

    axes: CameraAxes
    height_m: float
    tilt_sigma_rad: float = 0.001
    height_sigma_m: float = 0.3

    def __post_init__(self) -> None:
        axes = self.axes.axes
        if axes.shape != (3, 3) or not np.allclose(axes @ axes.T, np.eye(3), atol=1e-6):
            raise EstimatorError(f"axes {axes.tolist()} are not possible; give a rotation matrix")
        if not (math.isfinite(self.height_m) and self.height_m > 0.0):
            raise EstimatorError(f"height_m {self.height_m:g} is not possible; give a height above 0")
        for name, value in (("tilt_sigma_rad", self.tilt_sigma_rad), ("height_sigma_m", self.height_sigma_m)):
            if not (math.isfinite(value) and value >= 0.0):
                raise EstimatorError(f"{name} {value:g} is not possible; give 0 or more")

    @property
    def down(self) -> Array:
        """The vertical (3,) in the camera frame (x right, y down, z along the optical axis)."""
        found: Array = self.axes.axes[:, 2]
        return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VideoFrame:
    """A frame.

    Attributes:
        time_us: vehicle time of the exposure.
        pixels: (height, width), or (height, width, 3) BGR.
        pose: of the camera at the exposure.
    """

    time_us: int
    pixels: Picture
    pose: CameraPose
