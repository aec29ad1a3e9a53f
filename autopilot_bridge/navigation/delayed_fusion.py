"""Position and velocity measured some time ago, fused against the history: of a GPS or of anything else.

A delayed measurement is compared with the history at the time it was taken. Its Jacobian refers to the
present errors, so it carries the past back: over a delay d with the specific force integrated to u (NED),
    p(t - d) error = p error - d * velocity error,
    v(t - d) error = v error + u x theta + d * R accel_bias error (first order in d).
"""

import math

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation.covariance import apply_scalar
from autopilot_bridge.navigation.states import (
    ACCEL_BIAS,
    ATT,
    CORRECTION_POS,
    CORRECTION_VEL,
    DX,
    GPS_ERROR,
    GRAVITY,
    HISTORY_POS,
    HISTORY_Q,
    HISTORY_VEL,
    PH,
    POS,
    VEL,
    X_GPS_ERROR,
    X_VEL,
    R,
)
from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import body_axis

Array = NDArray[np.float64]


@kernel
def body_axis_in_ned(history: Array, row: int, axis: int) -> tuple[float, float, float]:
    """Column `axis` of r_ned_from_frd at a row of the history."""
    w, x, y, z = (
        history[row, HISTORY_Q],
        history[row, HISTORY_Q + 1],
        history[row, HISTORY_Q + 2],
        history[row, HISTORY_Q + 3],
    )
    return body_axis(w, x, y, z, axis)


@kernel
def position_dot(work: Array, base: int, axis: int, delay: float, by_gps: bool) -> float:
    """H times the vector at `base` of `work`, for a position axis; a GPS has an error that wanders."""
    product = work[base + POS + axis] - delay * work[base + VEL + axis]
    return product + work[base + GPS_ERROR + axis] if by_gps else product


@kernel
def position_ph(p: Array, work: Array, axis: int, delay: float, by_gps: bool) -> float:
    """PH of a position axis; returns H P H^T."""
    a, b, c = POS + axis, VEL + axis, GPS_ERROR + axis
    for i in range(p.shape[0]):
        product = p[i, a] - delay * p[i, b]
        work[PH + i] = product + p[i, c] if by_gps else product
    return position_dot(work, PH, axis, delay, by_gps)


@kernel
def velocity_dot(
    work: Array, base: int, axis: int, u_next: float, u_last: float, b0: float, b1: float, b2: float
) -> float:
    """H times the vector at `base`; (u x theta)_axis = u[axis+1] theta[axis+2] - u[axis+2] theta[axis+1]."""
    return (
        work[base + VEL + axis]
        + u_next * work[base + ATT + (axis + 2) % 3]
        - u_last * work[base + ATT + (axis + 1) % 3]
        + b0 * work[base + ACCEL_BIAS]
        + b1 * work[base + ACCEL_BIAS + 1]
        + b2 * work[base + ACCEL_BIAS + 2]
    )


@kernel
def velocity_ph(
    p: Array, work: Array, axis: int, u_next: float, u_last: float, b0: float, b1: float, b2: float
) -> float:
    """PH of a velocity axis; returns H P H^T."""
    a, n, m = VEL + axis, ATT + (axis + 2) % 3, ATT + (axis + 1) % 3
    for i in range(p.shape[0]):
        work[PH + i] = (
            p[i, a]
            + u_next * p[i, n]
            - u_last * p[i, m]
            + b0 * p[i, ACCEL_BIAS]
            + b1 * p[i, ACCEL_BIAS + 1]
            + b2 * p[i, ACCEL_BIAS + 2]
        )
    return velocity_dot(work, PH, axis, u_next, u_last, b0, b1, b2)


@kernel
def fuse_velocity(
    p: Array,
    core: Array,
    history: Array,
    work: Array,
    row: int,
    measured: Array,
    variance: Array,
    gate: float,
    delay: float,
) -> float:
    """The three velocity axes, NED, gated as a whole: fused unless the ratio that is returned, the worst
    innovation over its gate, is above one."""
    d = delay
    ux = core[X_VEL] - history[row, HISTORY_VEL] - core[CORRECTION_VEL]
    uy = core[X_VEL + 1] - history[row, HISTORY_VEL + 1] - core[CORRECTION_VEL + 1]
    uz = core[X_VEL + 2] - history[row, HISTORY_VEL + 2] - core[CORRECTION_VEL + 2] - core[GRAVITY] * d
    worst = 0.0
    for again in range(2):  # gate first, then fuse
        for a in range(3):
            un = uy if a == 0 else (uz if a == 1 else ux)
            ul = uz if a == 0 else (ux if a == 1 else uy)
            b0, b1, b2 = d * core[R + 3 * a], d * core[R + 3 * a + 1], d * core[R + 3 * a + 2]
            s = velocity_ph(p, work, a, un, ul, b0, b1, b2) + variance[a]
            residual = measured[a] - history[row, HISTORY_VEL + a] - core[CORRECTION_VEL + a]
            residual -= velocity_dot(work, DX, a, un, ul, b0, b1, b2)
            if again == 0:
                worst = max(worst, abs(residual) / (gate * math.sqrt(s)))
            else:
                apply_scalar(p, work, residual, s)
        if again == 0 and not worst <= 1.0:
            break
    return worst


@kernel
def fuse_position(
    p: Array,
    core: Array,
    history: Array,
    work: Array,
    row: int,
    first: int,
    last: int,
    measured: Array,
    variance: Array,
    gate: float,
    delay: float,
    by_gps: bool,
) -> float:
    """Position axes `first` up to `last`, NED, gated as a whole; returns as `fuse_velocity`."""
    worst = 0.0
    for again in range(2):
        for a in range(first, last):
            s = position_ph(p, work, a, delay, by_gps) + variance[a]
            residual = measured[a] - history[row, HISTORY_POS + a] - core[CORRECTION_POS + a]
            predicted = position_dot(work, DX, a, delay, by_gps)
            residual -= core[X_GPS_ERROR + a] + predicted if by_gps else predicted
            if again == 0:
                worst = max(worst, abs(residual) / (gate * math.sqrt(s)))
            else:
                apply_scalar(p, work, residual, s)
        if again == 0 and not worst <= 1.0:
            break
    return worst
