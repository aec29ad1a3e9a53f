"""Strapdown mechanisation: attitude, velocity and position from gyro and accelerometer, every physics step.

Trapezoidal rules on both sensors (second order for samples at the ends of the step), gravity of the origin,
the Earth's rotation removed from the gyro, Coriolis acceleration from the velocity (Groves, "Principles of
GNSS, Inertial, and Multisensor Integrated Navigation Systems", 2nd ed., section 5.4; transport rate
neglected: below 1e-6 rad/s here).
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import layout as n
from autopilot_bridge.navigation.states import (
    ACCEL,
    CORRECTION_POS,
    CORRECTION_VEL,
    EARTH_RATE,
    FORCE_NED,
    GRAVITY,
    GYRO,
    GYRO_LAST,
    HISTORY_POS,
    HISTORY_Q,
    HISTORY_VEL,
    INVALID_SAMPLES,
    SAMPLE_AGE_S,
    STRETCH,
    SUM_FORCE,
    SUM_GYRO,
    SUM_GYRO_TIME,
    SUM_R,
    SUM_TIME,
    SUM_TURN,
    TERRAIN_DOWN,
    X_ACCEL_BIAS,
    X_GYRO_BIAS,
    X_POS,
    X_VEL,
    Q,
    R,
)
from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import body_axis
from flightsim.interface import IMU_ACCEL_FRD_M_S2, IMU_GYRO_FRD_RAD_S

Array = NDArray[np.float64]

_IMU_GYRO: Final[int] = IMU_GYRO_FRD_RAD_S.start
_IMU_ACCEL: Final[int] = IMU_ACCEL_FRD_M_S2.start
_GYRO_BIAS: Final[int] = n.GYRO_BIAS_RAD_S.start
_ACCEL_BIAS: Final[int] = n.ACCEL_BIAS_M_S2.start


@kernel
def take_sample(core: Array, imu: Array, gyro_range: float, accel_range: float) -> None:
    """Take a fresh IMU sample into `core` if it is finite and within range; else count it and keep the last
    one."""
    good = True
    for i in range(3):
        good = good and abs(imu[_IMU_GYRO + i]) <= gyro_range  # False for NaN
        good = good and abs(imu[_IMU_ACCEL + i]) <= accel_range
    if good:
        for i in range(3):
            core[GYRO + i] = imu[_IMU_GYRO + i]
            core[ACCEL + i] = imu[_IMU_ACCEL + i]
        core[SAMPLE_AGE_S] = 0.0
    else:
        core[INVALID_SAMPLES] += 1.0


@kernel
def refresh_rotation(core: Array) -> None:
    """Rotation matrix in `core` from its quaternion."""
    w, x, y, z = core[Q], core[Q + 1], core[Q + 2], core[Q + 3]
    for axis in range(3):
        core[R + axis], core[R + 3 + axis], core[R + 6 + axis] = body_axis(w, x, y, z, axis)


@kernel
def advance(core: Array, dt: float, sample_timeout_s: float) -> None:
    """Carry the nominal state over one step and add to the sums of the covariance prediction."""
    core[SAMPLE_AGE_S] += dt
    gx, gy, gz = core[GYRO], core[GYRO + 1], core[GYRO + 2]
    bx, by, bz = core[X_GYRO_BIAS], core[X_GYRO_BIAS + 1], core[X_GYRO_BIAS + 2]
    alive = core[SAMPLE_AGE_S] <= sample_timeout_s
    if not alive:  # without an IMU the least wrong guess is no motion
        gx, gy, gz = bx, by, bz
    ex, ey, ez = core[EARTH_RATE], core[EARTH_RATE + 1], core[EARTH_RATE + 2]
    dx = (0.5 * (gx + core[GYRO_LAST]) - bx - (core[R] * ex + core[R + 3] * ey + core[R + 6] * ez)) * dt
    dy = (
        0.5 * (gy + core[GYRO_LAST + 1]) - by - (core[R + 1] * ex + core[R + 4] * ey + core[R + 7] * ez)
    ) * dt
    dz = (
        0.5 * (gz + core[GYRO_LAST + 2]) - bz - (core[R + 2] * ex + core[R + 5] * ey + core[R + 8] * ez)
    ) * dt
    core[GYRO_LAST], core[GYRO_LAST + 1], core[GYRO_LAST + 2] = gx, gy, gz
    for i in range(3):
        turned = core[R + 3 * i] * dx + core[R + 3 * i + 1] * dy + core[R + 3 * i + 2] * dz
        core[SUM_TURN + i] += abs(turned)
        core[SUM_GYRO + i] += core[GYRO_LAST + i] * dt
    core[SUM_GYRO_TIME] += dt

    angle_sq = dx * dx + dy * dy + dz * dz
    s = 0.5 - angle_sq / 48.0
    c = 1.0 - angle_sq / 8.0
    if angle_sq > 1e-6:
        angle = math.sqrt(angle_sq)
        s = math.sin(0.5 * angle) / angle
        c = math.cos(0.5 * angle)
    dx, dy, dz = s * dx, s * dy, s * dz
    w, x, y, z = core[Q], core[Q + 1], core[Q + 2], core[Q + 3]
    nw = w * c - x * dx - y * dy - z * dz
    nx = w * dx + x * c + y * dz - z * dy
    ny = w * dy - x * dz + y * c + z * dx
    nz = w * dz + x * dy - y * dx + z * c
    n = 1.0 / math.sqrt(nw * nw + nx * nx + ny * ny + nz * nz)
    core[Q], core[Q + 1], core[Q + 2], core[Q + 3] = nw * n, nx * n, ny * n, nz * n
    refresh_rotation(core)

    g = core[GRAVITY]
    fx = core[ACCEL] - core[X_ACCEL_BIAS]
    fy = core[ACCEL + 1] - core[X_ACCEL_BIAS + 1]
    fz = core[ACCEL + 2] - core[X_ACCEL_BIAS + 2]
    vx, vy, vz = core[X_VEL], core[X_VEL + 1], core[X_VEL + 2]
    for i in range(3):
        force = core[R + 3 * i] * fx + core[R + 3 * i + 1] * fy + core[R + 3 * i + 2] * fz
        if not alive:
            force = -g if i == 2 else 0.0
        dv = 0.5 * (core[FORCE_NED + i] + force) * dt
        core[FORCE_NED + i] = force
        core[SUM_FORCE + i] += dv
        # Coriolis: -2 earth_rate x velocity
        if i == 0:
            acceleration = -2.0 * (ey * vz - ez * vy)
        elif i == 1:
            acceleration = -2.0 * (ez * vx - ex * vz)
        else:
            acceleration = g - 2.0 * (ex * vy - ey * vx)
        dv += acceleration * dt
        moved = (core[X_VEL + i] + 0.5 * dv) * dt
        core[X_POS + i] += moved * core[STRETCH + i] if i < 2 else moved
        core[X_VEL + i] += dv
    for i in range(9):
        core[SUM_R + i] += core[R + i] * dt
    core[SUM_TIME] += dt


@kernel
def write_navigation(core: Array, nav: Array) -> None:
    """The autopilot's navigation state (layout.py) from `core`."""
    for i in range(4):
        nav[n.Q + i] = core[Q + i]
    for i in range(3):
        nav[n.RATES + i] = core[GYRO_LAST + i] - core[X_GYRO_BIAS + i]
        nav[n.VEL + i] = core[X_VEL + i]
        nav[n.POS + i] = core[X_POS + i]
        nav[n.ACC + i] = core[FORCE_NED + i]
        nav[_GYRO_BIAS + i] = core[X_GYRO_BIAS + i]
        nav[_ACCEL_BIAS + i] = core[X_ACCEL_BIAS + i]
        nav[n.FORCE + i] = core[ACCEL + i] - core[X_ACCEL_BIAS + i]
    nav[n.ACC + 2] += core[GRAVITY]
    nav[n.ROLL] = math.atan2(core[R + 7], core[R + 8])
    nav[n.PITCH] = math.asin(min(1.0, max(-1.0, -core[R + 6])))
    nav[n.YAW] = math.atan2(core[R + 3], core[R])
    nav[n.HEIGHT_ABOVE_GROUND_M] = core[TERRAIN_DOWN] - core[X_POS + 2]


@kernel
def step(
    core: Array,
    nav: Array,
    history: Array,
    imu: Array,
    dt: float,
    gyro_range: float,
    accel_range: float,
    sample_timeout_s: float,
    fresh: bool,
    row: int,
) -> None:
    """One physics step: take the sample, mechanise, write `nav` and row `row` of `history` (shape (n,
    10))."""
    if fresh:
        take_sample(core, imu, gyro_range, accel_range)
    advance(core, dt, sample_timeout_s)
    write_navigation(core, nav)
    for i in range(3):
        history[row, HISTORY_POS + i] = core[X_POS + i] - core[CORRECTION_POS + i]
        history[row, HISTORY_VEL + i] = core[X_VEL + i] - core[CORRECTION_VEL + i]
    for i in range(4):
        history[row, HISTORY_Q + i] = core[Q + i]
