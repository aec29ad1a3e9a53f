"""Measurement updates of external odometry: position, velocity and heading, against the history.

Position and velocity are those of `delayed_fusion`. The heading of r_ned_from_frd with the attitude error
theta (NED): with r the rotation matrix,
    d heading = theta_d - r[2, 0] (r[0, 0] theta_n + r[1, 0] theta_e) / (r[0, 0]^2 + r[1, 0]^2).
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation.covariance import apply_scalar, inject, is_sound
from autopilot_bridge.navigation.delayed_fusion import body_axis_in_ned, fuse_position, fuse_velocity
from autopilot_bridge.navigation.states import ATT, DX, PH
from flightsim.foundation.kernels import kernel
from flightsim.foundation.layouts import Slots

Array = NDArray[np.float64]

_obs = Slots()
# obs: one sample, NED
EXT_POS: Final = _obs.place(3)
EXT_VEL: Final = _obs.place(3)
EXT_YAW: Final = _obs.place()
EXT_POS_VAR: Final = _obs.place(3)
EXT_VEL_VAR: Final = _obs.place(3)
EXT_YAW_VAR: Final = _obs.place()
EXT_DELAY_S: Final = _obs.place()
EXT_GATE_POS: Final = _obs.place()
EXT_GATE_VEL: Final = _obs.place()
EXT_GATE_YAW: Final = _obs.place()
# results: the innovation over its gate
EXT_RATIO_POS: Final = _obs.place()
EXT_RATIO_HEIGHT: Final = _obs.place()
EXT_RATIO_VEL: Final = _obs.place()
EXT_RATIO_YAW: Final = _obs.place()
EXT_SIZE: Final = _obs.size

# which parts are there, and which were accepted
EXT_HAS_POS: Final = 1
EXT_HAS_HEIGHT: Final = 2
EXT_HAS_VEL: Final = 4
EXT_HAS_YAW: Final = 8
EXT_UNSOUND: Final = 32

_LEAST_LEVEL: Final = 1e-3  # horizontal part of the nose, squared, below which there is no heading


@kernel
def heading_dot(work: Array, base: int, hn: float, he: float) -> float:
    """H times the vector at `base`, for the heading."""
    return hn * work[base + ATT] + he * work[base + ATT + 1] + work[base + ATT + 2]


@kernel
def heading_ph(p: Array, work: Array, hn: float, he: float) -> float:
    """PH of the heading; returns H P H^T."""
    for i in range(p.shape[0]):
        work[PH + i] = hn * p[i, ATT] + he * p[i, ATT + 1] + p[i, ATT + 2]
    return heading_dot(work, PH, hn, he)


@kernel
def wrapped(angle: float) -> float:
    """An angle within -pi..pi. Unlike `wrap_pi` it leaves one that is within exactly as it is."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@kernel
def fuse_heading(p: Array, history: Array, work: Array, obs: Array, row: int) -> bool:
    """The heading, gated."""
    r00, r10, r20 = body_axis_in_ned(history, row, 0)
    level = r00 * r00 + r10 * r10
    if level < _LEAST_LEVEL:
        return False
    hn, he = -r20 * r00 / level, -r20 * r10 / level
    s = heading_ph(p, work, hn, he) + obs[EXT_YAW_VAR]
    residual = wrapped(obs[EXT_YAW] - math.atan2(r10, r00)) - heading_dot(work, DX, hn, he)
    obs[EXT_RATIO_YAW] = abs(residual) / (obs[EXT_GATE_YAW] * math.sqrt(s))
    if not obs[EXT_RATIO_YAW] <= 1.0:
        return False
    apply_scalar(p, work, residual, s)
    return True


@kernel
def fuse_external(p: Array, core: Array, history: Array, work: Array, obs: Array, has: int, row: int) -> int:
    """Fuse the parts of one sample that are there (`has`) and inject; returns those that were accepted."""
    accepted = 0
    delay = obs[EXT_DELAY_S]
    if has & EXT_HAS_YAW and fuse_heading(p, history, work, obs, row):
        accepted |= EXT_HAS_YAW
    if has & EXT_HAS_VEL:
        vel, vel_var = obs[EXT_VEL : EXT_VEL + 3], obs[EXT_VEL_VAR : EXT_VEL_VAR + 3]
        obs[EXT_RATIO_VEL] = fuse_velocity(
            p, core, history, work, row, vel, vel_var, obs[EXT_GATE_VEL], delay
        )
        if obs[EXT_RATIO_VEL] <= 1.0:
            accepted |= EXT_HAS_VEL
    pos, pos_var, gate = obs[EXT_POS : EXT_POS + 3], obs[EXT_POS_VAR : EXT_POS_VAR + 3], obs[EXT_GATE_POS]
    if has & EXT_HAS_POS:
        obs[EXT_RATIO_POS] = fuse_position(
            p, core, history, work, row, 0, 2, pos, pos_var, gate, delay, False
        )
        if obs[EXT_RATIO_POS] <= 1.0:
            accepted |= EXT_HAS_POS
    if has & EXT_HAS_HEIGHT:
        obs[EXT_RATIO_HEIGHT] = fuse_position(
            p, core, history, work, row, 2, 3, pos, pos_var, gate, delay, False
        )
        if obs[EXT_RATIO_HEIGHT] <= 1.0:
            accepted |= EXT_HAS_HEIGHT
    if accepted:
        inject(core, work)
    if not is_sound(p, core):
        accepted |= EXT_UNSOUND
    return accepted
