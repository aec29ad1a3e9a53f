"""Angle, quaternion and rotation kernels (compiled, allocation-free). Quaternions are Hamilton, w x y z."""

import math

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation import vectors
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

wrap_pi = kernel(vectors.wrap_pi)
wrap_180 = kernel(vectors.wrap_180)
yaw_of = kernel(vectors.yaw_of)


@kernel
def rotate(q: Array, v: Array, out: Array) -> None:
    """out = R(q) v: with q_a_from_b and v in b, out is v in a. `out` may not alias `v`."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    tx = 2.0 * (y * v[2] - z * v[1])
    ty = 2.0 * (z * v[0] - x * v[2])
    tz = 2.0 * (x * v[1] - y * v[0])
    out[0] = v[0] + w * tx + y * tz - z * ty
    out[1] = v[1] + w * ty + z * tx - x * tz
    out[2] = v[2] + w * tz + x * ty - y * tx


@kernel
def rotate_inverse(q: Array, v: Array, out: Array) -> None:
    """out = R(q)^T v: with q_a_from_b and v in a, out is v in b. `out` may not alias `v`."""
    w, x, y, z = q[0], -q[1], -q[2], -q[3]
    tx = 2.0 * (y * v[2] - z * v[1])
    ty = 2.0 * (z * v[0] - x * v[2])
    tz = 2.0 * (x * v[1] - y * v[0])
    out[0] = v[0] + w * tx + y * tz - z * ty
    out[1] = v[1] + w * ty + z * tx - x * tz
    out[2] = v[2] + w * tz + x * ty - y * tx


@kernel
def body_axis(w: float, x: float, y: float, z: float, axis: int) -> tuple[float, float, float]:
    """Column `axis` of R(q): with q_a_from_b, that axis of b in a."""
    if axis == 0:
        return 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)
    if axis == 1:
        return 2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)
    return 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)


@kernel
def multiply(a: Array, b: Array, out: Array) -> None:
    """out = a (x) b (Hamilton product). `out` may not alias `a` or `b`."""
    out[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    out[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    out[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    out[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]


@kernel
def integrate(q: Array, dx: float, dy: float, dz: float) -> None:
    """q <- q (x) exp(d/2) in place, d the rotation vector in the body frame (rad); renormalises."""
    angle_sq = dx * dx + dy * dy + dz * dz
    if angle_sq < 1e-12:
        s = 0.5 - angle_sq / 48.0
        c = 1.0 - angle_sq / 8.0
    else:
        angle = math.sqrt(angle_sq)
        s = math.sin(0.5 * angle) / angle
        c = math.cos(0.5 * angle)
    bx, by, bz = s * dx, s * dy, s * dz
    w, x, y, z = q[0], q[1], q[2], q[3]
    nw = w * c - x * bx - y * by - z * bz
    nx = w * bx + x * c + y * bz - z * by
    ny = w * by - x * bz + y * c + z * bx
    nz = w * bz + x * by - y * bx + z * c
    n = 1.0 / math.sqrt(nw * nw + nx * nx + ny * ny + nz * nz)
    q[0], q[1], q[2], q[3] = nw * n, nx * n, ny * n, nz * n


@kernel
def euler_from_quaternion(q: Array, out: Array) -> None:
    """out = (roll, pitch, yaw) in rad, ZYX order, from q_ned_from_frd."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    out[0] = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    s = 2.0 * (w * y - z * x)
    out[1] = math.asin(min(1.0, max(-1.0, s)))
    out[2] = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@kernel
def quaternion_from_euler(roll: float, pitch: float, yaw: float, out: Array) -> None:
    """out = q_ned_from_frd from roll, pitch, yaw in rad (ZYX order)."""
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    cy, sy = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    out[0] = cr * cp * cy + sr * sp * sy
    out[1] = sr * cp * cy - cr * sp * sy
    out[2] = cr * sp * cy + sr * cp * sy
    out[3] = cr * cp * sy - sr * sp * cy
