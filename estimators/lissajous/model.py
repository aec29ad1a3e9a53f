"""The Lissajous motion model and its filter as kernels, for the live estimator and the study alike.

Source: Steckenrider, Leamy, Furukawa 2020 (SSRR), section III. The state is (x, x', y, y') relative to the
pattern's centre; with the frequencies included, it is (x, x', y, y', w_x, w_y). For the paper's equations
with errors (17, 25a, 28, 29; docs/papers.md) the corrected form is the default, and the printed form is kept
for comparison in the study.
"""

import math
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

X: Final = 0
VX: Final = 1
Y: Final = 2
VY: Final = 3
MOTION: Final = 4
"""Size of the motion state; a state with the frequencies has two more elements."""
OMEGA_X: Final = 4
OMEGA_Y: Final = 5
AUGMENTED: Final = 6

# One axis over one step: position' = C position + S velocity, velocity' = D position + C velocity, and the
# derivatives of both by the frequency, each as its factors of position and velocity.
C: Final = 0
S: Final = 1
D: Final = 2
POSITION_BY_POSITION: Final = 3
POSITION_BY_VELOCITY: Final = 4
VELOCITY_BY_POSITION: Final = 5
VELOCITY_BY_VELOCITY: Final = 6
AXIS: Final = 7


class Discretisation(IntEnum):
    """How equation 15 becomes a matrix, and its derivative by the frequency (equation 25).

    Attributes:
        EXACT: cosine and sine.
        SERIES: three terms of the series (equation 16), which is equation 17 with (w dt)^2 / 2.
        PRINTED_SIGN: the same matrix, with the derivative's sign in T(1,1) and T(3,3) as printed (25a).
        PRINTED: equation 17 as printed, (w dt / 2)^2, and 25a as printed.
    """

    EXACT = 0
    SERIES = 1
    PRINTED_SIGN = 2
    PRINTED = 3


_EXACT: Final = int(Discretisation.EXACT)
_SERIES: Final = int(Discretisation.SERIES)
_PRINTED: Final = int(Discretisation.PRINTED)


@kernel
def axis(discretisation: int, omega_rad_s: float, dt_s: float, out: Array) -> None:
    """Write the step matrix of one axis into `out` (AXIS,): equations 17 and 25, corrected unless the printed
    form is requested.
    """
    w, t = omega_rad_s, dt_s
    if discretisation == _EXACT:
        cosine, sine = math.cos(w * t), math.sin(w * t)
        out[C] = cosine
        if abs(w * t) > 1e-4:
            out[S] = sine / w
            out[POSITION_BY_VELOCITY] = (t * cosine - sine / w) / w
        else:  # series about w = 0
            out[S] = t * (1.0 - (w * t) ** 2 / 6.0)
            out[POSITION_BY_VELOCITY] = -w * t**3 / 3.0
        out[D] = -w * sine
        out[POSITION_BY_POSITION] = -t * sine
        out[VELOCITY_BY_POSITION] = -sine - w * t * cosine
        out[VELOCITY_BY_VELOCITY] = -t * sine
        return
    half = 0.25 if discretisation == _PRINTED else 0.5
    out[C] = 1.0 - half * (w * t) ** 2
    out[S] = t
    out[D] = -t * w * w
    out[POSITION_BY_POSITION] = (-1.0 if discretisation == _SERIES else 1.0) * t * t * w
    out[POSITION_BY_VELOCITY] = 0.0
    out[VELOCITY_BY_POSITION] = -2.0 * t * w
    out[VELOCITY_BY_VELOCITY] = -t * t * w


@kernel
def move(state: Array, axes: Array) -> None:
    """Apply one step of the motion (equation 20, without noise); `axes` is (2, AXIS)."""
    for i in range(2):
        position, velocity = state[2 * i], state[2 * i + 1]
        state[2 * i] = axes[i, C] * position + axes[i, S] * velocity
        state[2 * i + 1] = axes[i, D] * position + axes[i, C] * velocity


@kernel
def frequency_jacobian(state: Array, axes: Array, out: Array) -> None:
    """Derivatives (2, 2) of the predicted state with respect to the frequency, equation 24: rows x, y;
    columns position, velocity.
    """
    for i in range(2):
        position, velocity = state[2 * i], state[2 * i + 1]
        out[i, 0] = axes[i, POSITION_BY_POSITION] * position + axes[i, POSITION_BY_VELOCITY] * velocity
        out[i, 1] = axes[i, VELOCITY_BY_POSITION] * position + axes[i, VELOCITY_BY_VELOCITY] * velocity


@kernel
def _rows(matrix: Array, axes: Array) -> None:
    """matrix <- A matrix, for the motion's four rows."""
    for i in range(2):
        c, s, d = axes[i, C], axes[i, S], axes[i, D]
        for k in range(matrix.shape[1]):
            position, velocity = matrix[2 * i, k], matrix[2 * i + 1, k]
            matrix[2 * i, k] = c * position + s * velocity
            matrix[2 * i + 1, k] = d * position + c * velocity


