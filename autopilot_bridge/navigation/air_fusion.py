"""Air data updates of a fixed wing: true airspeed, and no sideslip in coordinated flight.

With the vehicle's velocity through the air `a = v - w` (NED; the wind w is horizontal) and the body's y axis,

    airspeed  |a|,      error:  a/|a| . (v error - w error)
    sideslip  y . a,    error:  y . (v error - w error) + (y x a) . attitude error

Both are gated with what one sample may differ by, and fused with a larger variance: turbulence makes an error
that lasts for its correlation time T, so samples dt apart carry as little about the steady wind as white
noise of (1 + 2 T / dt) times the variance (same power at low frequencies; Maybeck, "Stochastic Models,
Estimation, and Control", vol. 1, section 4.11).

While GPS gives the velocity, only the wind is corrected (PX4 does the same): the other states are
"considered" (Schmidt), their covariance with the wind stays right.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation.covariance import apply_scalar, inject, is_sound
from autopilot_bridge.navigation.states import (
    ATT,
    CORRECTION_VEL,
    DX,
    HISTORY_VEL,
    PH,
    VEL,
    WIND,
    X_VEL,
    X_WIND,
    R,
)
from flightsim.foundation.kernels import kernel
from flightsim.foundation.layouts import Slots

Array = NDArray[np.float64]

_air = Slots()
# air: the measurements of one update
AIRSPEED: Final = _air.place()  # true, m/s
AIRSPEED_VAR: Final = _air.place()  # to fuse with
AIRSPEED_GATE_VAR: Final = _air.place()  # of one sample
SIDESLIP_VAR: Final = _air.place()  # (m/s)^2
SIDESLIP_GATE_VAR: Final = _air.place()
GATE_AIRSPEED: Final = _air.place()
GATE_SIDESLIP: Final = _air.place()
# results
AIRSPEED_RATIO: Final = _air.place()  # innovation over gate
AIRSPEED_INNOVATION: Final = _air.place()  # m/s
AIRSPEED_STATE_VAR: Final = _air.place()  # of the predicted airspeed
SIDESLIP_RATIO: Final = _air.place()
SIDESLIP_INNOVATION: Final = _air.place()
SIDESLIP_STATE_VAR: Final = _air.place()
AIR_SIZE: Final = _air.size

# what to do
HAS_AIRSPEED: Final = 1
HAS_SIDESLIP: Final = 2
WIND_ONLY: Final = 4
JUDGE_AIRSPEED: Final = 8  # compute its innovation, don't fuse
# what came of it
ACCEPTED_AIRSPEED: Final = 1
ACCEPTED_SIDESLIP: Final = 2
UNSOUND: Final = 32  # as in fusion

_LEAST_AIRSPEED_M_S: Final = 1.0


@kernel
def air_dot(
    work: Array, base: int, hx: float, hy: float, hz: float, ax: float, ay: float, az: float
) -> float:
    """H times the vector at `base` of `work`; h: of the air's velocity, a: of the attitude error."""
    return (
        hx * (work[base + VEL] - work[base + WIND])
        + hy * (work[base + VEL + 1] - work[base + WIND + 1])
        + hz * work[base + VEL + 2]
        + ax * work[base + ATT]
        + ay * work[base + ATT + 1]
        + az * work[base + ATT + 2]
    )


@kernel
def air_ph(p: Array, work: Array, hx: float, hy: float, hz: float, ax: float, ay: float, az: float) -> float:
    """PH of such a measurement; returns H P H^T."""
    for i in range(p.shape[0]):
        work[PH + i] = (
            hx * (p[i, VEL] - p[i, WIND])
            + hy * (p[i, VEL + 1] - p[i, WIND + 1])
            + hz * p[i, VEL + 2]
            + ax * p[i, ATT]
            + ay * p[i, ATT + 1]
            + az * p[i, ATT + 2]
        )
    return air_dot(work, PH, hx, hy, hz, ax, ay, az)


