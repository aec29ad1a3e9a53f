"""Vertical speed by pitch alone, throttle given: short final and flare, where the energy control is too slow.

The lift that a vertical acceleration asks for at the airspeed of this moment is flown by angle of attack, so
that a gust along the flight path is answered before it has changed the sink. Airspeed is no concern of the
pitch here; the task's throttle sees to it.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing import layout as c
from autopilot_bridge.control.fixed_wing.lateral import GRAVITY_M_S2, stall_speed
from flightsim.kernels import kernel

Array = NDArray[np.float64]

_NAV_VEL_DOWN: Final = 9  # navigation slots, as in navigation.layout
_NAV_PITCH: Final = 26
_NAV_EAS: Final = 32
_GAIN: Final = 1.5  # error of the vertical speed to vertical acceleration, times the pitch's time constant
_HASTE: Final = 1.0  # the error of the pitch is added so often: it follows in half of its time constant
_ACCELERATION_MAX: Final = 0.8  # of gravity
_INTEGRAL_1_S: Final = 1.5  # flight-path angle missed to pitch
_INTEGRAL_MAX_RAD: Final = 0.12
_STEEPEST_RAD: Final = math.radians(15.0)


@kernel
def _angle_of_attack(airspeed: float, load_factor: float, p: Array) -> float:
    """Pitch over the flight path that gives a load factor at an airspeed; short of the stall."""
    lift, trim = p[c.LIFT_ANGLE], p[c.AIRSPEED_TRIM]
    most = trim / stall_speed(p)
    ratio = trim / max(airspeed, 1.0)
    return p[c.TRIM_PITCH] - lift + lift * min(most * most, load_factor * ratio * ratio)


@kernel
def pitch_for_climb(
    nav: Array, p: Array, s: Array, dt: float, climb: float, lowest: float, highest: float
) -> float:
    """Pitch setpoint, rad, that flies a climb rate within limits of the pitch."""
    airspeed = nav[_NAV_EAS] if math.isfinite(nav[_NAV_EAS]) else s[c.EAS]
    airspeed = max(airspeed, stall_speed(p))
    speed = max(s[c.EAS], stall_speed(p)) * s[c.EAS_TO_TAS]
    actual = -nav[_NAV_VEL_DOWN] if math.isfinite(nav[_NAV_VEL_DOWN]) else 0.0
    missing = climb - actual
    share = min(_ACCELERATION_MAX, max(-_ACCELERATION_MAX, _GAIN / p[c.PITCH_TC] * missing / GRAVITY_M_S2))
    load_factor = (1.0 + share) / max(0.5, math.cos(s[c.ROLL_SETPOINT]))
    path = min(_STEEPEST_RAD, max(-_STEEPEST_RAD, actual / speed))
    pitch = _angle_of_attack(airspeed, load_factor, p) + path
    if s[c.CLIMB_FLOWN] == 0.0:  # from the pitch flown so far
        s[c.CLIMB_FLOWN] = 1.0
        s[c.PITCH_INTEGRAL] = s[c.PITCH_SETPOINT] - pitch
    step = _INTEGRAL_1_S * missing / speed * dt
    wanted = pitch + s[c.PITCH_INTEGRAL]
    if not ((wanted >= highest and step > 0.0) or (wanted <= lowest and step < 0.0)):
        s[c.PITCH_INTEGRAL] += step
    s[c.PITCH_INTEGRAL] = min(_INTEGRAL_MAX_RAD, max(-_INTEGRAL_MAX_RAD, s[c.PITCH_INTEGRAL]))
    wanted = pitch + s[c.PITCH_INTEGRAL]
    wanted += _HASTE * (wanted - nav[_NAV_PITCH])
    return min(highest, max(lowest, wanted))
