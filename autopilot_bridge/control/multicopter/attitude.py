"""Quaternion attitude P control with reduced yaw weight, and body-rate PID (both as PX4 publishes them).

Attitude: Brescianini, Hehn, D'Andrea, "Nonlinear quadrocopter attitude control", ETH Zurich 2013: the
shortest rotation that aligns the thrust axes comes first, the remaining rotation about it is weighted down.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.multicopter.layout import MulticopterState
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import body_axis, multiply

Array = NDArray[np.float64]

_INTEGRAL_FADE_RAD_S: Final = math.radians(400.0)  # the integrator rests during flips (PX4)


@kernel
def body_z_of(q: Array) -> tuple[float, float, float]:
    """Third column of R(q): the body's down axis in NED."""
    return body_axis(q[0], q[1], q[2], q[3], 2)


@kernel
def quaternion_from_thrust_axis(zx: float, zy: float, zz: float, yaw: float, q: Array) -> None:
    """q = attitude whose down axis is the unit vector z (NED) and whose nose points to `yaw`."""
    cy, sy = math.cos(yaw), math.sin(yaw)
    # x axis: across z and the horizontal right-hand direction (-sin yaw, cos yaw, 0)
    xx, xy, xz = cy * zz, sy * zz, -sy * zy - cy * zx
    norm = math.sqrt(xx * xx + xy * xy + xz * xz)
    if norm < 1e-6:
        xx, xy, xz, norm = 0.0, 0.0, 1.0, 1.0
    elif zz < 0.0:
        norm = -norm
    xx, xy, xz = xx / norm, xy / norm, xz / norm
    yx, yy, yz = zy * xz - zz * xy, zz * xx - zx * xz, zx * xy - zy * xx
    trace = xx + yy + zz
    if trace > 0.0:
        s = math.sqrt(1.0 + trace)
        q[0] = 0.5 * s
        q[1], q[2], q[3] = 0.5 * (yz - zy) / s, 0.5 * (zx - xz) / s, 0.5 * (xy - yx) / s
    elif xx >= yy and xx >= zz:
        s = math.sqrt(1.0 + xx - yy - zz)
        q[1] = 0.5 * s
        q[0], q[2], q[3] = 0.5 * (yz - zy) / s, 0.5 * (yx + xy) / s, 0.5 * (zx + xz) / s
    elif yy >= zz:
        s = math.sqrt(1.0 + yy - xx - zz)
        q[2] = 0.5 * s
        q[0], q[1], q[3] = 0.5 * (zx - xz) / s, 0.5 * (yx + xy) / s, 0.5 * (zy + yz) / s
    else:
        s = math.sqrt(1.0 + zz - xx - yy)
        q[3] = 0.5 * s
        q[0], q[1], q[2] = 0.5 * (xy - yx) / s, 0.5 * (zx + xz) / s, 0.5 * (zy + yz) / s


@kernel
def attitude_control(
    q: Array, q_sp: Array, yaw_rate_ff: float, p: MulticopterParameters, rate_sp: Array, w: Array
) -> None:
    """rate_sp (3,) FRD from the attitude error; `yaw_rate_ff` about NED down; `w` (8,) is scratch."""
    ex, ey, ez = body_z_of(q)
    dx, dy, dz = body_z_of(q_sp)
    # reduced attitude: shortest rotation, in NED, from the present to the wanted thrust axis
    cosine = ex * dx + ey * dy + ez * dz
    a = w[0:4]
    b = w[4:8]
    if cosine < -0.99999:
        for i in range(4):
            a[i] = q_sp[i]  # opposite axes: every rotation is as short, so go for the full attitude
    else:
        b[0] = 1.0 + cosine
        b[1], b[2], b[3] = ey * dz - ez * dy, ez * dx - ex * dz, ex * dy - ey * dx
        norm = 1.0 / math.sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2] + b[3] * b[3])
        b[0], b[1], b[2], b[3] = b[0] * norm, b[1] * norm, b[2] * norm, b[3] * norm
        multiply(b, q, a)
        # the rest is a rotation about body z; scale its angle
        mw = a[0] * q_sp[0] + a[1] * q_sp[1] + a[2] * q_sp[2] + a[3] * q_sp[3]
        mz = a[0] * q_sp[3] - a[1] * q_sp[2] + a[2] * q_sp[1] - a[3] * q_sp[0]
        half = math.atan2(mz, mw)
        if half > 0.5 * math.pi:
            half -= math.pi
        elif half < -0.5 * math.pi:
            half += math.pi
        half *= p.yaw_weight
        cw, cz = math.cos(half), math.sin(half)
        a[0], a[1], a[2], a[3] = (
            a[0] * cw - a[3] * cz,
            a[1] * cw + a[2] * cz,
            a[2] * cw - a[1] * cz,
            a[3] * cw + a[0] * cz,
        )
    # error quaternion q^-1 (x) a, its vector part doubled
    qw = q[0] * a[0] + q[1] * a[1] + q[2] * a[2] + q[3] * a[3]
    sign = 2.0 if qw >= 0.0 else -2.0
    yaw_p = p.yaw_p_1_s
    if p.yaw_weight > 1e-4:
        yaw_p /= p.yaw_weight  # small yaw errors keep their full gain
    rate_sp[0] = p.roll_p_1_s * sign * (q[0] * a[1] - q[1] * a[0] - q[2] * a[3] + q[3] * a[2])
    rate_sp[1] = p.pitch_p_1_s * sign * (q[0] * a[2] + q[1] * a[3] - q[2] * a[0] - q[3] * a[1])
    rate_sp[2] = yaw_p * sign * (q[0] * a[3] - q[1] * a[2] + q[2] * a[1] - q[3] * a[0])
    # NED down axis in body: third row of R(q)
    rate_sp[0] += yaw_rate_ff * 2.0 * (q[1] * q[3] - q[0] * q[2])
    rate_sp[1] += yaw_rate_ff * 2.0 * (q[2] * q[3] + q[0] * q[1])
    rate_sp[2] += yaw_rate_ff * ez


