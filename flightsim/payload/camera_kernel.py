"""What a camera would see of all targets in one frame, compiled."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import rotate, rotate_inverse

Array = NDArray[np.float64]

# constants
FOCAL_PX: Final = 0
WIDTH_PX: Final = 1
HEIGHT_PX: Final = 2
MAX_RANGE_M: Final = 3
MIN_SINE: Final = 4  # of the depression
POSITION_FRD_M: Final = slice(5, 8)
PIXEL_NOISE: Final = 8
SIZE_NOISE: Final = 9
QUANTUM_PX: Final = 10
CONSTANTS: Final = 11

# one row for each target
U_PX: Final = 0  # as measured
V_PX: Final = 1
SIZE_RAD: Final = 2  # as measured
SIZE_PX: Final = 3  # true; NaN: not visible
RANGE_M: Final = 4
SINE: Final = 5  # of the line of sight's depression below the horizon
EDGE_PX: Final = 6  # from the target's outline to the nearest edge of the picture; negative: cut off
TRUE_U_PX: Final = 7
TRUE_V_PX: Final = 8
VIEW: Final = 9

_MIN_RANGE_M: Final = 1e-6


@kernel
def _outline_edge_px(
    sight: Array, half_m: float, q_ned_from_frd: Array, q_frd_from_gimbal: Array, constants: Array
) -> float:
    """From the corners of a tag, flat on the ground and north up, to the nearest edge of the picture."""
    corner, body, gimbal = np.zeros(3), np.zeros(3), np.zeros(3)
    focal_px, width_px, height_px = constants[FOCAL_PX], constants[WIDTH_PX], constants[HEIGHT_PX]
    nearest_px = math.inf
    for i in range(4):
        corner[0] = sight[0] + (half_m if i & 1 else -half_m)
        corner[1] = sight[1] + (half_m if i & 2 else -half_m)
        corner[2] = sight[2]
        rotate_inverse(q_ned_from_frd, corner, body)
        rotate_inverse(q_frd_from_gimbal, body, gimbal)
        if gimbal[0] <= 0.0:
            return -math.inf
        right_px, down_px = focal_px * gimbal[1] / gimbal[0], focal_px * gimbal[2] / gimbal[0]
        nearest_px = min(nearest_px, 0.5 * width_px - abs(right_px), 0.5 * height_px - abs(down_px))
    return nearest_px


@kernel
def look(
    q_ned_from_frd: Array,
    q_frd_from_gimbal: Array,
    vehicle_ned_m: Array,
    targets_ned_m: Array,
    sizes_m: Array,
    tagged: NDArray[np.bool_],
    constants: Array,
    normals: Array,
    out: Array,
) -> int:
    """Rows (n, VIEW) of `out` for targets (n, 3), tags where `tagged`; returns how many are visible.

    A target is visible if it is before the camera, within the image both truly and as measured, near enough,
    and far enough below the horizon. `normals` is (n, 3): noise of u, v and size.
    """
    arm, eye, sight, body, gimbal = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    rotate(q_ned_from_frd, constants[POSITION_FRD_M], arm)
    for axis in range(3):
        eye[axis] = vehicle_ned_m[axis] + arm[axis]
    focal_px, width_px, height_px = constants[FOCAL_PX], constants[WIDTH_PX], constants[HEIGHT_PX]
    seen = 0
    for i in range(targets_ned_m.shape[0]):
        out[i, SIZE_PX] = math.nan
        for axis in range(3):
            sight[axis] = targets_ned_m[i, axis] - eye[axis]
        range_m = max(_MIN_RANGE_M, math.sqrt(sight[0] ** 2 + sight[1] ** 2 + sight[2] ** 2))
        out[i, RANGE_M] = range_m
        out[i, SINE] = sight[2] / range_m
        if range_m > constants[MAX_RANGE_M] or sight[2] < constants[MIN_SINE] * range_m:
            continue
        rotate_inverse(q_ned_from_frd, sight, body)
        rotate_inverse(q_frd_from_gimbal, body, gimbal)
        if gimbal[0] <= 0.0:
            continue
        u_px = 0.5 * width_px + focal_px * gimbal[1] / gimbal[0]
        v_px = 0.5 * height_px + focal_px * gimbal[2] / gimbal[0]
        if not (0.0 <= u_px < width_px and 0.0 <= v_px < height_px):
            continue
        out[i, TRUE_U_PX], out[i, TRUE_V_PX] = u_px, v_px
        size_rad = 2.0 * math.atan(0.5 * sizes_m[i] / range_m)
        if tagged[i]:
            out[i, EDGE_PX] = _outline_edge_px(
                sight, 0.5 * sizes_m[i], q_ned_from_frd, q_frd_from_gimbal, constants
            )
        else:
            out[i, EDGE_PX] = min(u_px, v_px, width_px - u_px, height_px - v_px) - 0.5 * focal_px * size_rad
        u_px += constants[PIXEL_NOISE] * normals[i, 0]
        v_px += constants[PIXEL_NOISE] * normals[i, 1]
        quantum_px = constants[QUANTUM_PX]
        if quantum_px > 0.0:
            u_px = math.floor(u_px / quantum_px + 0.5) * quantum_px
            v_px = math.floor(v_px / quantum_px + 0.5) * quantum_px
        if not (0.0 <= u_px < width_px and 0.0 <= v_px < height_px):
            continue
        out[i, U_PX] = u_px
        out[i, V_PX] = v_px
        out[i, SIZE_PX] = focal_px * size_rad
        out[i, SIZE_RAD] = size_rad * max(0.1, 1.0 + constants[SIZE_NOISE] * normals[i, 2])
        seen += 1
    return seen
