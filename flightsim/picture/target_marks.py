"""Ground targets in a picture: tags as plates that lie on the ground, others as red balls.

A tag is of the family 36h11 (Olson 2011, AprilTag), so that any detector reads its number; its black square
is the target's size, within a yellow margin of one cell. A target without a number, or with one outside the
family, is a ball of the target's size: it looks the same from every side, as the detector model assumes.
"""

import functools
import math
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from flightsim.payload.camera_model import camera_from_gimbal
from flightsim.payload.camera_view import CameraView, TargetView
from flightsim.picture.patches import LARGEST_PX, NEAREST_M, blend, box_of, part_of
from flightsim.picture.pose import rotation_of
from flightsim.picture.window import Window

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

TAG_FAMILY: Final = cv2.aruco.DICT_APRILTAG_36h11
TAGS: Final = 587
_CELLS: Final = 8  # of the black square, border included
_MARGIN_BGR: Final = (0.0, 215.0, 255.0)
_BALL_BGR: Final = np.array((36.0, 36.0, 220.0))
_FINE: Final = 4  # subpixels, each way
_TEXELS_PER_CELL: Final = 16


def shows_tag(target: TargetView) -> bool:
    """Whether a target is painted as a tag."""
    return 0 <= target.tag_id < TAGS


@functools.lru_cache(maxsize=64)
def tag_plate(tag_id: int) -> Picture:
    """The plate of a tag, north up, (n, n, 3) BGR."""
    dictionary = cv2.aruco.getPredefinedDictionary(TAG_FAMILY)
    side = _CELLS * _TEXELS_PER_CELL
    black = cv2.aruco.generateImageMarker(dictionary, tag_id, side)
    plate = np.empty((side + 2 * _TEXELS_PER_CELL, side + 2 * _TEXELS_PER_CELL, 3), np.uint8)
    plate[:] = _MARGIN_BGR
    middle = slice(_TEXELS_PER_CELL, _TEXELS_PER_CELL + side)
    plate[middle, middle] = black[:, :, None]
    return plate


def _plate_corners(target: TargetView) -> Array:
    """Corners (4, 3) of a tag's plate with its margin, from north-west clockwise, local NED."""
    half = 0.5 * target.size_m * (_CELLS + 2) / _CELLS
    north, east, down = target.position_ned_m
    return np.array(
        [
            (north + half, east - half, down),
            (north + half, east + half, down),
            (north - half, east + half, down),
            (north - half, east - half, down),
        ]
    )


