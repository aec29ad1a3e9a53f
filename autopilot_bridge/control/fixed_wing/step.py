"""One physics step of the fixed-wing control laws: guidance at 50 Hz, attitude and rates every step."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing import layout as c
from autopilot_bridge.control.fixed_wing import setpoint as to
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
from autopilot_bridge.navigation import layout as n
from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.interface import AILERON, BRAKE, ELEVATOR, FLAPS, RUDDER, STEERING, THROTTLE

Array = NDArray[np.float64]

_RATES: Final[int] = to.RATES_FRD_RAD_S.start
_SURFACES: Final[int] = to.SURFACES.start


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
        rate = nav[n.RATES + i]
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
    if level != to.FLY:
        s[c.FLYING] = 0.0
        s[c.VEL_SETPOINT + 2] = math.nan
        s[c.HEADING_SETPOINT] = math.nan
        s[c.COURSE_SETPOINT] = math.nan
        s[c.HEIGHT_CONTROLLED] = 0.0
        s[c.UNDERSPEED] = 0.0
        s[c.ROLL_SETPOINT] = nav[n.ROLL]
        s[c.PITCH_SETPOINT] = nav[n.PITCH]
        s[c.THROTTLE] = _given(sp[to.THROTTLE], 0.0, 1.0)
        return
    entering = s[c.FLYING] == 0.0
    if entering:  # from the attitude flown so far, so that the switch isn't felt
        s[c.FLYING] = 1.0
        s[c.ROLL_SETPOINT] = nav[n.ROLL]
        s[c.PITCH_SETPOINT] = min(PITCH_LIMIT_RAD, max(-PITCH_LIMIT_RAD, nav[n.PITCH]))
    lateral_control(nav, sp, p, s, dt)
    energy_control(nav, sp, p, s, dt, entering)
    if not math.isfinite(_sum_of_guidance(s)):  # absurd inputs have overflowed: begin again
        for i in range(c.FLYING, c.Q_SETPOINT):
            s[i] = 0.0


@kernel
def control_step(nav: Array, sp: Array, p: Array, s: Array, actuators: Array) -> None:
    """Write the actuators (MAX_ACTUATORS,) from navigation state, setpoint, parameters and the state `s`."""
    level = sp[to.LEVEL]
    flown = level == to.FLY or level == to.RATES or level == to.SURFACES_DIRECT
    known = True
    for i in range(4):
        known = known and math.isfinite(nav[n.Q + i])
    for i in range(3):
        known = known and math.isfinite(nav[n.RATES + i])
    known = known and math.isfinite(nav[n.ROLL] + nav[n.PITCH] + nav[n.YAW])
    direct = level == to.SURFACES_DIRECT
    if not flown or not (known or direct):
        _rest(nav, s, actuators)
        return

    s[c.COUNTER] += 1.0
    if known and (s[c.COUNTER] >= s[c.DIVISOR] or level != s[c.LAST_LEVEL]):
        s[c.COUNTER] = 0.0
        _guide(nav, sp, p, s, level)
    s[c.LAST_LEVEL] = level

    surfaces = actuators[0:3]  # in the kernels' order: aileron, elevator, rudder
    yaw_stick = _given(sp[to.YAW_STICK], -1.0, 1.0)
    steering = yaw_stick
    if direct:
        for i in range(3):
            surfaces[i] = _given(sp[_SURFACES + i], -1.0, 1.0)
            s[c.RATE_INTEGRAL + i] = 0.0
            s[c.RATE_SETPOINT + i] = 0.0
        s[c.THROTTLE] = _given(sp[to.THROTTLE], 0.0, 1.0)
        steering = surfaces[2]
    else:
        if level == to.RATES:
            for i in range(3):
                s[c.RATE_SETPOINT + i] = _given(sp[_RATES + i], -20.0, 20.0)
            s[c.THROTTLE] = _given(sp[to.THROTTLE], 0.0, 1.0)
        else:
            attitude_control(nav, p, s)
        rolling = math.isfinite(sp[to.STEERING_HEADING_RAD])
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
    actuators[FLAPS] = _given(sp[to.FLAPS], 0.0, 1.0)
    actuators[STEERING] = steering
    actuators[BRAKE] = _given(sp[to.BRAKE], 0.0, 1.0)
    quaternion_from_euler(
        s[c.ROLL_SETPOINT], s[c.PITCH_SETPOINT], nav[n.YAW], s[c.Q_SETPOINT : c.Q_SETPOINT + 4]
    )
