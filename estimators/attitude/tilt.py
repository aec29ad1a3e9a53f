"""Roll and pitch as the direction down in the body: its motion, its correction, and the gyro bias (compiled).

The direction down, `d = R_b^l' e_3`, is the paper's (seed 004) R_b^l without anything of yaw: with the
projector of (3) and (11), `R' = R [(I - d d') w]x` moves d by `d' = -w x d`, for d x d = 0. R is rebuilt from
roll and pitch where it is needed, so no yaw creeps in.
"""

import math

import numpy as np
from numpy.typing import NDArray

from estimators.attitude import layout as at
from estimators.attitude import parameters as par
from flightsim.kernels import kernel

Array = NDArray[np.float64]

GRAVITY_M_S2 = 9.80665
_LENGTH_MEAN_S = 0.3
_REST_MEAN_S = 0.5
_REST_RATE_RAD_S = 0.02
_REST_BIAS_RAD_S = 0.1
_REST_FORCE_M_S2 = 0.3
_REST_WEIGHT_M_S2 = 0.5
_REST_AFTER_S = 1.0
_REST_PRIOR_S = 2.0
_BIAS_MAX_RAD_S = 0.2


@kernel
def rotate(x: Array, dt: float, wx: float, wy: float, wz: float) -> None:
    """Turn the direction down by a constant rate over a time, exactly (Rodrigues).

    Args:
        x: state.
        dt: s.
        wx, wy, wz: angular rate without bias, rad/s, FRD.
    """
    dx, dy, dz = x[at.DOWN], x[at.DOWN + 1], x[at.DOWN + 2]
    angle = math.sqrt(wx * wx + wy * wy + wz * wz) * dt
    if angle > 1e-9:
        first, second = math.sin(angle) / angle * dt, (1.0 - math.cos(angle)) / (angle * angle) * dt * dt
    else:
        first, second = dt, 0.5 * dt * dt
    cx, cy, cz = wy * dz - wz * dy, wz * dx - wx * dz, wx * dy - wy * dx
    x[at.DOWN] = dx - first * cx + second * (wy * cz - wz * cy)
    x[at.DOWN + 1] = dy - first * cy + second * (wz * cx - wx * cz)
    x[at.DOWN + 2] = dz - first * cz + second * (wx * cy - wy * cx)


@kernel
def correct(x: Array, p: Array, dt: float) -> float:
    """Pull the direction down towards the reference (11)-(13), and learn the gyro bias (12).

    In the first seconds the gain is the one of a running mean, so that any start is forgotten.

    Args:
        x: state; its REFERENCE, m/s^2, FRD.
        p: coefficients.
        dt: s.

    Returns:
        How much of the innovation went into the attitude, 0..1.
    """
    mx, my, mz = x[at.REFERENCE], x[at.REFERENCE + 1], x[at.REFERENCE + 2]
    length = math.sqrt(mx * mx + my * my + mz * mz)
    if length < 1e-3:
        x[at.WEIGHT] = 0.0
        return 0.0
    dx, dy, dz = x[at.DOWN], x[at.DOWN + 1], x[at.DOWN + 2]
    # Judged by its mean over a moment: vibration is no reason to trust it less.
    x[at.LENGTH] += min(1.0, dt / _LENGTH_MEAN_S) * (length - x[at.LENGTH])
    off = (x[at.LENGTH] - GRAVITY_M_S2) / p[par.TOLERANCE]
    weight = 1.0 / (1.0 + off * off)
    mx /= length
    my /= length
    mz /= length
    x[at.WEIGHT] = weight
    ex, ey, ez = my * dz - mz * dy, mz * dx - mx * dz, mx * dy - my * dx
    along = mx * dx + my * dy + mz * dz
    x[at.INNOVATION] = math.atan2(math.sqrt(ex * ex + ey * ey + ez * ez), along)
    gain = min(1.0, max(p[par.GAIN], 1.0 / (x[at.AGE] + dt)) * weight * dt)
    dx += gain * (mx - along * dx)
    dy += gain * (my - along * dy)
    dz += gain * (mz - along * dz)
    if along < -0.999:  # upside down: the innovation vanishes there, so step off the wrong pole
        dy += 0.01
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    x[at.DOWN] = dx / length
    x[at.DOWN + 1] = dy / length
    x[at.DOWN + 2] = dz / length
    if gain <= p[par.GAIN] * dt:  # the mean of the start is over
        bias = p[par.BIAS_GAIN] * weight * dt
        x[at.GYRO_BIAS] = _within(x[at.GYRO_BIAS] - bias * ex, _BIAS_MAX_RAD_S)
        x[at.GYRO_BIAS + 1] = _within(x[at.GYRO_BIAS + 1] - bias * ey, _BIAS_MAX_RAD_S)
        x[at.GYRO_BIAS + 2] = _within(x[at.GYRO_BIAS + 2] - bias * ez, _BIAS_MAX_RAD_S)
    return gain


@kernel
def rest(
    x: Array,
    p: Array,
    dt: float,
    disarmed: bool,
    wx: float,
    wy: float,
    wz: float,
    ax: float,
    ay: float,
    az: float,
) -> float:
    """See whether the vehicle stands still; if so, what the gyro reads is its bias.

    Args:
        x: state.
        p: coefficients.
        dt: s.
        disarmed: it can't be flying.
        wx, wy, wz: measured rate, rad/s, FRD.
        ax, ay, az: specific force, m/s^2, FRD.

    Returns:
        Gain of the mean by which the bias was moved; 0 when not at rest.
    """
    slow = min(1.0, dt / _REST_MEAN_S)
    still = abs(math.sqrt(ax * ax + ay * ay + az * az) - GRAVITY_M_S2) < _REST_WEIGHT_M_S2
    for axis, rate, force in ((0, wx, ax), (1, wy, ay), (2, wz, az)):
        x[at.MEAN_RATE + axis] += slow * (rate - x[at.MEAN_RATE + axis])
        x[at.MEAN_FORCE + axis] += slow * (force - x[at.MEAN_FORCE + axis])
        still = (
            still
            and abs(rate - x[at.MEAN_RATE + axis]) < _REST_RATE_RAD_S
            and abs(x[at.MEAN_RATE + axis]) < _REST_BIAS_RAD_S
            and abs(force - x[at.MEAN_FORCE + axis]) < _REST_FORCE_M_S2
        )
    x[at.REST_TIME] = x[at.REST_TIME] + dt if still and disarmed else 0.0
    if x[at.REST_TIME] < _REST_AFTER_S:
        return 0.0
    # The mean of all rest so far, zero counting for a moment of it: a gust that rocks the vehicle is no bias.
    x[at.REST_SUM] = min(x[at.REST_SUM] + dt, p[par.REST_BIAS_TIME])
    gain = min(1.0, dt / (_REST_PRIOR_S + x[at.REST_SUM]))
    x[at.GYRO_BIAS] += gain * (wx - x[at.GYRO_BIAS])
    x[at.GYRO_BIAS + 1] += gain * (wy - x[at.GYRO_BIAS + 1])
    x[at.GYRO_BIAS + 2] += gain * (wz - x[at.GYRO_BIAS + 2])
    return gain


@kernel
def _within(value: float, limit: float) -> float:
    return min(limit, max(-limit, value))
