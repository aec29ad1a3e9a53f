"""Angles and rotations in plain numbers and NumPy arrays: for a few per image or message, and for logs.

Compiled code uses `rotations`, which has the same in kernels. Quaternions are Hamilton, (w, x, y, z), and
named `q_a_from_b`.
"""

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Angle = TypeVar("Angle", float, Array)
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
LevelVector = tuple[float, float]
ImagePoint = tuple[float, float]
"""Normalized image coordinates: to the right and down, over the distance along the optical axis."""


def wrap_pi(angle_rad: Angle) -> Angle:
    """Angle, or array of angles, in rad wrapped to [-pi, pi)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


def wrap_180(angle_deg: Angle) -> Angle:
    """Angle or longitude, or array of them, in degrees wrapped to [-180, 180)."""
    return (angle_deg + 180.0) % 360.0 - 180.0


def rotate(q: Quaternion, v: Vector) -> Vector:
    """`v_a` of `v_b`, for `q_a_from_b`."""
    w, x, y, z = q
    vx, vy, vz = v
    tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
    return (vx + w * tx + y * tz - z * ty, vy + w * ty + z * tx - x * tz, vz + w * tz + x * ty - y * tx)


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """The rotation by b, then by a: `q_a_from_c` of `q_a_from_b` and `q_b_from_c`."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """`q_b_from_a` of `q_a_from_b`."""
    return (q[0], -q[1], -q[2], -q[3])


def from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """`q_ned_from_frd` of ZYX Euler angles."""
    cr, sr = math.cos(0.5 * roll_rad), math.sin(0.5 * roll_rad)
    cp, sp = math.cos(0.5 * pitch_rad), math.sin(0.5 * pitch_rad)
    cy, sy = math.cos(0.5 * yaw_rad), math.sin(0.5 * yaw_rad)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def euler_of(q: Sequence[float]) -> Vector:
    """Roll, pitch, yaw (ZYX, rad) of `q_ned_from_frd`, (4,)."""
    w, x, y, z = q
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return roll, math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))), yaw_of(q)


def yaw_of(q: Sequence[float] | Array) -> float:
    """Heading of `q_ned_from_frd`, (4,)."""
    w, x, y, z = q
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def between(a: Quaternion, b: Quaternion, share: float) -> Quaternion:
    """From `a` (share 0) to `b` (share 1), along the chord and normalized: exact enough for 50 ms."""
    sign = 1.0 if sum(p * q for p, q in zip(a, b, strict=True)) >= 0.0 else -1.0
    w, x, y, z = (p + share * (sign * q - p) for p, q in zip(a, b, strict=True))
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    return (w / norm, x / norm, y / norm, z / norm)


def euler_from_quaternions(q: NDArray[np.floating]) -> tuple[Array, Array, Array]:
    """Roll, pitch, yaw (ZYX, rad) of quaternions q_ned_from_frd, (n, 4)."""
    w, x, y, z = (q[:, index].astype(np.float64) for index in range(4))
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, pitch, yaw


def quaternions_from_euler(roll_rad: Array, pitch_rad: Array, yaw_rad: Array) -> Array:
    """q_ned_from_frd, (n, 4), of ZYX Euler angles."""
    (cr, cp, cy), (sr, sp, sy) = (
        [function(0.5 * angle) for angle in (roll_rad, pitch_rad, yaw_rad)] for function in (np.cos, np.sin)
    )
    return np.column_stack(
        (
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        )
    )
