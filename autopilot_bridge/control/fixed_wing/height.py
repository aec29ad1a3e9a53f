"""Height trajectory of a fixed wing: what the energy control follows instead of height steps."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing import layout as c
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

_CLOSING_1_S: Final = 0.8  # the last metres are closed in proportion to what is left
_LEASH: Final = 1.2  # the reference runs no further ahead than what would ask for the greatest climb


@kernel
def reset_height(height: float, climb: float, s: Array) -> None:
    """Start the trajectory from the present height and climb rate, both up."""
    s[c.HEIGHT_REFERENCE] = height if math.isfinite(height) else 0.0
    s[c.HEIGHT_RATE_REFERENCE] = climb if math.isfinite(climb) else 0.0
    s[c.HEIGHT_CONTROLLED] = 0.0


@kernel
def follow_height(wanted: float, slope: float, height: float, p: Array, s: Array, dt: float) -> None:
    """Move the reference towards `wanted`, which itself climbs with `slope`, within the rates for steps.

    Heights up, m; rates m/s. The reference's rate, HEIGHT_RATE_REFERENCE, is that over the slope.
    """
    acceleration = p[c.HEIGHT_ACCELERATION]
    left = wanted - s[c.HEIGHT_REFERENCE]
    size = abs(left)
    linear = acceleration / (_CLOSING_1_S * _CLOSING_1_S)
    speed = size * _CLOSING_1_S if size <= linear else math.sqrt(acceleration * (2.0 * size - linear))
    rate = math.copysign(speed, left)
    rate = min(min(p[c.CLIMB_TARGET], p[c.CLIMB_MAX]), max(-min(p[c.SINK_TARGET], p[c.SINK_MAX]), rate))
    change = acceleration * dt
    s[c.HEIGHT_RATE_REFERENCE] += min(change, max(-change, rate - s[c.HEIGHT_RATE_REFERENCE]))
    reference = s[c.HEIGHT_REFERENCE] + (s[c.HEIGHT_RATE_REFERENCE] + slope) * dt
    # where the vehicle can't follow (a glider, a stopped motor), the reference waits for it
    ahead = _LEASH * p[c.CLIMB_MAX] * p[c.HEIGHT_TC]
    behind = _LEASH * p[c.SINK_MAX] * p[c.HEIGHT_TC]
    s[c.HEIGHT_REFERENCE] = min(height + ahead, max(height - behind, reference))
    s[c.HEIGHT_CONTROLLED] = 1.0
