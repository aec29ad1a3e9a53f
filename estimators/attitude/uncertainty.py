"""Uncertainty of roll and pitch: covariance of the filter with its fixed gains (compiled).

About one axis the error is `(tilt, bias, reference)`: the tilt and gyro-bias errors, and the error of the
reference direction, which is correlated in time (first-order Gauss-Markov) as manoeuvres and gusts are. The
filter changes it by

    tilt'      = (1 - k) tilt - dt bias + k reference
    bias'      = bias + l (tilt - reference)
    reference' = f reference + noise

and the covariance by the same matrix; the filter is not claimed to be optimal. Six places hold the upper
triangle: tilt-tilt, tilt-bias, tilt-reference, bias-bias, bias-reference, reference-reference.
"""

import numpy as np
from numpy.typing import NDArray

from estimators.attitude import parameters as par
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]


@kernel
def start(x: Array, at: int, p: Array) -> None:
    """Initialise: level with the error of the reference; the bias is unknown."""
    error = p[par.FLIGHT_ERROR] ** 2
    x[at], x[at + 1], x[at + 2] = error, 0.0, error
    x[at + 3], x[at + 4], x[at + 5] = p[par.GYRO_BIAS_START] ** 2, 0.0, error


@kernel
def propagate(
    x: Array, at: int, p: Array, dt: float, gain: float, learn: float, fade: float, error: float
) -> None:
    """Propagate the covariance by one step.

    Args:
        x: state.
        at: index of the first of the six places.
        p: coefficients.
        dt: s.
        gain: k, gain from the reference to the tilt in this step.
        learn: l, gain from the reference to the bias.
        fade: f, share of the reference's error that remains after this step.
        error: present standard error of the reference, rad.
    """
    tt, tb, tr, bb, br, rr = x[at], x[at + 1], x[at + 2], x[at + 3], x[at + 4], x[at + 5]
    keep = 1.0 - gain
    # Rows of the transition: T = (keep, -dt, gain), B = (learn, 1, -learn), R = (0, 0, fade).
    t_t, t_b, t_r = (
        keep * tt - dt * tb + gain * tr,
        keep * tb - dt * bb + gain * br,
        keep * tr - dt * br + gain * rr,
    )
    b_t, b_b, b_r = learn * tt + tb - learn * tr, learn * tb + bb - learn * br, learn * tr + br - learn * rr
    x[at] = keep * t_t - dt * t_b + gain * t_r + p[par.GYRO_NOISE] ** 2 * dt
    x[at + 1] = learn * t_t + t_b - learn * t_r
    x[at + 2] = fade * t_r
    x[at + 3] = learn * b_t + b_b - learn * b_r + p[par.GYRO_BIAS_WALK] ** 2 * dt
    x[at + 4] = fade * b_r
    x[at + 5] = fade * fade * rr + (1.0 - fade * fade) * error * error
