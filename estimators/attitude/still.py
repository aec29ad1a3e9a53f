"""Vehicles without a model of motion: the direction down from a low pass of the specific force (compiled).

The velocity of a vehicle is bounded, therefore its acceleration averages to zero over a few seconds, but
only in a frame that does not turn with the vehicle. The force is filtered in the frame that the gyros
carry along (Laidig and Seel, VQF, Information Fusion 91, 2023; docs/attitude.md). An aircraft that
circles without an airspeed is no such vehicle: its acceleration lasts.
"""

import math

import numpy as np
from numpy.typing import NDArray

from estimators.attitude import layout as at
from estimators.attitude import parameters as par
from estimators.attitude import tilt
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

_FEEDBACK = 2.0 - math.sqrt(2.0)
"""Feedback of the attitude to the mean force that gives both together a Butterworth response."""
_MEAN_S = 0.5
_PAUSE_RAD_S = 0.035
_PAUSE_M_S2 = 0.5
_PAUSE_AFTER_S = 1.5
"""A pause: rate and force stay this close to their means for this long, and the rate is this small (as in
VQF)."""
_PRIOR_S = 0.5
"""Weight of the bias that was known before the first pause."""


@kernel
def forget(x: Array) -> None:
    """Forget the mean force: the next sample starts at the estimated attitude."""
    x[at.MEAN_FORCE] = math.nan


@kernel
def reference(
    x: Array, p: Array, dt: float, wx: float, wy: float, wz: float, ax: float, ay: float, az: float
) -> None:
    """Compute the reference for down, opposite to the mean force; v = 0.

    With the gain k of `tilt.correct` as well, the attitude follows the force by a filter of second order
    with the angular frequency k.

    Args:
        x: state.
        p: coefficients.
        dt: s.
        wx, wy, wz: angular rate without bias since the previous sample, rad/s, FRD.
        ax, ay, az: specific force, m/s^2, FRD.
    """
    x[at.SPEED] = math.nan
    x[at.VELOCITY] = x[at.VELOCITY + 1] = x[at.VELOCITY + 2] = 0.0
    if math.isnan(x[at.MEAN_FORCE]):
        for axis in range(3):
            x[at.MEAN_FORCE + axis] = -GRAVITY_M_S2 * x[at.DOWN + axis]
    else:
        tilt.rotate(x, at.MEAN_FORCE, dt, wx, wy, wz)
    k = p[par.STILL_GAIN]
    start = 1.0 / (x[at.AGE] + dt)  # a running mean in the first seconds, as in `tilt.correct`
    gain = min(1.0, max(k, start) * dt)
    feedback = _FEEDBACK * k * dt if k > start else 0.0
    for axis, force in ((0, ax), (1, ay), (2, az)):
        mean = x[at.MEAN_FORCE + axis]
        mean += gain * (force - mean) + feedback * (mean + GRAVITY_M_S2 * x[at.DOWN + axis])
        x[at.MEAN_FORCE + axis] = mean
        x[at.REFERENCE + axis] = -mean


@kernel
def pause(
    x: Array, p: Array, dt: float, wx: float, wy: float, wz: float, ax: float, ay: float, az: float
) -> None:
    """While an armed vehicle pauses, the reading of the gyros is their bias.

    Args:
        x: state.
        p: coefficients.
        dt: s.
        wx, wy, wz: measured rate, rad/s, FRD.
        ax, ay, az: specific force, m/s^2, FRD.
    """
    slow = min(1.0, dt / _MEAN_S)
    rate_square = force_square = fastest = 0.0
    for axis, rate, force in ((0, wx, ax), (1, wy, ay), (2, wz, az)):
        x[at.MEAN_RATE + axis] += slow * (rate - x[at.MEAN_RATE + axis])
        x[at.SLOW_FORCE + axis] += slow * (force - x[at.SLOW_FORCE + axis])
        rate_square += (rate - x[at.MEAN_RATE + axis]) ** 2
        force_square += (force - x[at.SLOW_FORCE + axis]) ** 2
        fastest = max(fastest, abs(x[at.MEAN_RATE + axis]))
    pauses = rate_square < _PAUSE_RAD_S**2 and force_square < _PAUSE_M_S2**2 and fastest < _PAUSE_RAD_S
    x[at.REST_TIME] = x[at.REST_TIME] + dt if pauses else 0.0
    if x[at.REST_TIME] < _PAUSE_AFTER_S:
        return
    x[at.REST_SUM] = min(x[at.REST_SUM] + dt, p[par.REST_BIAS_TIME])
    share = min(1.0, dt / (_PRIOR_S + x[at.REST_SUM]))
    for axis in range(3):
        x[at.GYRO_BIAS + axis] += share * (x[at.MEAN_RATE + axis] - x[at.GYRO_BIAS + axis])


@kernel
def share_before(p: Array, dt: float) -> float:
    """Weight of the previous rate in the mean rate between two samples, 0..0.5.

    A sample's rate is the mean over a time before it. Where the samples are as frequent as that, it is the
    mean since the previous one.
    """
    mean_s = p[par.RATE_MEAN]
    return 0.5 * (1.0 - mean_s / dt) if dt > mean_s else 0.0
