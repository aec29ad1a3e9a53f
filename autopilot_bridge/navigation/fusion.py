"""Measurement updates: scalar by scalar, each with its Jacobian written out on the few states it touches.

Delayed measurements are compared with the history at the time they were taken: see `delayed_fusion`, which
has the positions and velocities.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation.covariance import apply_scalar, inject, is_sound, predict
from autopilot_bridge.navigation.delayed_fusion import body_axis_in_ned, fuse_position, fuse_velocity
from autopilot_bridge.navigation.states import (
    ATT,
    BARO_OFFSET,
    CORRECTION_POS,
    DX,
    EARTH_RATE,
    GYRO_BIAS,
    HISTORY_POS,
    MAG_BIAS,
    PH,
    POS,
    SUM_GYRO,
    SUM_GYRO_TIME,
    VEL,
    X_BARO_OFFSET,
    X_GYRO_BIAS,
    X_MAG_BIAS,
    X_POS,
    X_VEL,
    R,
)
from flightsim.foundation.kernels import kernel
from flightsim.foundation.layouts import Slots

Array = NDArray[np.float64]

_obs = Slots()
# obs: the measurements of one update
GPS_POS: Final = _obs.place(3)  # NED from the origin, m
GPS_VEL: Final = _obs.place(3)
GPS_POS_VAR: Final = _obs.place(3)
GPS_VEL_VAR: Final = _obs.place(3)
GPS_DELAY_S: Final = _obs.place()
BARO_HEIGHT: Final = _obs.place()  # pressure altitude, m
BARO_VAR: Final = _obs.place()
BARO_DELAY_S: Final = _obs.place()
MAG: Final = _obs.place(3)  # FRD, gauss
MAG_VAR: Final = _obs.place()
MAG_NED: Final = _obs.place(3)  # expected field
HOLD: Final = _obs.place(3)  # held position, NED
HOLD_VAR: Final = _obs.place()
HOLD_HEIGHT_VAR: Final = _obs.place()
REST_VEL_VAR: Final = _obs.place()
REST_RATE_VAR: Final = _obs.place()
GATE_GPS: Final = _obs.place()
GATE_GPS_VEL: Final = _obs.place()
GATE_BARO: Final = _obs.place()
GATE_MAG: Final = _obs.place()
# results
RATIO_VEL: Final = _obs.place()
RATIO_POS: Final = _obs.place()
RATIO_GPS_HEIGHT: Final = _obs.place()
RATIO_BARO: Final = _obs.place()
RATIO_MAG: Final = _obs.place()
OBS_SIZE: Final = _obs.size

# which measurements are there
HAS_GPS: Final = 1
HAS_BARO: Final = 2
HAS_MAG: Final = 4
HAS_HOLD: Final = 8
HAS_HOLD_HEIGHT: Final = 16
HAS_REST: Final = 32
# what was accepted
ACCEPTED_GPS_VEL: Final = 1
ACCEPTED_GPS_POS: Final = 2
ACCEPTED_GPS_HEIGHT: Final = 4
ACCEPTED_BARO: Final = 8
ACCEPTED_MAG: Final = 16
UNSOUND: Final = 32


@kernel
def single_ph(p: Array, work: Array, index: int) -> None:
    """PH of a measurement of state `index` itself."""
    for i in range(p.shape[0]):
        work[PH + i] = p[i, index]


@kernel
def baro_dot(work: Array, base: int, delay: float) -> float:
    """H times the vector at `base`, for the pressure altitude."""
    return -work[base + POS + 2] + delay * work[base + VEL + 2] + work[base + BARO_OFFSET]


@kernel
def baro_ph(p: Array, work: Array, delay: float) -> float:
    """PH of the pressure altitude; returns H P H^T."""
    for i in range(p.shape[0]):
        work[PH + i] = -p[i, POS + 2] + delay * p[i, VEL + 2] + p[i, BARO_OFFSET]
    return baro_dot(work, PH, delay)


@kernel
def mag_dot(work: Array, base: int, axis: int, h0: float, h1: float, h2: float) -> float:
    """H times the vector at `base`, for a magnetometer axis."""
    return (
        h0 * work[base + ATT]
        + h1 * work[base + ATT + 1]
        + h2 * work[base + ATT + 2]
        + work[base + MAG_BIAS + axis]
    )


@kernel
def mag_ph(p: Array, work: Array, axis: int, h0: float, h1: float, h2: float) -> float:
    """PH of a magnetometer axis; returns H P H^T."""
    for i in range(p.shape[0]):
        work[PH + i] = h0 * p[i, ATT] + h1 * p[i, ATT + 1] + h2 * p[i, ATT + 2] + p[i, MAG_BIAS + axis]
    return mag_dot(work, PH, axis, h0, h1, h2)


@kernel
def fuse_gps(p: Array, core: Array, history: Array, work: Array, obs: Array, row: int) -> int:
    """GPS velocity, horizontal position and height, each gated as a whole."""
    accepted = 0
    delay = obs[GPS_DELAY_S]
    vel, vel_var = obs[GPS_VEL : GPS_VEL + 3], obs[GPS_VEL_VAR : GPS_VEL_VAR + 3]
    obs[RATIO_VEL] = fuse_velocity(p, core, history, work, row, vel, vel_var, obs[GATE_GPS_VEL], delay)
    if obs[RATIO_VEL] <= 1.0:
        accepted |= ACCEPTED_GPS_VEL
    pos, pos_var, gate = obs[GPS_POS : GPS_POS + 3], obs[GPS_POS_VAR : GPS_POS_VAR + 3], obs[GATE_GPS]
    obs[RATIO_POS] = fuse_position(p, core, history, work, row, 0, 2, pos, pos_var, gate, delay, True)
    if obs[RATIO_POS] <= 1.0:
        accepted |= ACCEPTED_GPS_POS
    obs[RATIO_GPS_HEIGHT] = fuse_position(p, core, history, work, row, 2, 3, pos, pos_var, gate, delay, True)
    if obs[RATIO_GPS_HEIGHT] <= 1.0:
        accepted |= ACCEPTED_GPS_HEIGHT
    return accepted


@kernel
def fuse_baro(p: Array, core: Array, history: Array, work: Array, obs: Array, row: int) -> int:
    """Pressure altitude."""
    s = baro_ph(p, work, obs[BARO_DELAY_S]) + obs[BARO_VAR]
    height = -history[row, HISTORY_POS + 2] - core[CORRECTION_POS + 2]
    residual = obs[BARO_HEIGHT] - height - core[X_BARO_OFFSET] - baro_dot(work, DX, obs[BARO_DELAY_S])
    obs[RATIO_BARO] = abs(residual) / (obs[GATE_BARO] * math.sqrt(s))
    if not obs[RATIO_BARO] <= 1.0:
        return 0
    apply_scalar(p, work, residual, s)
    return ACCEPTED_BARO


@kernel
def fuse_mag(p: Array, core: Array, history: Array, work: Array, obs: Array, row: int) -> int:
    """The three magnetometer axes: z_i = r_i . m + bias_i, and r_i x m is the Jacobian to the attitude
    error."""
    mx, my, mz = obs[MAG_NED], obs[MAG_NED + 1], obs[MAG_NED + 2]
    worst = 0.0
    for again in range(2):
        for a in range(3):
            rx, ry, rz = body_axis_in_ned(history, row, a)
            h0, h1, h2 = ry * mz - rz * my, rz * mx - rx * mz, rx * my - ry * mx
            s = mag_ph(p, work, a, h0, h1, h2) + obs[MAG_VAR]
            residual = obs[MAG + a] - (rx * mx + ry * my + rz * mz) - core[X_MAG_BIAS + a]
            residual -= mag_dot(work, DX, a, h0, h1, h2)
            if again == 0:
                worst = max(worst, abs(residual) / (obs[GATE_MAG] * math.sqrt(s)))
            else:
                apply_scalar(p, work, residual, s)
        if again == 0:
            obs[RATIO_MAG] = worst
            if not worst <= 1.0:
                return 0
    return ACCEPTED_MAG


@kernel
def fuse_direct(p: Array, work: Array, index: int, residual: float, variance: float) -> None:
    """A measurement of state `index` itself, not gated (position hold, standing still)."""
    single_ph(p, work, index)
    apply_scalar(p, work, residual - work[DX + index], work[PH + index] + variance)


@kernel
def fuse_rest(p: Array, core: Array, work: Array, obs: Array) -> None:
    """Standing still: velocity zero, and the mean gyro reading is bias and Earth's rotation."""
    for a in range(3):
        fuse_direct(p, work, VEL + a, -core[X_VEL + a], obs[REST_VEL_VAR])
    if core[SUM_GYRO_TIME] > 0.0:
        for a in range(3):
            rate = core[SUM_GYRO + a] / core[SUM_GYRO_TIME]
            for k in range(3):
                rate -= core[R + 3 * k + a] * core[EARTH_RATE + k]
            fuse_direct(p, work, GYRO_BIAS + a, rate - core[X_GYRO_BIAS + a], obs[REST_RATE_VAR])