@kernel
def apply_to_wind(p: Array, work: Array, residual: float, variance: float) -> None:
    """As `apply_scalar`, with a gain for the wind alone."""
    inverse = 1.0 / variance
    for j in range(WIND, p.shape[0]):
        gain = work[PH + j] * inverse
        work[DX + j] += gain * residual
        for i in range(j + 1):
            value = p[i, j] - gain * work[PH + i]
            p[i, j] = value
            p[j, i] = value


@kernel
def fuse_airspeed(p: Array, core: Array, history: Array, work: Array, air: Array, row: int, todo: int) -> int:
    """True airspeed at a row of the history."""
    x = history[row, HISTORY_VEL] + core[CORRECTION_VEL] - core[X_WIND]
    y = history[row, HISTORY_VEL + 1] + core[CORRECTION_VEL + 1] - core[X_WIND + 1]
    z = history[row, HISTORY_VEL + 2] + core[CORRECTION_VEL + 2]
    predicted = math.sqrt(x * x + y * y + z * z)
    least = max(predicted, _LEAST_AIRSPEED_M_S)
    hx, hy, hz = x / least, y / least, z / least
    s = air_ph(p, work, hx, hy, hz, 0.0, 0.0, 0.0)
    residual = air[AIRSPEED] - predicted - air_dot(work, DX, hx, hy, hz, 0.0, 0.0, 0.0)
    air[AIRSPEED_INNOVATION] = residual
    air[AIRSPEED_STATE_VAR] = s
    air[AIRSPEED_RATIO] = abs(residual) / (air[GATE_AIRSPEED] * math.sqrt(s + air[AIRSPEED_GATE_VAR]))
    if not todo & HAS_AIRSPEED or not air[AIRSPEED_RATIO] <= 1.0 or predicted < _LEAST_AIRSPEED_M_S:
        return 0
    if todo & WIND_ONLY:
        apply_to_wind(p, work, residual, s + air[AIRSPEED_VAR])
    else:
        apply_scalar(p, work, residual, s + air[AIRSPEED_VAR])
    return ACCEPTED_AIRSPEED


@kernel
def fuse_sideslip(p: Array, core: Array, work: Array, air: Array, todo: int) -> int:
    """No flow from the side, now."""
    x, y, z = core[X_VEL] - core[X_WIND], core[X_VEL + 1] - core[X_WIND + 1], core[X_VEL + 2]
    hx, hy, hz = core[R + 1], core[R + 4], core[R + 7]
    ax, ay, az = hy * z - hz * y, hz * x - hx * z, hx * y - hy * x
    s = air_ph(p, work, hx, hy, hz, ax, ay, az)
    residual = -(hx * x + hy * y + hz * z) - air_dot(work, DX, hx, hy, hz, ax, ay, az)
    air[SIDESLIP_INNOVATION] = residual
    air[SIDESLIP_STATE_VAR] = s
    air[SIDESLIP_RATIO] = abs(residual) / (air[GATE_SIDESLIP] * math.sqrt(s + air[SIDESLIP_GATE_VAR]))
    if not air[SIDESLIP_RATIO] <= 1.0:
        return 0
    if todo & WIND_ONLY:
        apply_to_wind(p, work, residual, s + air[SIDESLIP_VAR])
    else:
        apply_scalar(p, work, residual, s + air[SIDESLIP_VAR])
    return ACCEPTED_SIDESLIP


@kernel
def update(p: Array, core: Array, history: Array, work: Array, air: Array, row: int, todo: int) -> int:
    """Fuse what is there (`todo`) into a covariance that has been predicted, and inject."""
    accepted = 0
    if todo & (HAS_AIRSPEED | JUDGE_AIRSPEED):
        accepted |= fuse_airspeed(p, core, history, work, air, row, todo)
    if todo & HAS_SIDESLIP:
        accepted |= fuse_sideslip(p, core, work, air, todo)
    if accepted:
        inject(core, work)
    if not is_sound(p, core):
        accepted |= UNSOUND
    return accepted
