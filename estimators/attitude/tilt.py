"""Roll and pitch as the direction down in the body frame: motion, correction and gyro bias (compiled).

The direction down, `d = R^T e_3`, is the rotation R from body to level of Tolman et al. 2021 without yaw:
with the projector of (3) and (11), `R' = R [(I - d d^T) w]x` moves d by `d' = -w x d`, for d x d = 0. R is
therefore rebuilt from roll and pitch when it is needed, and yaw cannot accumulate in it.
"""

import math

import numpy as np
from numpy.typing import NDArray

from estimators.attitude import layout as at
from estimators.attitude import parameters as par
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

_LENGTH_MEAN_S = 0.3
_SLOW_S = 0.5
_AGREEMENT_RAD = 0.03
_REST_MEAN_S = 0.5
_REST_NOISE_RAD_S = 0.02
_REST_RATE_RAD_S = 0.1
_REST_AFTER_S = 1.0
_REST_PRIOR_S = 2.0
_BIAS_MAX_RAD_S = 0.2


@kernel
def rotate(x: Array, place: int, dt: float, wx: float, wy: float, wz: float) -> None:
    """Keep a vector of the state, given in FRD, in its inertial direction while the body rotates at a
    constant rate, exactly (Rodrigues).

    Args:
        x: state.
        place: index of the vector.
        dt: s.
        wx, wy, wz: angular rate without bias, rad/s, FRD.
    """
    dx, dy, dz = x[place], x[place + 1], x[place + 2]
    angle = math.sqrt(wx * wx + wy * wy + wz * wz) * dt
    if angle > 1e-9:
        first, second = math.sin(angle) / angle * dt, (1.0 - math.cos(angle)) / (angle * angle) * dt * dt
    else:
        first, second = dt, 0.5 * dt * dt
    cx, cy, cz = wy * dz - wz * dy, wz * dx - wx * dz, wx * dy - wy * dx
    x[place] = dx - first * cx + second * (wy * cz - wz * cy)
    x[place + 1] = dy - first * cy + second * (wz * cx - wx * cz)
    x[place + 2] = dz - first * cz + second * (wx * cy - wy * cx)


@kernel
def correct(x: Array, dt: float, k_p: float, k_i: float, tolerance: float) -> float:
    """Correct the direction down towards the reference (11)-(13), and estimate the gyro bias (12).

    In the first seconds the gain is that of a running mean, so that the initial value has no lasting effect.

    Args:
        x: state; its REFERENCE, m/s^2, FRD.
        dt: s.
        k_p, k_i: gains, 1/s and 1/s^2.
        tolerance: difference of the reference's length from g at which its weight is one half, m/s^2.

    Returns:
        The share of the innovation that was applied to the attitude, 0..1.
    """
    mx, my, mz = x[at.REFERENCE], x[at.REFERENCE + 1], x[at.REFERENCE + 2]
    length = math.sqrt(mx * mx + my * my + mz * mz)
    if length < 1e-3:
        x[at.WEIGHT] = 0.0
        return 0.0
    dx, dy, dz = x[at.DOWN], x[at.DOWN + 1], x[at.DOWN + 2]
    # The length is averaged over a short time: vibration does not reduce the trust.
    x[at.LENGTH] += min(1.0, dt / _LENGTH_MEAN_S) * (length - x[at.LENGTH])
    off = (x[at.LENGTH] - GRAVITY_M_S2) / tolerance
    weight = 1.0 / (1.0 + off * off)
    mx /= length
    my /= length
    mz /= length
    x[at.WEIGHT] = weight
    ex, ey, ez = my * dz - mz * dy, mz * dx - mx * dz, mx * dy - my * dx
    along = mx * dx + my * dy + mz * dz
    x[at.INNOVATION] = math.atan2(math.sqrt(ex * ex + ey * ey + ez * ez), along)
    gain = min(1.0, max(k_p, 1.0 / (x[at.AGE] + dt)) * weight * dt)
    dx += gain * (mx - along * dx)
    dy += gain * (my - along * dy)
    dz += gain * (mz - along * dz)
    if along < -0.999:  # upside down: the innovation is zero there, so move away from the wrong pole
        dy += 0.01
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    x[at.DOWN] = dx / length
    x[at.DOWN + 1] = dy / length
    x[at.DOWN + 2] = dz / length
    slow = min(1.0, dt / _SLOW_S)
    x[at.SLOW_INNOVATION] += slow * (ex - x[at.SLOW_INNOVATION])
    x[at.SLOW_INNOVATION + 1] += slow * (ey - x[at.SLOW_INNOVATION + 1])
    x[at.SLOW_INNOVATION + 2] += slow * (ez - x[at.SLOW_INNOVATION + 2])
    if gain <= k_p * dt:  # the running mean of the start has ended
        bias = k_i * weight * dt
        x[at.GYRO_BIAS] = _within(x[at.GYRO_BIAS] - bias * ex, _BIAS_MAX_RAD_S)
        x[at.GYRO_BIAS + 1] = _within(x[at.GYRO_BIAS + 1] - bias * ey, _BIAS_MAX_RAD_S)
        x[at.GYRO_BIAS + 2] = _within(x[at.GYRO_BIAS + 2] - bias * ez, _BIAS_MAX_RAD_S)
    return gain


@kernel
def agrees(x: Array) -> bool:
    """Whether the reference has recently agreed with the estimate, which confirms that the vehicle is at
    rest.
    """
    ex, ey, ez = x[at.SLOW_INNOVATION], x[at.SLOW_INNOVATION + 1], x[at.SLOW_INNOVATION + 2]
    return ex * ex + ey * ey + ez * ez < _AGREEMENT_RAD * _AGREEMENT_RAD


@kernel
def rest(x: Array, p: Array, dt: float, wx: float, wy: float, wz: float) -> None:
    """While a disarmed vehicle stands still, the gyro's reading about the down axis is its bias.

    The accelerometer gives no information about that bias. It determines the other two, even while wind moves
    the vehicle.

    Args:
        x: state.
        p: coefficients.
        dt: s.
        wx, wy, wz: measured rate, rad/s, FRD.
    """
    slow = min(1.0, dt / _REST_MEAN_S)
    still = True
    for axis, rate in ((0, wx), (1, wy), (2, wz)):
        mean = x[at.MEAN_RATE + axis] + slow * (rate - x[at.MEAN_RATE + axis])
        x[at.MEAN_RATE + axis] = mean
        still = still and abs(rate - mean) < _REST_NOISE_RAD_S and abs(mean) < _REST_RATE_RAD_S
    x[at.REST_TIME] = x[at.REST_TIME] + dt if still else 0.0
    if x[at.REST_TIME] < _REST_AFTER_S:
        return
    # Mean over all rest so far; an initial value of zero has the weight of a short time.
    x[at.REST_SUM] = min(x[at.REST_SUM] + dt, p[par.REST_BIAS_TIME])
    dx, dy, dz = x[at.DOWN], x[at.DOWN + 1], x[at.DOWN + 2]
    bx, by, bz = x[at.GYRO_BIAS], x[at.GYRO_BIAS + 1], x[at.GYRO_BIAS + 2]
    turn = (wx - bx) * dx + (wy - by) * dy + (wz - bz) * dz
    turn *= min(1.0, dt / (_REST_PRIOR_S + x[at.REST_SUM]))
    x[at.GYRO_BIAS] = bx + turn * dx
    x[at.GYRO_BIAS + 1] = by + turn * dy
    x[at.GYRO_BIAS + 2] = bz + turn * dz


@kernel
def _within(value: float, limit: float) -> float:
    return min(limit, max(-limit, value))
