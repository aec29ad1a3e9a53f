"""One step of the filter with one inertial sample (compiled)."""

import math

import numpy as np
from numpy.typing import NDArray

from estimators.attitude import layout as at
from estimators.attitude import parameters as par
from estimators.attitude import rotor, still, tilt, uncertainty, wing
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

RATE_MAX_RAD_S = 70.0
FORCE_MAX_M_S2 = 400.0
_LOAD_MAX = 0.5
_USUAL_AIRSPEED_M_S = 20.0


@kernel
def start(x: Array, p: Array) -> None:
    """Initialise the state: nothing is known."""
    x[:] = 0.0
    x[at.DOWN + 2] = 1.0
    x[at.RATE] = math.nan
    still.forget(x)
    x[at.LENGTH] = GRAVITY_M_S2
    x[at.AIRSPEED] = x[at.CLIMB] = x[at.THROTTLE] = x[at.SPEED] = math.nan
    rotor.start(x, p)
    uncertainty.start(x, at.ROLL_COVARIANCE, p)
    uncertainty.start(x, at.PITCH_COVARIANCE, p)


@kernel
def step(x: Array, p: Array) -> bool:
    """Process the sample that was written into the state.

    Args:
        x: state (`layout`).
        p: coefficients (`parameters.coefficients`).

    Returns:
        False when the sample is impossible for a sensor; the state is then unchanged.
    """
    dt = x[at.ELAPSED]
    wx, wy, wz = x[at.SAMPLE_RATE], x[at.SAMPLE_RATE + 1], x[at.SAMPLE_RATE + 2]
    ax, ay, az = x[at.SAMPLE_FORCE], x[at.SAMPLE_FORCE + 1], x[at.SAMPLE_FORCE + 2]
    if max(abs(wx), abs(wy), abs(wz)) > RATE_MAX_RAD_S or max(abs(ax), abs(ay), abs(az)) > FORCE_MAX_M_S2:
        return False
    if ax == 0.0 and ay == 0.0 and az == 0.0:
        return False
    if math.isnan(x[at.RATE]):
        _first(x, wx, wy, wz, ax, ay, az)
        return True
    bx, by, bz = x[at.GYRO_BIAS], x[at.GYRO_BIAS + 1], x[at.GYRO_BIAS + 2]
    surface = x[at.FORM] == at.STILL and x[at.DISARMED] == 0.0
    # The rate between two samples is taken as the mean of both; see `still.share_before`.
    before = still.share_before(p, dt) if surface else 0.5
    turn_x = before * x[at.RATE] + (1.0 - before) * wx - bx
    turn_y = before * x[at.RATE + 1] + (1.0 - before) * wy - by
    turn_z = before * x[at.RATE + 2] + (1.0 - before) * wz - bz
    tilt.rotate(x, at.DOWN, dt, turn_x, turn_y, turn_z)
    x[at.RATE], x[at.RATE + 1], x[at.RATE + 2] = wx, wy, wz
    k_p, k_i, tolerance = p[par.GAIN], p[par.BIAS_GAIN], p[par.TOLERANCE]
    if x[at.DISARMED] != 0.0:
        _still(x, ax, ay, az)
        tilt.rest(x, p, dt, wx, wy, wz)
        # The armed state is reported only once a second: a take-off run may have begun.
        if tilt.agrees(x):
            k_p = p[par.REST_GAIN]
            k_i = 0.25 * k_p * k_p  # critically damped
    elif x[at.FORM] == at.WING and x[at.AIRSPEED] > 0.0:
        wing.reference(x, p, dt, wx - bx, wy - by, wz - bz, ax, ay, az)
    elif x[at.FORM] == at.ROTOR:
        tolerance = math.inf  # the length of its reference is g by construction, and contains no information
        rotor.reference(x, p, dt, wx - bx, wy - by, wz - bz, ax, ay, az)
    elif surface:
        k_p, k_i = p[par.STILL_GAIN], p[par.STILL_BIAS_GAIN]
        tolerance = math.inf
        still.reference(x, p, dt, turn_x, turn_y, turn_z, ax, ay, az)
        still.pause(x, p, dt, wx, wy, wz, ax, ay, az)
    else:
        _still(x, ax, ay, az)
    if not surface:
        still.forget(x)
    gain = tilt.correct(x, dt, k_p, k_i, tolerance)
    error = _error(x, p, ax, ay, az)
    learn = k_i * x[at.WEIGHT] * dt
    fade = math.exp(-dt / p[par.REFERENCE_TIME])
    uncertainty.propagate(x, at.ROLL_COVARIANCE, p, dt, gain, learn, fade, error)
    uncertainty.propagate(x, at.PITCH_COVARIANCE, p, dt, gain, learn, fade, error)
    x[at.AGE] += dt
    return True


@kernel
def _first(x: Array, wx: float, wy: float, wz: float, ax: float, ay: float, az: float) -> None:
    x[at.RATE], x[at.RATE + 1], x[at.RATE + 2] = wx, wy, wz
    x[at.MEAN_RATE], x[at.MEAN_RATE + 1], x[at.MEAN_RATE + 2] = wx, wy, wz
    length = math.sqrt(ax * ax + ay * ay + az * az)
    if length > 1.0:
        x[at.DOWN], x[at.DOWN + 1], x[at.DOWN + 2] = -ax / length, -ay / length, -az / length


@kernel
def _still(x: Array, ax: float, ay: float, az: float) -> None:
    """On the ground, or in the air without an airspeed: the specific force is taken as the direction up."""
    x[at.SPEED] = math.nan
    x[at.VELOCITY] = x[at.VELOCITY + 1] = x[at.VELOCITY + 2] = 0.0
    x[at.REFERENCE], x[at.REFERENCE + 1], x[at.REFERENCE + 2] = -ax, -ay, -az


@kernel
def _error(x: Array, p: Array, ax: float, ay: float, az: float) -> float:
    """Standard error of the reference's direction about an axis, rad."""
    if x[at.DISARMED] != 0.0:
        return p[par.REST_ERROR]
    steady = p[par.FLIGHT_ERROR]
    if x[at.FORM] == at.WING and not x[at.AIRSPEED] > 0.0:
        # In a turn the force is along the wing's up axis at any bank. Without an airspeed the resulting error
        # is estimated with a typical airspeed.
        wx, wy, wz = x[at.SAMPLE_RATE], x[at.SAMPLE_RATE + 1], x[at.SAMPLE_RATE + 2]
        blind = min(_LOAD_MAX, math.sqrt(wx * wx + wy * wy + wz * wz) * _USUAL_AIRSPEED_M_S / GRAVITY_M_S2)
        return math.sqrt(steady * steady + blind * blind)
    # The contribution of motion to the force scales with the motion, and so do the errors of airspeed,
    # incidence and drag.
    if x[at.FORM] == at.WING:
        mx = x[at.REFERENCE] + ax
        my = x[at.REFERENCE + 1] + ay
        mz = x[at.REFERENCE + 2] + az
        load = math.sqrt(mx * mx + my * my + mz * mz) / GRAVITY_M_S2
    else:
        load = math.sqrt(ax * ax + ay * ay) / GRAVITY_M_S2 + x[at.INNOVATION]
    manoeuvre = p[par.MANOEUVRE_ERROR] * min(_LOAD_MAX, load)
    return math.sqrt(steady * steady + manoeuvre * manoeuvre)