@kernel
def restart_mean_rate(core: Array) -> None:
    """Begin a new average of the gyro for the next update at rest."""
    for a in range(3):
        core[SUM_GYRO + a] = 0.0
    core[SUM_GYRO_TIME] = 0.0


@kernel
def update(
    p: Array,
    core: Array,
    history: Array,
    work: Array,
    obs: Array,
    process: Array,
    has: int,
    gps_row: int,
    baro_row: int,
    mag_row: int,
) -> int:
    """Predict the covariance, fuse what is there (`has`), inject; returns what was accepted and soundness."""
    predict(p, core, process)
    accepted = 0
    if has & HAS_GPS:
        accepted |= fuse_gps(p, core, history, work, obs, gps_row)
    if has & HAS_BARO:
        accepted |= fuse_baro(p, core, history, work, obs, baro_row)
    if has & HAS_MAG:
        accepted |= fuse_mag(p, core, history, work, obs, mag_row)
    if has & HAS_HOLD:
        fuse_direct(p, work, POS, obs[HOLD] - core[X_POS], obs[HOLD_VAR])
        fuse_direct(p, work, POS + 1, obs[HOLD + 1] - core[X_POS + 1], obs[HOLD_VAR])
    if has & HAS_HOLD_HEIGHT:
        fuse_direct(p, work, POS + 2, obs[HOLD + 2] - core[X_POS + 2], obs[HOLD_HEIGHT_VAR])
    if has & HAS_REST:
        fuse_rest(p, core, work, obs)
        restart_mean_rate(core)
    if has:
        inject(core, work)
    if not is_sound(p, core):
        accepted |= UNSOUND
    return accepted