@kernel
def _columns(matrix: Array, axes: Array) -> None:
    """matrix <- matrix A', for the motion's four columns."""
    for i in range(2):
        c, s, d = axes[i, C], axes[i, S], axes[i, D]
        for k in range(matrix.shape[0]):
            position, velocity = matrix[k, 2 * i], matrix[k, 2 * i + 1]
            matrix[k, 2 * i] = c * position + s * velocity
            matrix[k, 2 * i + 1] = d * position + c * velocity


@kernel
def predict(
    state: Array, covariance: Array, axes: Array, process: Array, frequency_covariance: Array, jacobian: Array
) -> None:
    """Predict the motion with uncertain frequencies, in place (equations 21, 22).

    Args:
        state, covariance: (4,), (4, 4).
        axes: (2, AXIS) step matrices for the nominal frequencies.
        process: (4, 4) process noise of this step.
        frequency_covariance: (2, 2), equation 23; zeros give the plain Kalman prediction (3, 4).
        jacobian: (2, 2), overwritten.
    """
    frequency_jacobian(state, axes, jacobian)
    move(state, axes)
    _rows(covariance, axes)
    _columns(covariance, axes)
    for i in range(4):
        for k in range(i + 1):
            change = (
                process[i, k]
                + jacobian[i // 2, i % 2] * frequency_covariance[i // 2, k // 2] * jacobian[k // 2, k % 2]
            )
            covariance[i, k] += change
            if k < i:
                covariance[k, i] = covariance[i, k]


@kernel
def predict_augmented(
    state: Array, covariance: Array, axes: Array, process: Array, frequency_process: float, jacobian: Array
) -> None:
    """Predict with the frequencies as states, in place: the extended Kalman filter that the paper names as
    future work.

    Args:
        state, covariance: (6,), (6, 6).
        axes: (2, AXIS) step matrices for the frequencies in the state.
        process: (4, 4) process noise of the motion in this step.
        frequency_process: increase of each frequency's variance in this step.
        jacobian: (2, 2), overwritten.
    """
    frequency_jacobian(state, axes, jacobian)
    move(state, axes)
    # F = [[A, J], [0, I]]: rows, then columns
    for side in range(2):
        if side == 0:
            _rows(covariance, axes)
        else:
            _columns(covariance, axes)
        for i in range(4):
            factor = jacobian[i // 2, i % 2]
            source = 4 + i // 2
            for k in range(6):
                if side == 0:
                    covariance[i, k] += factor * covariance[source, k]
                else:
                    covariance[k, i] += factor * covariance[k, source]
    for i in range(4):
        for k in range(4):
            covariance[i, k] += process[i, k]
    covariance[4, 4] += frequency_process
    covariance[5, 5] += frequency_process
    for i in range(6):
        for k in range(i):
            covariance[k, i] = covariance[i, k]


@kernel
def correct(state: Array, covariance: Array, measured: Array, noise: Array, work: Array) -> float:
    """Correct by a measurement of the whole motion, in place (equations 26, 27; equal to 6, 7 for C = I).

    Args:
        state, covariance: (n,), (n, n), n = 4 or 6.
        measured, noise: (4,), (4, 4).
        work: (4, 6 + n), overwritten.

    Returns:
        Squared Mahalanobis distance of the measurement from the prediction; NaN when a covariance is invalid;
        the state is then unchanged.
    """
    n = state.shape[0]
    # factor S = P + R = L L' in work[:, :4]; then L^-1 r in work[:, 4] and L^-1 P[:4, :] in the rest
    for i in range(4):
        for k in range(i + 1):
            total = covariance[i, k] + noise[i, k]
            for j in range(k):
                total -= work[i, j] * work[k, j]
            if i == k:
                if not total > 0.0:
                    return math.nan
                work[i, i] = math.sqrt(total)
            else:
                work[i, k] = total / work[k, k]
    distance = 0.0
    for i in range(4):
        over = 1.0 / work[i, i]
        total = measured[i] - state[i]
        for j in range(i):
            total -= work[i, j] * work[j, 4]
        work[i, 4] = total * over
        distance += work[i, 4] ** 2
        for k in range(n):
            total = covariance[i, k]
            for j in range(i):
                total -= work[i, j] * work[j, 6 + k]
            work[i, 6 + k] = total * over
    for k in range(n):
        for j in range(4):
            state[k] += work[j, 6 + k] * work[j, 4]
        for m in range(k + 1):
            total = covariance[k, m]
            for j in range(4):
                total -= work[j, 6 + k] * work[j, 6 + m]
            covariance[k, m] = total
            covariance[m, k] = total
    return distance


@kernel
def course(state: Array) -> float:
    """Direction of travel from the x axis towards y, rad (equation 28 with the two-argument arctangent)."""
    return math.atan2(state[VY], state[VX])


@kernel
def course_variance(state: Array, covariance: Array) -> float:
    """Variance of the course, rad^2, to first order; infinite at rest.

    Equation 29 in the form without division by one velocity: the printed 29a lacks a square.
    """
    vx, vy = state[VX], state[VY]
    square = vx * vx + vy * vy
    if square < 1e-12:
        return math.inf
    return (
        vx * vx * covariance[VY, VY] + vy * vy * covariance[VX, VX] - 2.0 * vx * vy * covariance[VX, VY]
    ) / (square * square)
