"""One inertial sample through the filter (compiled)."""

import math

import numpy as np
from numpy.typing import NDArray

from estimators.attitude import layout as at
from estimators.attitude import parameters as par
from estimators.attitude import rotor, tilt, uncertainty, wing
from estimators.attitude.tilt import GRAVITY_M_S2
from flightsim.kernels import kernel

Array = NDArray[np.float64]

_TURNS_MAX_RAD = 0.5


@kernel
def start(x: Array, p: Array) -> None:
    """Nothing known."""
    x[:] = 0.0
    x[at.DOWN + 2] = 1.0
    x[at.RATE] = math.nan
    x[at.AIRSPEED] = x[at.CLIMB] = x[at.THROTTLE] = x[at.SPEED] = math.nan
    rotor.start(x, p)
    uncertainty.start(x, at.ROLL_COVARIANCE, p)
    uncertainty.start(x, at.PITCH_COVARIANCE, p)


@kernel
def step(
    x: Array,
    p: Array,
    form: int,
    disarmed: bool,
    dt: float,
    wx: float,
    wy: float,
    wz: float,
    ax: float,
    ay: float,
    az: float,
) -> None:
    """Take one sample.

    Args:
        x: state (`layout`).
        p: coefficients (`parameters.coefficients`).
        form: STILL, WING or ROTOR.
        disarmed: the vehicle can't be flying.
        dt: since the sample before, s; nothing for the first.
        wx, wy, wz: measured angular rate, rad/s, FRD.
        ax, ay, az: specific force, m/s^2, FRD.
    """
    if math.isnan(x[at.RATE]):
        _first(x, wx, wy, wz, ax, ay, az)
        return
    bx, by, bz = x[at.GYRO_BIAS], x[at.GYRO_BIAS + 1], x[at.GYRO_BIAS + 2]
    # The rate between two samples is taken as their mean.
    tilt.rotate(
        x,
        dt,
        0.5 * (x[at.RATE] + wx) - bx,
        0.5 * (x[at.RATE + 1] + wy) - by,
        0.5 * (x[at.RATE + 2] + wz) - bz,
    )
    x[at.RATE], x[at.RATE + 1], x[at.RATE + 2] = wx, wy, wz
    if form == at.WING and x[at.AIRSPEED] > 0.0:
        wing.reference(x, p, dt, wx - bx, wy - by, wz - bz, ax, ay, az)
    elif form == at.ROTOR and not disarmed:
        rotor.reference(x, p, dt, wx - bx, wy - by, wz - bz, ax, ay, az)
    else:
        x[at.SPEED] = math.nan
        x[at.VELOCITY] = x[at.VELOCITY + 1] = x[at.VELOCITY + 2] = 0.0
        x[at.REFERENCE], x[at.REFERENCE + 1], x[at.REFERENCE + 2] = -ax, -ay, -az
    gain = tilt.correct(x, p, dt)
    error_x, error_y = _errors(x, p, form, ax, ay, az)
    uncertainty.propagate(x, at.ROLL_COVARIANCE, p, dt, gain, x[at.WEIGHT], error_x)
    uncertainty.propagate(x, at.PITCH_COVARIANCE, p, dt, gain, x[at.WEIGHT], error_y)
    found = tilt.rest(x, p, dt, disarmed, wx, wy, wz, ax, ay, az)
    if found > 0.0:
        uncertainty.rest(x, at.ROLL_COVARIANCE, found)
        uncertainty.rest(x, at.PITCH_COVARIANCE, found)
    x[at.AGE] += dt


@kernel
def _first(x: Array, wx: float, wy: float, wz: float, ax: float, ay: float, az: float) -> None:
    x[at.RATE], x[at.RATE + 1], x[at.RATE + 2] = wx, wy, wz
    x[at.MEAN_RATE], x[at.MEAN_RATE + 1], x[at.MEAN_RATE + 2] = wx, wy, wz
    x[at.MEAN_FORCE], x[at.MEAN_FORCE + 1], x[at.MEAN_FORCE + 2] = ax, ay, az
    length = math.sqrt(ax * ax + ay * ay + az * az)
    if length > 1.0:
        x[at.DOWN], x[at.DOWN + 1], x[at.DOWN + 2] = -ax / length, -ay / length, -az / length


@kernel
def _errors(x: Array, p: Array, form: int, ax: float, ay: float, az: float) -> tuple[float, float]:
    """Standard errors of the reference about the forward and the right axis, rad."""
    if x[at.REST_TIME] > 0.0:
        return p[par.REST_ERROR], p[par.REST_ERROR]
    steady = p[par.FLIGHT_ERROR]
    if form == at.WING:
        # What the motion adds to the force scales with it: errors of airspeed, angle of attack and sideslip do.
        load_x = (x[at.REFERENCE + 1] + ay) / GRAVITY_M_S2
        load_z = (x[at.REFERENCE + 2] + az) / GRAVITY_M_S2
        manoeuvre = p[par.MANOEUVRE_ERROR] * math.sqrt(load_x * load_x + load_z * load_z)
        return math.sqrt(steady * steady + manoeuvre * manoeuvre), math.sqrt(
            steady * steady + manoeuvre * manoeuvre
        )
    turn = p[par.MANOEUVRE_ERROR] * min(
        _TURNS_MAX_RAD, math.sqrt(ax * ax + ay * ay) / GRAVITY_M_S2 + x[at.INNOVATION]
    )
    error = math.sqrt(steady * steady + turn * turn)
    return error, error
