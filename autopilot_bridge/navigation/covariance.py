"""Covariance of the error state: prediction, scalar updates, injection, and forgetting for resets.

The transition over T seconds, with S = integral of r_ned_from_frd, u = integral of the specific force in NED:

    theta' = theta - S gyro_bias
    v'     = v + theta x u - S accel_bias
    p'     = p + v T + (theta x u - S accel_bias) T / 2
    biases and the GPS error decay as Gauss-Markov processes; the barometer's offset and the wind stay.

The magnetometer's bias stands for hard iron and for soft iron, whose effect changes as the vehicle turns, so
it decays with the angle turned as well as with time. The gyro's scale and cross-axis errors come in as noise
per angle
turned: about the vertical errors of one radian's turning are taken as independent of the next one's; a
multirotor's tilting undoes itself, so it counts with its usual amplitude of some tenths of a radian.

(Sola, arXiv:1711.02508, section 7, global angular error.) The products exploit that sparsity by hand.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation.states import (
    ACCEL_BIAS,
    ATT,
    BARO_OFFSET,
    CORRECTION_POS,
    CORRECTION_VEL,
    DX,
    GPS_ERROR,
    GYRO_BIAS,
    MAG_BIAS,
    PH,
    POS,
    SUM_FORCE,
    SUM_R,
    SUM_TIME,
    SUM_TURN,
    VEL,
    WIND,
    X_POS,
    X_VEL,
    Q,
)
from flightsim.foundation.kernels import kernel
from flightsim.foundation.layouts import Slots

Array = NDArray[np.float64]

_process = Slots()
# process: what `predict` needs of the parameters, one array
NOISE_ATT: Final = _process.place()  # rad^2/s
NOISE_VEL: Final = _process.place()  # m^2/s^3
TURN_SCALE: Final = _process.place()  # about the vertical: rad^2 per rad turned
GYRO_BIAS_VAR: Final = _process.place()  # stationary variances and time constants
GYRO_BIAS_TAU: Final = _process.place()
ACCEL_BIAS_VAR: Final = _process.place()
ACCEL_BIAS_TAU: Final = _process.place()
GPS_VAR_HORIZONTAL: Final = _process.place()
GPS_VAR_VERTICAL: Final = _process.place()
GPS_TAU: Final = _process.place()
BARO_WALK: Final = _process.place()  # m^2/s
MAG_BIAS_VAR: Final = _process.place()
MAG_BIAS_TAU: Final = _process.place()
MAG_BIAS_TURN: Final = _process.place()  # rad
TURN_TILT: Final = _process.place()  # about the horizontal axes: rad^2 per rad turned about them
TURN_CROSS: Final = _process.place()  # about the horizontal axes: rad^2 per rad turned about the vertical
WIND_WALK: Final = _process.place()  # m^2/s^3, each way
PROCESS_SIZE: Final = _process.size


@kernel
def carry(p: Array, core: Array, t: float, along_rows: bool) -> None:
    """p <- F p (along_rows False: every column) or p <- p F^T (every row), the first nine states only."""
    s = SUM_R
    ux, uy, uz = core[SUM_FORCE], core[SUM_FORCE + 1], core[SUM_FORCE + 2]
    s00, s01, s02 = core[s], core[s + 1], core[s + 2]
    s10, s11, s12 = core[s + 3], core[s + 4], core[s + 5]
    s20, s21, s22 = core[s + 6], core[s + 7], core[s + 8]
    half = 0.5 * t
    for k in range(p.shape[0]):
        line = p[k] if along_rows else p[:, k]
        ax, ay, az = line[ATT], line[ATT + 1], line[ATT + 2]
        gx, gy, gz = line[GYRO_BIAS], line[GYRO_BIAS + 1], line[GYRO_BIAS + 2]
        bx, by, bz = line[ACCEL_BIAS], line[ACCEL_BIAS + 1], line[ACCEL_BIAS + 2]
        vx, vy, vz = line[VEL], line[VEL + 1], line[VEL + 2]
        dx = ay * uz - az * uy - (s00 * bx + s01 * by + s02 * bz)
        dy = az * ux - ax * uz - (s10 * bx + s11 * by + s12 * bz)
        dz = ax * uy - ay * ux - (s20 * bx + s21 * by + s22 * bz)
        line[POS] += t * vx + half * dx
        line[POS + 1] += t * vy + half * dy
        line[POS + 2] += t * vz + half * dz
        line[VEL] = vx + dx
        line[VEL + 1] = vy + dy
        line[VEL + 2] = vz + dz
        line[ATT] = ax - (s00 * gx + s01 * gy + s02 * gz)
        line[ATT + 1] = ay - (s10 * gx + s11 * gy + s12 * gz)
        line[ATT + 2] = az - (s20 * gx + s21 * gy + s22 * gz)


@kernel
def _decay(
    p: Array, core: Array, first: int, factor: float, var_0: float, var_1: float, var_2: float
) -> None:
    """Gauss-Markov decay of three states in mean and covariance; `var_*` are their stationary variances."""
    for i in range(first, first + 3):
        core[i + 1] *= factor
        for k in range(p.shape[0]):
            p[i, k] *= factor
            p[k, i] *= factor
    q = 1.0 - factor * factor
    p[first, first] += q * var_0
    p[first + 1, first + 1] += q * var_1
    p[first + 2, first + 2] += q * var_2


@kernel
def predict(p: Array, core: Array, process: Array) -> None:
    """Carry `p`, (22, 22) or with wind (24, 24), over the time summed up in `core`, and clear the sums. Stays
    exactly symmetric."""
    t = core[SUM_TIME]
    if t <= 0.0:
        return
    carry(p, core, t, False)
    carry(p, core, t, True)
    q = process[GYRO_BIAS_VAR]
    _decay(p, core, GYRO_BIAS, math.exp(-t / process[GYRO_BIAS_TAU]), q, q, q)
    q = process[ACCEL_BIAS_VAR]
    _decay(p, core, ACCEL_BIAS, math.exp(-t / process[ACCEL_BIAS_TAU]), q, q, q)
    q = process[GPS_VAR_HORIZONTAL]
    _decay(p, core, GPS_ERROR, math.exp(-t / process[GPS_TAU]), q, q, process[GPS_VAR_VERTICAL])
    turned_n, turned_e, turned_d = core[SUM_TURN], core[SUM_TURN + 1], core[SUM_TURN + 2]
    q = process[MAG_BIAS_VAR]
    turned = turned_n + turned_e + turned_d
    factor = math.exp(-t / process[MAG_BIAS_TAU] - turned / process[MAG_BIAS_TURN])
    _decay(p, core, MAG_BIAS, factor, q, q, q)
    p[ATT, ATT] += process[TURN_TILT] * turned_n + process[TURN_CROSS] * turned_d
    p[ATT + 1, ATT + 1] += process[TURN_TILT] * turned_e + process[TURN_CROSS] * turned_d
    p[ATT + 2, ATT + 2] += process[TURN_SCALE] * turned_d
    for i in range(3):
        p[ATT + i, ATT + i] += process[NOISE_ATT] * t
        p[VEL + i, VEL + i] += process[NOISE_VEL] * t
        p[POS + i, POS + i] += process[NOISE_VEL] * t * t * t / 3.0
    p[BARO_OFFSET, BARO_OFFSET] += process[BARO_WALK] * t
    for i in range(WIND, p.shape[0]):
        p[i, i] += process[WIND_WALK] * t
    for i in range(p.shape[0]):
        for j in range(i):
            mean = 0.5 * (p[i, j] + p[j, i])
            p[i, j] = mean
            p[j, i] = mean
    for i in range(9):
        core[SUM_R + i] = 0.0
    for i in range(3):
        core[SUM_FORCE + i] = 0.0
        core[SUM_TURN + i] = 0.0
    core[SUM_TIME] = 0.0


@kernel
def apply_scalar(p: Array, work: Array, residual: float, variance: float) -> None:
    """One scalar update: `work[PH]` holds P H^T, `residual` the innovation left after the updates before.

    Adds to the error estimate in `work[DX]`; P <- P - PH PH^T / S on one triangle, mirrored.
    """
    inverse = 1.0 / variance
    for i in range(p.shape[0]):
        gain = work[PH + i] * inverse
        work[DX + i] += gain * residual
        for j in range(i + 1):
            value = p[i, j] - gain * work[PH + j]
            p[i, j] = value
            p[j, i] = value


@kernel
def inject(core: Array, work: Array) -> None:
    """Move the error estimate into the nominal state and clear it."""
    hx, hy, hz = 0.5 * work[DX], 0.5 * work[DX + 1], 0.5 * work[DX + 2]
    w, x, y, z = core[Q], core[Q + 1], core[Q + 2], core[Q + 3]
    nw = w - hx * x - hy * y - hz * z
    nx = x + hx * w + hy * z - hz * y
    ny = y + hy * w + hz * x - hx * z
    nz = z + hz * w + hx * y - hy * x
    n = 1.0 / math.sqrt(nw * nw + nx * nx + ny * ny + nz * nz)
    core[Q], core[Q + 1], core[Q + 2], core[Q + 3] = nw * n, nx * n, ny * n, nz * n
    for i in range(VEL, PH):
        core[i + 1] += work[DX + i]
    for i in range(3):
        core[CORRECTION_VEL + i] += work[DX + VEL + i]
        core[CORRECTION_POS + i] += work[DX + POS + i]
    for i in range(PH):
        work[DX + i] = 0.0


@kernel
def shift(core: Array, first: int, dx: float, dy: float, dz: float) -> None:
    """Move position (first = POS) or velocity (VEL) by a jump; the history moves along."""
    for i, d in enumerate((dx, dy, dz)):
        core[first + 1 + i] += d
        if first == POS:
            core[CORRECTION_POS + i] += d
        else:
            core[CORRECTION_VEL + i] += d


@kernel
def forget(p: Array, index: int, variance: float) -> None:
    """State `index` is unknown again: no correlations, the given variance."""
    for k in range(p.shape[0]):
        p[index, k] = 0.0
        p[k, index] = 0.0
    p[index, index] = variance


@kernel
def is_sound(p: Array, core: Array) -> bool:
    """No NaN, no negative variance, no absurd nominal state (|v| over 1 km/s, |p| over 1000 km)."""
    for i in range(p.shape[0]):
        if not 0.0 <= p[i, i] < 1e12:
            return False
        if not abs(core[i + 1]) < 1e6:
            return False
    return (
        abs(core[Q]) <= 1.1
        and abs(core[X_VEL]) + abs(core[X_VEL + 1]) + abs(core[X_VEL + 2]) < 1e3
        and (abs(core[X_POS]) + abs(core[X_POS + 1]) + abs(core[X_POS + 2]) < 1e6)
    )
