"""One physics step of the fixed-wing control laws: guidance at 50 Hz, attitude and rates every step."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing import layout as c
from autopilot_bridge.control.fixed_wing import setpoint as sp_layout
from autopilot_bridge.control.fixed_wing.air import update_air
from autopilot_bridge.control.fixed_wing.attitude import (
    attitude_control,
    ease_on_runway,
    limit_surfaces,
    rate_control,
    wheel_control,
)
from autopilot_bridge.control.fixed_wing.energy import PITCH_LIMIT_RAD, energy_control
from autopilot_bridge.control.fixed_wing.lateral import lateral_control
from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.interface import AILERON, BRAKE, ELEVATOR, FLAPS, RUDDER, STEERING, THROTTLE

Array = NDArray[np.float64]

_NAV_RATES: Final = 4  # navigation slots, as in navigation.layout
_NAV_ROLL: Final = 25
_NAV_PITCH: Final = 26
_NAV_YAW: Final = 27
_SP_THROTTLE: Final = 8  # setpoint slots, as in control.fixed_wing_setpoint
_SP_RATES: Final = 9
_SP_SURFACES: Final = 12
_SP_STEERING: Final = 15
_SP_LEVEL: Final = 19
_SP_FLAPS: Final = 21
_SP_BRAKE: Final = 22
_SP_YAW_STICK: Final = 23


@kernel
def _given(value: float, low: float, high: float) -> float:
    """The value within limits; 0 for NaN."""
    return min(high, max(low, value)) if math.isfinite(value) else 0.0


@kernel
def _rest(nav: Array, s: Array, actuators: Array) -> None:
    """Propeller stopped, surfaces neutral, every integrator and filter at its start."""
    for i in range(actuators.shape[0]):
        actuators[i] = 0.0
    for i in range(c.COUNTER, c.STATE_SIZE):
        s[i] = 0.0
    s[c.COUNTER] = s[c.DIVISOR]
    s[c.Q_SETPOINT] = 1.0
    s[c.HEADING_SETPOINT] = math.nan
    s[c.COURSE_SETPOINT] = math.nan
    for i in range(3):
        s[c.VEL_SETPOINT + i] = math.nan
        rate = nav[_NAV_RATES + i]
        s[c.RATE_PREVIOUS + i] = rate if math.isfinite(rate) else 0.0


@kernel
def _sum_of_guidance(s: Array) -> float:
    """Finite as long as all is that guidance carries on from step to step."""
    total = s[c.EAS] + s[c.EAS_RATE] + s[c.EAS_TO_TAS] + s[c.ENERGY_RATE]
    for i in range(c.ROLL_SETPOINT, c.HEIGHT_CONTROLLED):
        total += s[i]
    for i in range(c.AIRSPEED_SETPOINT, c.Q_SETPOINT):
        total += s[i]
    return total


@kernel
def _guide(nav: Array, sp: Array, p: Array, s: Array, level: float) -> None:
    """The 50 Hz part: airspeed filter, lateral guidance, energy control."""
    dt = s[c.DT] * s[c.DIVISOR]
    update_air(nav, p, s, dt)
    if level != sp_layout.FLY:
        s[c.FLYING] = 0.0
        s[c.VEL_SETPOINT + 2] = math.nan
        s[c.HEADING_SETPOINT] = math.nan
        s[c.COURSE_SETPOINT] = math.nan
        s[c.HEIGHT_CONTROLLED] = 0.0
        s[c.UNDERSPEED] = 0.0
        s[c.ROLL_SETPOINT] = nav[_NAV_ROLL]
        s[c.PITCH_SETPOINT] = nav[_NAV_PITCH]
        s[c.THROTTLE] = _given(sp[_SP_THROTTLE], 0.0, 1.0)
        return
    entering = s[c.FLYING] == 0.0
    if entering:  # from the attitude flown so far, so that the switch isn't felt
        s[c.FLYING] = 1.0
        s[c.ROLL_SETPOINT] = nav[_NAV_ROLL]
        s[c.PITCH_SETPOINT] = min(PITCH_LIMIT_RAD, max(-PITCH_LIMIT_RAD, nav[_NAV_PITCH]))
    lateral_control(nav, sp, p, s, dt)
    energy_control(nav, sp, p, s, dt, entering)
    if not math.isfinite(_sum_of_guidance(s)):  # absurd inputs have overflowed: begin again
        for i in range(c.FLYING, c.Q_SETPOINT):
            s[i] = 0.0


@kernel
def control_step(nav: Array, sp: Array, p: Array, s: Array, actuators: Array) -> None:
    """Write the actuators (MAX_ACTUATORS,) from navigation state, setpoint, parameters and the state `s`."""
    level = sp[_SP_LEVEL]
    flown = level == sp_layout.FLY or level == sp_layout.RATES or level == sp_layout.SURFACES_DIRECT
    known = True
    for i in range(7):  # attitude and rates
        known = known and math.isfinite(nav[i])
    known = known and math.isfinite(nav[_NAV_ROLL] + nav[_NAV_PITCH] + nav[_NAV_YAW])
    direct = level == sp_layout.SURFACES_DIRECT
    if not flown or not (known or direct):
        _rest(nav, s, actuators)
        return

    s[c.COUNTER] += 1.0
    if known and (s[c.COUNTER] >= s[c.DIVISOR] or level != s[c.LAST_LEVEL]):
        s[c.COUNTER] = 0.0
        _guide(nav, sp, p, s, level)
    s[c.LAST_LEVEL] = level

    surfaces = actuators[0:3]  # in the kernels' order: aileron, elevator, rudder
    yaw_stick = _given(sp[_SP_YAW_STICK], -1.0, 1.0)
    steering = yaw_stick
    if direct:
        for i in range(3):
            surfaces[i] = _given(sp[_SP_SURFACES + i], -1.0, 1.0)
            s[c.RATE_INTEGRAL + i] = 0.0
            s[c.RATE_SETPOINT + i] = 0.0
        s[c.THROTTLE] = _given(sp[_SP_THROTTLE], 0.0, 1.0)
        steering = surfaces[2]
    else:
        if level == sp_layout.RATES:
            for i in range(3):
                s[c.RATE_SETPOINT + i] = _given(sp[_SP_RATES + i], -20.0, 20.0)
            s[c.THROTTLE] = _given(sp[_SP_THROTTLE], 0.0, 1.0)
        else:
            attitude_control(nav, p, s)
        rolling = math.isfinite(sp[_SP_STEERING])
        if rolling:
            steering = min(1.0, max(-1.0, wheel_control(nav, sp, p, s) + yaw_stick))
            yaw_stick = steering  # the rudder helps the wheels
        else:
            s[c.WHEEL_INTEGRAL] = 0.0
        rate_control(nav, p, s, surfaces, rolling)
        if rolling:
            ease_on_runway(p, s, surfaces)
        limit_surfaces(p, s, yaw_stick, surfaces)
    aileron, elevator, rudder = surfaces[0], surfaces[1], surfaces[2]
    actuators[AILERON] = aileron
    actuators[ELEVATOR] = elevator
    actuators[THROTTLE] = s[c.THROTTLE]
    actuators[RUDDER] = rudder
    actuators[FLAPS] = _given(sp[_SP_FLAPS], 0.0, 1.0)
    actuators[STEERING] = steering
    actuators[BRAKE] = _given(sp[_SP_BRAKE], 0.0, 1.0)
    quaternion_from_euler(
        s[c.ROLL_SETPOINT], s[c.PITCH_SETPOINT], nav[_NAV_YAW], s[c.Q_SETPOINT : c.Q_SETPOINT + 4]
    )
