"""Multirotor: the direction down from the drag of its rotors and body (compiled).

The accelerometer of a multirotor that accelerates does not measure the tilt, because thrust is along the
body's down axis at any attitude. Across that axis it measures drag, which is proportional to the speed
relative to the air. It thus measures speed, and this speed is compared with the one integrated from attitude
and force (docs/attitude.md).
"""

import math

import numpy as np
from numpy.typing import NDArray

from estimators.attitude import layout as at
from estimators.attitude import parameters as par
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

_SMOOTHING_S = 0.2
_LEARN_AFTER_S = 5.0
_DRAG_MIN_1_S = 0.1
_DRAG_MAX_1_S = 3.0
_LEARN_TIME_S = 300.0
_PRIOR_M2_S = 3.0
"""Weight of the initial value: square of speed times time."""
_SPEED_MAX_M_S = 40.0
_LEVEL_LEAST = 0.5


@kernel
def start(x: Array, p: Array) -> None:
    """Initialise: nothing is known except the initial value of the drag."""
    x[at.DRAG] = p[par.DRAG]
    x[at.SPEED_SQUARE] = _PRIOR_M2_S
    x[at.FORCE_SQUARE] = _PRIOR_M2_S * p[par.DRAG] * p[par.DRAG]


@kernel
def reference(
    x: Array, p: Array, dt: float, wx: float, wy: float, wz: float, ax: float, ay: float, az: float
) -> None:
    """Compute the velocity relative to the air and the reference for down; arguments as in the fixed-wing
    form.
    """
    down_x, down_y, down_z = x[at.DOWN], x[at.DOWN + 1], x[at.DOWN + 2]
    vx, vy = x[at.VELOCITY], x[at.VELOCITY + 1]
    climb = 0.0 if math.isnan(x[at.CLIMB]) else x[at.CLIMB]
    vz = -(climb + down_x * vx + down_y * vy) / max(_LEVEL_LEAST, down_z)
    vz = min(_SPEED_MAX_M_S, max(-_SPEED_MAX_M_S, vz))
    pull_x = p[par.DRAG_VELOCITY_GAIN] * (-ax / x[at.DRAG] - vx)
    pull_y = p[par.DRAG_VELOCITY_GAIN] * (-ay / x[at.DRAG] - vy)
    vx += dt * (ax + GRAVITY_M_S2 * down_x - (wy * vz - wz * vy) + pull_x)
    vy += dt * (ay + GRAVITY_M_S2 * down_y - (wz * vx - wx * vz) + pull_y)
    x[at.VELOCITY] = min(_SPEED_MAX_M_S, max(-_SPEED_MAX_M_S, vx))
    x[at.VELOCITY + 1] = min(_SPEED_MAX_M_S, max(-_SPEED_MAX_M_S, vy))
    x[at.VELOCITY + 2] = vz
    # g down = v' + w x v - a with the filter's own v': its prediction, and the correction by the drag.
    x[at.REFERENCE] = GRAVITY_M_S2 * down_x + pull_x
    x[at.REFERENCE + 1] = GRAVITY_M_S2 * down_y + pull_y
    x[at.REFERENCE + 2] = GRAVITY_M_S2 * down_z
    _learn_drag(x, p, dt, ax, ay)


@kernel
def _learn_drag(x: Array, p: Array, dt: float, ax: float, ay: float) -> None:
    """Learn the drag as the square root of the ratio of the mean squares of force and velocity.

    Least squares of force by velocity makes the drag too small (the velocity has errors), and of velocity by
    force too great (gusts and vibration are in the force). This is the geometric mean of both.
    """
    slow = min(1.0, dt / _SMOOTHING_S)
    x[at.SIDEWAYS] += slow * (ax - x[at.SIDEWAYS])
    x[at.SIDEWAYS + 1] += slow * (ay - x[at.SIDEWAYS + 1])
    spread = p[par.DRAG_LEARNING]
    if x[at.AGE] < _LEARN_AFTER_S or math.isinf(spread):
        return
    fx, fy = x[at.SIDEWAYS], x[at.SIDEWAYS + 1]
    vx, vy = x[at.VELOCITY], x[at.VELOCITY + 1]
    rx, ry = fx / x[at.DRAG] + vx, fy / x[at.DRAG] + vy
    weight = dt / (1.0 + (rx * rx + ry * ry) / (spread * spread))
    fade = 1.0 - dt / _LEARN_TIME_S
    x[at.FORCE_SQUARE] = fade * x[at.FORCE_SQUARE] + weight * (fx * fx + fy * fy)
    x[at.SPEED_SQUARE] = fade * x[at.SPEED_SQUARE] + weight * (vx * vx + vy * vy)
    drag = math.sqrt(x[at.FORCE_SQUARE] / x[at.SPEED_SQUARE])
    x[at.DRAG] = min(_DRAG_MAX_1_S, max(_DRAG_MIN_1_S, drag))