@kernel
def limit_rates(rate_sp: Array, p: MulticopterParameters) -> None:
    """Clip to the rate limits, in place."""
    rate_sp[0] = min(p.roll_rate_max_rad_s, max(-p.roll_rate_max_rad_s, rate_sp[0]))
    rate_sp[1] = min(p.pitch_rate_max_rad_s, max(-p.pitch_rate_max_rad_s, rate_sp[1]))
    rate_sp[2] = min(p.yaw_rate_max_rad_s, max(-p.yaw_rate_max_rad_s, rate_sp[2]))


@kernel
def _rate_axis(
    axis: int,
    gains: tuple[float, float, float, float, float, float],
    rates: Array,
    rate_sp: Array,
    s: MulticopterState,
    alpha: float,
    dt: float,
    integrate: bool,
) -> None:
    """The rate PID of one axis; gains are p, i, d, feed-forward, k and the limit of the integral."""
    kp, ki, kd, ff, k, limit = gains
    error = rate_sp[axis] - rates[axis]
    raw = (rates[axis] - s.rate_previous[axis]) / dt
    s.rate_previous[axis] = rates[axis]
    s.rate_derivative[axis] += alpha * (raw - s.rate_derivative[axis])
    torque = k * (kp * error + s.rate_integral[axis] - kd * s.rate_derivative[axis]) + ff * rate_sp[axis]
    missing = s.unallocated[axis]
    winding = (missing > 0.01 and error > 0.0) or (missing < -0.01 and error < 0.0)
    if integrate and not winding:
        fade = error / _INTEGRAL_FADE_RAD_S
        step = max(0.0, 1.0 - fade * fade) * ki * error * dt
        s.rate_integral[axis] = min(limit, max(-limit, s.rate_integral[axis] + step))
    s.unallocated[axis] = torque


@kernel
def rate_control(
    rates: Array, rate_sp: Array, p: MulticopterParameters, s: MulticopterState, dt: float, integrate: bool
) -> None:
    """Torques of the rate PID, left in UNALLOCATED of the state `s` for the mixer."""
    alpha = dt / (dt + 1.0 / (2.0 * math.pi * p.rate_derivative_cutoff_hz))
    roll = (
        *(p.rate_roll_p, p.rate_roll_i, p.rate_roll_d),
        *(p.rate_roll_ff, p.rate_roll_k, p.rate_roll_integral_max),
    )
    pitch = (
        *(p.rate_pitch_p, p.rate_pitch_i, p.rate_pitch_d),
        *(p.rate_pitch_ff, p.rate_pitch_k, p.rate_pitch_integral_max),
    )
    yaw = (
        *(p.rate_yaw_p, p.rate_yaw_i, p.rate_yaw_d),
        *(p.rate_yaw_ff, p.rate_yaw_k, p.rate_yaw_integral_max),
    )
    _rate_axis(0, roll, rates, rate_sp, s, alpha, dt, integrate)
    _rate_axis(1, pitch, rates, rate_sp, s, alpha, dt, integrate)
    _rate_axis(2, yaw, rates, rate_sp, s, alpha, dt, integrate)
