"""What a camera would see of all targets in one frame, compiled."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel
from flightsim.foundation.records import Record, Vector3
from flightsim.foundation.rotations import rotate, rotate_inverse

Array = NDArray[np.float64]
RecordArray = NDArray[np.void]

_MIN_RANGE_M: Final = 1e-6


class CameraConstants(Record):
    """What a camera is; its focal length changes with the zoom."""

    focal_px: float
    width_px: float
    height_px: float
    max_range_m: float
    min_sine: float  # of the depression
    position_frd_m: Vector3
    pixel_noise_px: float
    size_noise: float
    quantum_px: float


class TargetSight(Record):
    """What a camera sees of one target."""

    u_px: float  # as measured
    v_px: float
    size_rad: float  # as measured
    size_px: float  # true; NaN: not visible
    range_m: float
    sine: float  # of the line of sight's depression below the horizon
    edge_px: float  # from the target's outline to the nearest edge of the picture; negative: cut off
    true_u_px: float
    true_v_px: float


@kernel
def _outline_edge_px(
    sight: Array, half_m: float, q_ned_from_frd: Array, q_frd_from_gimbal: Array, c: CameraConstants
) -> float:
    """From the corners of a tag, flat on the ground and north up, to the nearest edge of the picture."""
    corner, body, gimbal = np.zeros(3), np.zeros(3), np.zeros(3)
    focal_px, width_px, height_px = c.focal_px, c.width_px, c.height_px
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
    constants: RecordArray,
    normals: Array,
    out: RecordArray,
) -> int:
    """Records (n,) of `out` for targets (n, 3), tags where `tagged`; returns how many are visible.

    A target is visible if it is before the camera, within the image both truly and as measured, near enough,
    and far enough below the horizon. `normals` is (n, 3): noise of u, v and size.
    """
    c: CameraConstants = constants[0]
    arm, eye, sight, body, gimbal = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    rotate(q_ned_from_frd, c.position_frd_m, arm)
    for axis in range(3):
        eye[axis] = vehicle_ned_m[axis] + arm[axis]
    focal_px, width_px, height_px = c.focal_px, c.width_px, c.height_px
    seen = 0
    for i in range(targets_ned_m.shape[0]):
        out[i].size_px = math.nan
        for axis in range(3):
            sight[axis] = targets_ned_m[i, axis] - eye[axis]
        range_m = max(_MIN_RANGE_M, math.sqrt(sight[0] ** 2 + sight[1] ** 2 + sight[2] ** 2))
        out[i].range_m = range_m
        out[i].sine = sight[2] / range_m
        if range_m > c.max_range_m or sight[2] < c.min_sine * range_m:
            continue
        rotate_inverse(q_ned_from_frd, sight, body)
        rotate_inverse(q_frd_from_gimbal, body, gimbal)
        if gimbal[0] <= 0.0:
            continue
        u_px = 0.5 * width_px + focal_px * gimbal[1] / gimbal[0]
        v_px = 0.5 * height_px + focal_px * gimbal[2] / gimbal[0]
        if not (0.0 <= u_px < width_px and 0.0 <= v_px < height_px):
            continue
        out[i].true_u_px, out[i].true_v_px = u_px, v_px
        size_rad = 2.0 * math.atan(0.5 * sizes_m[i] / range_m)
        if tagged[i]:
            out[i].edge_px = _outline_edge_px(sight, 0.5 * sizes_m[i], q_ned_from_frd, q_frd_from_gimbal, c)
        else:
            out[i].edge_px = min(u_px, v_px, width_px - u_px, height_px - v_px) - 0.5 * focal_px * size_rad
        u_px += c.pixel_noise_px * normals[i, 0]
        v_px += c.pixel_noise_px * normals[i, 1]
        quantum_px = c.quantum_px
        if quantum_px > 0.0:
            u_px = math.floor(u_px / quantum_px + 0.5) * quantum_px
            v_px = math.floor(v_px / quantum_px + 0.5) * quantum_px
        if not (0.0 <= u_px < width_px and 0.0 <= v_px < height_px):
            continue
        out[i].u_px = u_px
        out[i].v_px = v_px
        out[i].size_px = focal_px * size_rad
        out[i].size_rad = size_rad * max(0.1, 1.0 + c.size_noise * normals[i, 2])
        seen += 1
    return seen
