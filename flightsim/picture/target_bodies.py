"""Vehicles and persons in a picture: boxes that the sun lights, with their shadow on the ground."""

import math
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from flightsim.payload.camera_view import TargetView
from flightsim.payload.target_shape import Bgr, BodyBox, body_boxes
from flightsim.picture.patches import LARGEST_PX, NEAREST_M, box_of, part_of
from flightsim.picture.window import Window

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

_FINE: Final = 4  # subpixels, each way
_MOST_FINE_PX: Final = 200_000
_AMBIENT: Final = 0.55  # light of faces that the sun does not reach
_SHADOW: Final = 0.45  # share of the light that a shadow takes
# faces of a box: its corners are (x, y, z) in binary digits of the index; with outward normals along the axes
_FACES: Final = (
    ((0, 2, 6, 4), (-1.0, 0.0, 0.0)),
    ((1, 3, 7, 5), (1.0, 0.0, 0.0)),
    ((0, 1, 5, 4), (0.0, -1.0, 0.0)),
    ((2, 3, 7, 6), (0.0, 1.0, 0.0)),
    ((4, 5, 7, 6), (0.0, 0.0, -1.0)),
)
_TOP: Final = 4


def draw_body(
    picture: Picture,
    window: Window,
    size_px: tuple[int, int],
    target: TargetView,
    paint: Bgr,
    camera_from_ned: Array,
    eye: Array,
    focal_px: float,
    sun_ned: Array,
) -> None:
    """Put a target's boxes on the ground; `picture` is the part `window` of one of a size."""
    cosine, sine = math.cos(target.course_rad), math.sin(target.course_rad)
    r_ned_from_body = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    place = np.asarray(target.position_ned_m)
    shadows: list[Array] = []
    faces: list[tuple[Array, Array]] = []
    for box in body_boxes(target.shape):
        corners = _corners(box, target.size_m) @ r_ned_from_body.T + place
        height_m = place[2] - corners[:, 2]
        if sun_ned[2] < -0.05:
            shadows.append(corners - sun_ned * (height_m / -sun_ned[2])[:, None])
        for number, (indices, normal) in enumerate(_FACES):
            outward = r_ned_from_body @ np.array(normal)
            face = corners[list(indices)]
            if outward @ (eye - face.mean(axis=0)) <= 0.0:
                continue
            colour = (box.roof_bgr if number == _TOP else box.colour_bgr) or paint
            lit = _AMBIENT + (1.0 - _AMBIENT) * max(0.0, float(outward @ sun_ned))
            faces.append((face, lit * np.array(colour)))
    polygons = [*shadows, *(face for face, _ in faces)]
    seen = [(polygon - eye) @ camera_from_ned.T for polygon in polygons]
    if min(points[:, 2].min() for points in seen) < NEAREST_M:
        return
    middle = (0.5 * size_px[0], 0.5 * size_px[1])
    pixels = [focal_px * points[:, :2] / points[:, 2:] + middle for points in seen]
    low, high = (
        np.min([p.min(axis=0) for p in pixels], axis=0),
        np.max([p.max(axis=0) for p in pixels], axis=0),
    )
    if not max(abs(low).max(), abs(high).max()) < LARGEST_PX:
        return
    where = box_of(low, high, window)
    if where is None:
        return
    left, top, right, bottom = where
    fine = _FINE if (right - left) * (bottom - top) < _MOST_FINE_PX else 1
    size = ((bottom - top) * fine, (right - left) * fine)
    # colours are those of covered subpixels, so that the mean over a pixel is right at its edges
    colour_of = np.zeros((*size, 3), np.float32)
    cover = np.zeros(size, np.float32)
    for number, points in enumerate(pixels):
        fine_px = np.round(((points - (left, top)) * fine - 0.5) * 256.0).astype(np.int32)
        outline = cv2.convexHull(fine_px.reshape(-1, 1, 2))
        shadow = number < len(shadows)
        bgr = (0.0, 0.0, 0.0) if shadow else tuple(faces[number - len(shadows)][1].tolist())
        cv2.fillConvexPoly(colour_of, outline, bgr, shift=8)
        cv2.fillConvexPoly(cover, outline, (_SHADOW if shadow else 1.0,), shift=8)
    if fine > 1:
        pixel_size = (right - left, bottom - top)
        colour_of = cv2.resize(colour_of, pixel_size, interpolation=cv2.INTER_AREA).astype(np.float32)
        cover = cv2.resize(cover, pixel_size, interpolation=cv2.INTER_AREA).astype(np.float32)
    part = part_of(picture, window, where)
    part[:] = np.round(part * (1.0 - cover[:, :, None]) + colour_of).astype(np.uint8)


def _corners(box: BodyBox, size_m: float) -> Array:
    """Corners (8, 3) in the body's axes: along the course, to its right, down."""
    half_length, half_width = 0.5 * box.length, 0.5 * box.width
    return size_m * np.array(
        [
            (x, y, z)
            for z in (-box.bottom, -box.top)
            for y in (-half_width, half_width)
            for x in (box.x - half_length, box.x + half_length)
        ]
    )
