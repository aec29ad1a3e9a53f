"""Video of a textured plane with rectangles that move on it, or stand over it, by plain projective geometry:
nothing of the project's renderer is in it.
"""

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from estimators.vision import CameraGeometry, CameraPose, VideoFrame
from estimators.vision.ground_points import CameraAxes

cv2.setNumThreads(1)  # threads that wait for each other take longer on a loaded machine

CAMERA = CameraGeometry.of_view(width_px=320, height_px=240, horizontal_fov_rad=math.radians(60.0))
TEXEL_M = 0.25
TEXELS = 720
HEIGHT_M = 60.0
RADIUS_M = 60.0
SPEED_M_S = 18.0


@dataclass(frozen=True)
class Plate:
    """A rectangle: place, velocity (north, east), sides along and across, level, height over the ground."""

    place_m: tuple[float, float]
    velocity_m_s: tuple[float, float] = (0.0, 0.0)
    sides_m: tuple[float, float] = (4.5, 1.8)
    level: int = 235
    height_m: float = 0.0

    def at(self, time_s: float) -> np.ndarray:
        return np.array(self.place_m) + time_s * np.array(self.velocity_m_s)

    def corners(self, time_s: float) -> np.ndarray:
        heading = math.atan2(self.velocity_m_s[1], self.velocity_m_s[0])
        along, across = (
            np.array([math.cos(heading), math.sin(heading)]),
            np.array([-math.sin(heading), math.cos(heading)]),
        )
        a, b = 0.5 * self.sides_m[0] * along, 0.5 * self.sides_m[1] * across
        return self.at(time_s) + np.array([a + b, a - b, -a - b, b - a])


@functools.cache
def texture(seed: int = 1) -> np.ndarray:
    """Noise of several scales, as ground has it."""
    rng = np.random.default_rng(seed)
    total = np.full((TEXELS, TEXELS), 110.0, np.float32)
    for size, amplitude in ((2, 10.0), (6, 14.0), (25, 14.0)):
        coarse = rng.standard_normal((TEXELS // size + 2, TEXELS // size + 2)).astype(np.float32)
        total += amplitude * cv2.resize(coarse, (TEXELS, TEXELS), interpolation=cv2.INTER_CUBIC)
    return np.clip(total, 0, 255).astype(np.uint8)


def plane_video(
    plates: Sequence[Plate],
    *,
    frames: int,
    rate_hz: float = 10.0,
    seed: int = 1,
    noise: float = 1.5,
    ground: np.ndarray | None = None,
    camera: CameraGeometry = CAMERA,
    pointing_sigma_m: float = 0.05,
) -> Iterator[tuple[VideoFrame, np.ndarray]]:
    """Frames of a camera that orbits the origin and points at it, and the plates' places from the camera."""
    rng = np.random.default_rng([seed, 2])
    ground = texture() if ground is None else ground
    matrix = camera.matrix
    matrix[:2, 2] -= 0.5  # OpenCV counts from the middle of the first pixel
    ne_from_texel = np.array(
        [[0.0, -TEXEL_M, TEXELS * TEXEL_M / 2], [TEXEL_M, 0.0, -TEXELS * TEXEL_M / 2], [0.0, 0.0, 1.0]]
    )
    for index in range(frames):
        time_s = index / rate_hz
        angle = SPEED_M_S * time_s / RADIUS_M
        eye = RADIUS_M * np.array([math.cos(angle), math.sin(angle)])
        aim = -eye + pointing_sigma_m * rng.standard_normal(2)
        axes = CameraAxes.towards(float(aim[0]), float(aim[1]), HEIGHT_M)

        def pixel_from_ne(height_m: float, axes=axes, eye=eye) -> np.ndarray:
            place = np.array([[1.0, 0.0, -eye[0]], [0.0, 1.0, -eye[1]], [0.0, 0.0, HEIGHT_M - height_m]])
            return matrix @ axes.axes @ place

        painted = ground.copy()
        texel_from_ne = np.linalg.inv(ne_from_texel)
        for plate in plates:
            if plate.height_m == 0.0:
                _fill(painted, texel_from_ne, plate, time_s)
        picture = cv2.warpPerspective(
            painted, pixel_from_ne(0.0) @ ne_from_texel, (camera.width_px, camera.height_px)
        )
        for plate in plates:
            if plate.height_m > 0.0:
                _fill(picture, pixel_from_ne(plate.height_m), plate, time_s)
        noisy = picture + noise * rng.standard_normal(picture.shape)
        yield (
            VideoFrame(
                time_us=round(1e6 * time_s),
                pixels=np.clip(noisy, 0, 255).astype(np.uint8),
                pose=CameraPose(axes=axes, height_m=HEIGHT_M),
            ),
            np.array([plate.at(time_s) - eye for plate in plates]).reshape(-1, 2),
        )


def _fill(picture: np.ndarray, pixel_from_ne: np.ndarray, plate: Plate, time_s: float) -> None:
    corners = np.column_stack((plate.corners(time_s), np.ones(4))) @ pixel_from_ne.T
    pixels = corners[:, :2] / corners[:, 2:]
    cv2.fillConvexPoly(
        picture, np.round(pixels * 256).astype(np.int32), plate.level, lineType=cv2.LINE_AA, shift=8
    )
