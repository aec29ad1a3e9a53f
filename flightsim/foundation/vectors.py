"""Rotations of single vectors, in plain numbers: for a few vectors per image or message.

Quaternions are Hamilton, (w, x, y, z), and named `q_a_from_b`.
"""

import math
from collections.abc import Sequence

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def rotate(q: Quaternion, v: Vector) -> Vector:
    """`v_a` of `v_b`, for `q_a_from_b`."""
    w, x, y, z = q
    vx, vy, vz = v
    tx, ty, tz = 2.0 * (y * vz - z * vy), 2.0 * (z * vx - x * vz), 2.0 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


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


def yaw_of(q: Sequence[float]) -> float:
    """Heading of `q_ned_from_frd`, (4,)."""
    w, x, y, z = q
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def between(a: Quaternion, b: Quaternion, share: float) -> Quaternion:
    """From `a` (share 0) to `b` (share 1), along the chord and normalized: exact enough for 50 ms."""
    sign = 1.0 if sum(p * q for p, q in zip(a, b, strict=True)) >= 0.0 else -1.0
    w, x, y, z = (p + share * (sign * q - p) for p, q in zip(a, b, strict=True))
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    return (w / norm, x / norm, y / norm, z / norm)