def draw_tag(
    picture: Picture,
    window: Window,
    size_px: tuple[int, int],
    target: TargetView,
    camera_from_ned: Array,
    eye: Array,
    focal_px: float,
) -> None:
    """Lay a tag's plate on the ground; `picture` is the part `window` of one of a size."""
    seen = (_plate_corners(target) - eye) @ camera_from_ned.T
    if seen[:, 2].min() < NEAREST_M:
        return
    width, height = size_px
    pixels = focal_px * seen[:, :2] / seen[:, 2:] + (0.5 * width, 0.5 * height)
    if not np.abs(pixels).max() < LARGEST_PX:
        return
    box = box_of(pixels.min(axis=0), pixels.max(axis=0), window)
    if box is None:
        return
    left, top, right, bottom = box
    fine = _FINE if (right - left) * (bottom - top) < 200_000 else 1
    # OpenCV counts from the middle of the first pixel, the pinhole model from its corner
    onto = ((pixels - (left, top)) * fine - 0.5).astype(np.float32)
    plate = tag_plate(target.tag_id)
    side = plate.shape[0]
    source = np.array(
        [(-0.5, -0.5), (side - 0.5, -0.5), (side - 0.5, side - 0.5), (-0.5, side - 0.5)], np.float32
    )
    warp = cv2.getPerspectiveTransform(source, onto)
    size = ((right - left) * fine, (bottom - top) * fine)
    # one texel more of the same colour all round, so that the edge is the mask's alone
    colour: NDArray[Any] = cv2.warpPerspective(
        plate, warp, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    mask: Picture = np.zeros((size[1], size[0]), np.uint8)
    cv2.fillConvexPoly(mask, np.round(onto * 256).astype(np.int32), 255, lineType=cv2.LINE_AA, shift=8)
    if fine > 1:
        colour = cv2.resize(colour, (right - left, bottom - top), interpolation=cv2.INTER_AREA)
        mask = cv2.resize(mask, (right - left, bottom - top), interpolation=cv2.INTER_AREA).astype(np.uint8)
    blend(part_of(picture, window, box), colour, mask / 255.0)


def draw_ball(
    picture: Picture,
    window: Window,
    size_px: tuple[int, int],
    target: TargetView,
    camera_from_ned: Array,
    eye: Array,
    focal_px: float,
    sun_ned: Array,
) -> None:
    """Put a ball where the target is, lit by the sun; `picture` is the part `window` of one of a size."""
    sight = np.asarray(target.position_ned_m) - eye
    seen = camera_from_ned @ sight
    if seen[2] < NEAREST_M:
        return
    width, height = size_px
    centre = focal_px * seen[:2] / seen[2] + (0.5 * width, 0.5 * height)
    range_m = float(np.linalg.norm(sight))
    radius = focal_px * 0.5 * target.size_m / range_m
    if not radius < LARGEST_PX:
        return
    box = box_of(centre - radius - 1.0, centre + radius + 1.0, window)
    if box is None:
        return
    left, top, right, bottom = box
    x = (np.arange(left, right) + 0.5 - centre[0])[None, :]
    y = (np.arange(top, bottom) + 0.5 - centre[1])[:, None]
    distance = np.hypot(x, y)
    cover = np.clip(radius - distance + 0.5, 0.0, 1.0)
    if radius < 0.5:  # less than a pixel: as much of it as the ball covers
        cover *= math.pi * radius * radius / max(1e-9, float(cover.sum()))
    facing = camera_from_ned @ sun_ned
    depth = np.sqrt(np.clip(1.0 - (distance / max(radius, 1e-9)) ** 2, 0.0, 1.0))
    lit = np.clip((x * facing[0] + y * facing[1]) / max(radius, 1e-9) - depth * facing[2], 0.0, 1.0)
    colour = (0.6 + 0.4 * lit)[:, :, None] * _BALL_BGR
    blend(part_of(picture, window, box), colour, np.clip(cover, 0.0, 1.0))


def tag_may_show(view: CameraView, half_width: float, half_height: float) -> bool:
    """Whether a plate of a tag, or a part of one, may lie in a picture; False is certain.

    A plate whose corners are all beyond the same side of the view cannot.

    Args:
        view: camera and targets.
        half_width, half_height: half of the picture at zoom 1, with its margin, in focal lengths.
    """
    if view.covered:
        return False
    camera_from_ned = None
    blur = view.exposure_s * (
        math.hypot(*view.rotation_mount_rad_s)
        + math.hypot(*view.velocity_ned_m_s) / max(0.05, -view.eye_ned_m[2])
    )
    for target in view.targets:
        if not shows_tag(target):
            continue
        if camera_from_ned is None:
            camera_from_ned = camera_from_gimbal(rotation_of(view.q_ned_from_mount)).T
        seen = (_plate_corners(target) - view.eye_ned_m) @ camera_from_ned.T
        right, down, ahead = seen.T
        wide = ahead * (half_width / view.zoom + blur)
        tall = ahead * (half_height / view.zoom + blur)
        sides = (ahead <= 0.0, right > wide, -right > wide, down > tall, -down > tall)
        if not any(side.all() for side in sides):
            return True
    return False


def tag_box(view: CameraView, focal_px: float) -> tuple[Array, Array] | None:
    """Least and greatest offsets of the tags' plates from the optical axis: (right, down), in pixels, without
    lens distortion. None: a plate reaches behind the camera.
    """
    camera_from_ned = camera_from_gimbal(rotation_of(view.q_ned_from_mount)).T
    plates = [_plate_corners(target) for target in view.targets if shows_tag(target)]
    seen = (np.concatenate(plates) - view.eye_ned_m) @ camera_from_ned.T
    if seen[:, 2].min() < NEAREST_M:
        return None
    offsets = focal_px * seen[:, :2] / seen[:, 2:]
    return offsets.min(axis=0), offsets.max(axis=0)
