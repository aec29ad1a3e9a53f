"""From an ideal picture to that of a camera: motion blur, rolling shutter, distortion, light, noise, JPEG.

Motion is that of the camera over level ground: two pictures of a plane differ by a homography (Hartley and
Zisserman 2004, section 13.1), so one rendered picture gives those of all moments of its exposure. What stands
above the ground, and targets that move by themselves, blur as the ground under them.
"""

import math
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import multiply
from flightsim.payload.camera_model import camera_from_gimbal
from flightsim.payload.camera_view import CameraView
from flightsim.payload.imager import ImagerParameters
from flightsim.picture.levels import compressed, falloff, lit
from flightsim.picture.pose import rotation_of
from flightsim.picture.window import Window

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

_LEAST_BLUR_PX: Final = 0.2
_MOST_SAMPLES: Final = 24
_POOL: Final = 1 << 21
_NOISE_SEED: Final = 0x5EED
_EDGE_PX: Final = 2
_AROUND_PX: Final = 12  # around a part of the ideal picture, for motion


class Exposure:
    """Makes pictures of one size and focal length like those of a real lens and sensor.

    Args:
        imager: lens and sensor.
        width_px, height_px: of the finished picture.
        focal_px: focal length.
        seed: of the noise.

    Attributes:
        ideal_px: width and height of the ideal picture that `expose` needs: it reaches as far as the lens.

    Raises:
        ValueError: the distortion folds the picture.
    """

    def __init__(
        self, imager: ImagerParameters, *, width_px: int, height_px: int, focal_px: float, seed: int = 0
    ) -> None:
        self._imager = imager
        self._focal_px = focal_px
        self._seed = seed
        self._size_px = (width_px, height_px)
        self._sigma = np.array([imager.noise_sigma(level) for level in range(256)], np.float32)
        self._map: NDArray[np.float32] | None = None
        self.ideal_px = (width_px, height_px)
        columns, rows = np.meshgrid(np.arange(width_px) + 0.5, np.arange(height_px) + 0.5)
        rays = (np.stack((columns, rows), -1) - (0.5 * width_px, 0.5 * height_px)) / focal_px
        if not imager.distortion.none:
            rays = imager.distortion.rays(rays)
        self._gain: NDArray[np.float32] | None = None
        if imager.vignetting > 0.0 or imager.brightness != 1.0:
            self._gain = np.float32(imager.brightness) * falloff(rays, imager.vignetting)
        if not imager.distortion.none:
            rays = rays * focal_px
            half = np.abs(rays).reshape(-1, 2).max(axis=0)
            ideal = [2 * (math.ceil(float(value)) + _EDGE_PX) for value in half]
            self.ideal_px = (ideal[0], ideal[1])
            # OpenCV counts from the middle of the first pixel
            self._map = (rays + (0.5 * np.array(ideal) - 0.5)).astype(np.float32)
        elif imager.rolling_shutter_s > 0.0:
            self._map = np.stack((columns - 0.5, rows - 0.5), -1).astype(np.float32)

    def ideal_window(self, window: Window) -> Window:
        """The part of the ideal picture that a part of the finished one needs."""
        low, high = (window.left, window.top), (window.right, window.bottom)
        if self._map is not None:
            seen = self._map[window.top : window.bottom, window.left : window.right].reshape(-1, 2)
            low, high = tuple(seen.min(axis=0).tolist()), tuple(seen.max(axis=0).tolist())
        found = Window.around(low, high, _AROUND_PX, self.ideal_px)
        assert found is not None
        return found

    def expose(self, ideal: Picture, view: CameraView, window: Window, ideal_window: Window) -> Picture:
        """A part of the finished picture of a view.

        Args:
            ideal: the part `ideal_window` of the ideal picture.
            view: the view.
            window: the part.
            ideal_window: of `ideal_window(window)`.
        """
        picture = self._blurred(ideal, view, ideal_window)
        rows_of, columns_of = slice(window.top, window.bottom), slice(window.left, window.right)
        if self._map is None:
            top, left = window.top - ideal_window.top, window.left - ideal_window.left
            picture = picture[top : top + window.height, left : left + window.width]
        else:
            points = self._map[rows_of, columns_of]
            if self._imager.rolling_shutter_s > 0.0 and view.moves:
                points = self._rolled(points, view, window)
            corner = np.array((ideal_window.left, ideal_window.top), np.float32)
            columns, rows = cv2.split(points - corner)
            picture = cv2.remap(
                picture, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
            ).astype(np.uint8, copy=False)
        if self._gain is not None:
            picture = lit(picture, self._gain[rows_of, columns_of])
        picture = self._noisy(picture, view, window)
        if self._imager.jpeg_quality > 0:
            picture = compressed(picture, self._imager.jpeg_quality, (window.left, window.top))
        return picture

    def _ground(self, view: CameraView, after_s: float) -> Array:
        """The ground's (north, east, 1) from pixels of the ideal picture, at a time after the view's."""
        q = np.array(view.q_ned_from_mount)
        angle = 0.5 * after_s * np.array(view.rotation_mount_rad_s)
        turn, turned = np.array([1.0, *angle.tolist()]), np.zeros(4)
        multiply(q, turn / np.linalg.norm(turn), turned)
        r = camera_from_gimbal(rotation_of(turned))
        north, east, down = (
            p + after_s * v for p, v in zip(view.eye_ned_m, view.velocity_ned_m_s, strict=True)
        )
        height = max(0.05, -down)
        plane = np.stack((height * r[0] + north * r[2], height * r[1] + east * r[2], r[2]))
        width, tall = self.ideal_px
        f = self._focal_px
        pixels = np.array([[f, 0.0, 0.5 * width - 0.5], [0.0, f, 0.5 * tall - 0.5], [0.0, 0.0, 1.0]])
        homography: Array = plane @ np.linalg.inv(pixels)
        return homography

    def _blurred(self, ideal: Picture, view: CameraView, part: Window) -> Picture:
        if not view.moves or view.exposure_s == 0.0:
            return ideal
        to_pixels = np.linalg.inv(self._ground(view, 0.0))
        half_s = 0.5 * view.exposure_s
        ends = [to_pixels @ self._ground(view, t) for t in (-half_s, half_s)]
        width, height = self.ideal_px
        places = np.array([(x, y, 1.0) for x in (0, 0.5 * width, width) for y in (0, 0.5 * height, height)]).T
        first, last = (end @ places for end in ends)
        if np.any(first[2] <= 0.0) or np.any(last[2] <= 0.0):
            places = places[:, 4:5]  # the horizon is in the picture: by its middle
            first, last = (end @ places for end in ends)
        way_px = float(np.hypot(*(last[:2] / last[2] - first[:2] / first[2])).max())
        if not way_px > _LEAST_BLUR_PX:
            return ideal
        samples = min(_MOST_SAMPLES, 2 + math.ceil(way_px))
        total = np.zeros(ideal.shape, np.float32)
        from_part = np.array([[1.0, 0.0, part.left], [0.0, 1.0, part.top], [0.0, 0.0, 1.0]])
        to_part = np.linalg.inv(from_part)
        for index in range(samples):
            after_s = half_s * (2.0 * (index + 0.5) / samples - 1.0)
            warp = to_part @ to_pixels @ self._ground(view, after_s) @ from_part
            moved = cv2.warpPerspective(
                ideal,
                warp,
                (part.width, part.height),
                flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
                borderMode=cv2.BORDER_REPLICATE,
            )
            cv2.accumulate(moved, total)
        blurred: Picture = (total * np.float32(1.0 / samples) + np.float32(0.5)).astype(np.uint8)
        return blurred

    def _rolled(self, points: NDArray[np.float32], view: CameraView, window: Window) -> NDArray[np.float32]:
        """Places in the picture of the middle row's time, from those that each row sees at its own."""
        to_pixels = np.linalg.inv(self._ground(view, 0.0))
        rolled = np.empty_like(points)
        for row in range(len(points)):
            share = (window.top + row + 0.5) / self._size_px[1] - 0.5
            after_s = self._imager.rolling_shutter_s * share
            warp = to_pixels @ self._ground(view, after_s)
            rolled[row] = cv2.perspectiveTransform(points[row][None], warp)[0]
        return rolled

    def _noisy(self, picture: Picture, view: CameraView, window: Window) -> Picture:
        imager = self._imager
        if not imager.noisy:
            return picture
        # each frame has its own generator: a frame that was not rendered changes no other
        rng = np.random.Generator(np.random.Philox(key=(self._seed & (2**64 - 1)) << 64 | view.time_us))
        out = np.empty_like(picture)
        start, stride = rng.integers(_POOL, size=2).tolist()
        width = self._size_px[0]
        first = window.top * width + window.left
        _add_noise(picture, self._sigma, _pool(), start, stride | 1, first, width, out)
        return out


_POOLS: list[NDArray[np.float32]] = []


def _pool() -> NDArray[np.float32]:
    """Standard normal numbers; a frame takes them from its own place on."""
    if not _POOLS:
        rng = np.random.Generator(np.random.PCG64(_NOISE_SEED))
        _POOLS.append(rng.standard_normal(_POOL, dtype=np.float32))
    return _POOLS[0]


@kernel
def _add_noise(
    picture: NDArray[np.uint8],
    sigma: NDArray[np.float32],
    pool: NDArray[np.float32],
    start: int,
    stride: int,
    first: int,
    width: int,
    out: NDArray[np.uint8],
) -> None:
    """Add noise by level to a part of a picture of a width, whose first pixel is `first`.

    The pool is left in runs of 64 pixels of the whole picture, whose places are `stride` apart.
    """
    mask = pool.shape[0] - 1
    for row in range(picture.shape[0]):
        for column in range(picture.shape[1]):
            pixel = first + row * width + column
            place = start + (pixel >> 6) * stride + 3 * (pixel & 63)
            for c in range(picture.shape[2]):
                level = picture[row, column, c]
                value = level + sigma[level] * pool[(place + c) & mask] + 0.5
                out[row, column, c] = np.uint8(min(255.0, max(0.0, value)))
