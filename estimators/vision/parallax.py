"""Parallax of what stands over the ground, from the homography of the ground and the vertical.

With the ground n' X = h before the first camera, a point moves by X' = R X + t, and a ray x of the ground by
the homography G = R + t n' / h (Hartley and Zisserman 2004, section 13.1). The vertical n is known from the
camera's attitude, so that G alone gives R and t / h: with a and b in the ground, G a = s R a and G b = s R b,
and R n is their cross product. A point of height z over the ground has the depth (h - z) / (n' x), so its ray
is not G x but G x + t (n' x) z / h^2, to the first order: it moves along the line to the epipole (Irani and
Anandan 1998, "A unified approach to moving object detection in 2D and 3D scenes").
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.vision.video_frame import CameraPose

Array = NDArray[np.float64]

_MOST_STRETCH: Final = 1.3


def parallax_px_m(matrix: Array, homography: Array, start_px: Array, pose: CameraPose) -> Array | None:
    """Way (n, 2) in the second picture that a height of 1 m over the ground makes.

    Args:
        matrix: (3, 3) intrinsic matrix.
        homography: (3, 3) of the ground, first picture to second.
        start_px: (n, 2) points in the first picture.
        pose: of the camera at the first picture.

    Returns:
        None: it is no homography of level ground before this camera: a rotation would stretch the ground.
    """
    rays = np.column_stack((start_px, np.ones(len(start_px)))) @ np.linalg.inv(matrix).T
    g = np.linalg.inv(matrix) @ homography @ matrix
    n = pose.down
    a = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
    a /= np.linalg.norm(a)
    b = np.cross(n, a)
    ga, gb = g @ a, g @ b
    length_a, length_b = float(np.linalg.norm(ga)), float(np.linalg.norm(gb))
    scale = float(np.sqrt(length_a * length_b))
    if not (scale > 1e-9 and max(length_a, length_b) < _MOST_STRETCH * min(length_a, length_b)):
        return None
    # a homography has no sign: points before the first camera are before the second
    sign = 1.0 if np.median(rays @ g[2]) > 0.0 else -1.0
    g, ga, gb = g * sign / scale, ga * sign / scale, gb * sign / scale
    step = g @ n - np.cross(ga, gb)  # t / h
    moved = rays @ g.T
    change = (rays @ n / pose.height_m)[:, None] * step
    depth = moved[:, 2:]
    if not np.all(depth > 1e-6):
        return None
    focal = np.array((matrix[0, 0], matrix[1, 1]))
    found: Array = focal * (change[:, :2] - moved[:, :2] / depth * change[:, 2:]) / depth
    return found
