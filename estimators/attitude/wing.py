"""Fixed wing: the direction down from specific force, airspeed, angle of attack and sideslip (compiled).

Tolman et al. 2021, (9)-(19), as corrected and extended in docs/attitude.md.
"""

import math

import numpy as np
from numpy.typing import NDArray

from estimators.attitude import layout as at
from estimators.attitude import parameters as par
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

ALPHA_MAX_RAD = 0.4
_MEAN_MAX_RAD = 0.2
_BETA_MAX_RAD = 0.3
_LEVEL_ENOUGH = 0.7
_LIFT_LEAST = 1e-4
_CLIMB_PRIOR_S = 2.0


@kernel
def reference(
    x: Array, p: Array, dt: float, wx: float, wy: float, wz: float, ax: float, ay: float, az: float
) -> None:
    """Compute the velocity relative to the air and the reference `v' + w x v - a`, which is g times down (9).

    Args:
        x: state, with an airspeed.
        p: coefficients.
        dt: s.
        wx, wy, wz: angular rate without bias, rad/s, FRD.
        ax, ay, az: specific force, m/s^2, FRD.
    """
    airspeed = x[at.AIRSPEED]
    if math.isnan(x[at.SPEED]):
        x[at.SPEED] = airspeed
        x[at.SPEED_ERROR] = 0.0
    if airspeed < p[par.AIRSPEED_MIN]:
        x[at.ALPHA] = 0.0
        x[at.BETA] = 0.0
    else:
        _learn_lift(x, p, dt, -az)
        _sideslip(x, p, dt, ay)
        if p[par.ATTACK] != 0.0:
            _attack(x, p, dt, wy)
    alpha, beta = x[at.ALPHA], x[at.BETA]
    ex, ey, ez = math.cos(alpha) * math.cos(beta), math.sin(beta), math.sin(alpha) * math.cos(beta)

    change = 0.0
    if p[par.LONGITUDINAL] != 0.0:
        # The speed is integrated from force and attitude and held to the measured one; the correction that
        # this
        # takes is what the airspeed says of the attitude, smoothed as much as the airspeed needs.
        if x[at.AIRSPEED_FRESH] != 0.0:
            x[at.SPEED_ERROR] = airspeed - x[at.SPEED]
        pull = p[par.SPEED_GAIN] * x[at.SPEED_ERROR]
        weight = GRAVITY_M_S2 * (x[at.DOWN] * ex + x[at.DOWN + 1] * ey + x[at.DOWN + 2] * ez)
        change = ax * ex + ay * ey + az * ez + weight + pull
        x[at.SPEED] += dt * change
        x[at.SPEED_ERROR] /= (
            1.0 + dt * p[par.SPEED_GAIN]
        )  # until the next message, as if the correction had been right
    else:
        x[at.SPEED] = airspeed
    x[at.AIRSPEED_FRESH] = 0.0

    vx, vy, vz = airspeed * ex, airspeed * ey, airspeed * ez
    x[at.VELOCITY], x[at.VELOCITY + 1], x[at.VELOCITY + 2] = vx, vy, vz
    x[at.REFERENCE] = change * ex + wy * vz - wz * vy - ax
    x[at.REFERENCE + 1] = change * ey + wz * vx - wx * vz - ay
    x[at.REFERENCE + 2] = change * ez + wx * vy - wy * vx - az


@kernel
def lift_slope(x: Array, p: Array) -> float:
    """Lift acceleration per square of airspeed and per angle of attack, 1/m."""
    return p[par.LIFT_SLOPE_GIVEN] if p[par.LIFT_SLOPE_GIVEN] > 0.0 else p[par.LIFT_SLOPE_RATIO] * x[at.LIFT]


@kernel
def _learn_lift(x: Array, p: Array, dt: float, up: float) -> None:
    if p[par.LIFT_GIVEN] > 0.0:
        x[at.LIFT] = p[par.LIFT_GIVEN]
        return
    # Least squares of lift by the square of the airspeed, with forgetting: samples with wheels on the ground
    # have little weight.
    square = x[at.AIRSPEED] * x[at.AIRSPEED]
    fade = max(0.0, 1.0 - dt / p[par.LIFT_TIME])
    x[at.LIFT_SUM] = fade * x[at.LIFT_SUM] + dt * up * square
    x[at.LIFT_WEIGHT] = fade * x[at.LIFT_WEIGHT] + dt * square * square
    if x[at.LIFT_WEIGHT] > 0.0:
        x[at.LIFT] = max(_LIFT_LEAST, x[at.LIFT_SUM] / x[at.LIFT_WEIGHT])


@kernel
def _sideslip(x: Array, p: Array, dt: float, right: float) -> None:
    lift = x[at.LIFT] * x[at.AIRSPEED] * x[at.AIRSPEED]
    beta = -right / (p[par.SIDE_FORCE_RATIO] * lift)
    beta = min(_BETA_MAX_RAD, max(-_BETA_MAX_RAD, beta))
    x[at.BETA] += min(1.0, dt / p[par.SIDE_FORCE_TIME]) * (beta - x[at.BETA])


@kernel
def _attack(x: Array, p: Array, dt: float, pitch_rate: float) -> None:
    """(19), corrected: lift with its slope, and gravity's part across the flight path in a bank."""
    airspeed, alpha = x[at.AIRSPEED], x[at.ALPHA]
    down_x, down_y, down_z = x[at.DOWN], x[at.DOWN + 1], x[at.DOWN + 2]
    throttle = x[at.THROTTLE]
    if math.isnan(throttle):
        throttle = p[par.THROTTLE_TRIM]
    thrust = p[par.THRUST] * throttle * throttle - p[par.THRUST_LOSS] * airspeed * airspeed
    slope = lift_slope(x, p) * airspeed * airspeed
    across = GRAVITY_M_S2 * (down_z * math.cos(alpha) - down_x * math.sin(alpha))
    drive = pitch_rate + (across - x[at.LIFT] * airspeed * airspeed + slope * x[at.ALPHA_MEAN]) / airspeed
    alpha = (alpha + dt * drive) / (1.0 + dt * (thrust + slope) / airspeed)  # implicit: stable at any rate
    x[at.ALPHA] = alpha = min(ALPHA_MAX_RAD, max(-ALPHA_MAX_RAD, alpha))
    climb = x[at.CLIMB]
    if math.isnan(climb) or down_z < _LEVEL_ENOUGH or math.isinf(p[par.CLIMB_TIME]):
        return
    seen = -(down_x * math.cos(alpha) + down_y * x[at.BETA] + down_z * math.sin(alpha)) * airspeed
    # A mean weighted by the square of the airspeed, with forgetting.
    weight = dt * airspeed * airspeed
    x[at.CLIMB_WEIGHT] = max(0.0, 1.0 - dt / p[par.CLIMB_TIME]) * x[at.CLIMB_WEIGHT] + weight
    gain = weight / (x[at.CLIMB_WEIGHT] + _CLIMB_PRIOR_S * airspeed * airspeed)
    mean = x[at.ALPHA_MEAN] + gain * (seen - climb) / (airspeed * down_z)
    x[at.ALPHA_MEAN] = min(_MEAN_MAX_RAD, max(-_MEAN_MAX_RAD, mean))
