"""One physics step of the fixed-wing control laws: guidance at 50 Hz, attitude and rates every step."""

import math

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.controller import RecordArray
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
from autopilot_bridge.control.fixed_wing.layout import FixedWingState
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.control.fixed_wing.setpoint import Setpoint
from autopilot_bridge.navigation.layout import NavigationState
from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.interface import AILERON, BRAKE, ELEVATOR, FLAPS, RUDDER, STEERING, THROTTLE

Array = NDArray[np.float64]


@kernel
def _given(value: float, low: float, high: float) -> float:
    """The value within limits; 0 for NaN."""
    return min(high, max(low, value)) if math.isfinite(value) else 0.0


@kernel
def _clear_guidance(s: FixedWingState) -> None:
    s.flying = 0.0
    s.eas = 0.0
    s.eas_rate = 0.0
    s.eas_to_tas = 0.0
    s.eas_known = 0.0
    s.heading_setpoint = 0.0
    s.course_setpoint = 0.0
    s.lateral_acceleration = 0.0
    s.roll_setpoint = 0.0
    s.roll_limited = 0.0
    s.height_reference = 0.0
    s.height_rate_reference = 0.0
    s.height_controlled = 0.0
    s.height_rate_setpoint = 0.0
    s.airspeed_setpoint = 0.0
    s.pitch_integral = 0.0
    s.throttle_integral = 0.0
    s.energy_rate = 0.0
    s.energy_rate_setpoint = 0.0
    s.balance_rate = 0.0
    s.balance_rate_setpoint = 0.0
    s.underspeed = 0.0
    s.pitch_setpoint = 0.0
    s.throttle = 0.0


@kernel
def _rest(nav: NavigationState, s: FixedWingState, actuators: Array) -> None:
    """Propeller stopped, surfaces neutral, every integrator and filter at its start."""
    for i in range(actuators.shape[0]):
        actuators[i] = 0.0
    _clear_guidance(s)
    s.last_level = 0.0
    s.rate_setpoint[:] = 0.0
    s.rate_integral[:] = 0.0
    s.rate_derivative[:] = 0.0
    s.unallocated[:] = 0.0
    s.wheel_integral = 0.0
    s.airspeed_floor = 0.0
    s.powerless = 0.0
    s.climb_flown = 0.0
    s.liftless_pitch = 0.0
    s.q_setpoint[:] = 0.0
    s.counter = s.divisor
    s.q_setpoint[0] = 1.0
    s.heading_setpoint = math.nan
    s.course_setpoint = math.nan
    for i in range(3):
        s.vel_setpoint[i] = math.nan
        rate = nav.rates_frd_rad_s[i]
        s.rate_previous[i] = rate if math.isfinite(rate) else 0.0


@kernel
def _sum_of_guidance(s: FixedWingState) -> float:
    """Finite as long as all is that guidance carries on from step to step."""
    return (
        s.eas
        + s.eas_rate
        + s.eas_to_tas
        + s.energy_rate
        + s.roll_setpoint
        + s.roll_limited
        + s.height_reference
        + s.height_rate_reference
        + s.airspeed_setpoint
        + s.pitch_integral
        + s.throttle_integral
        + s.energy_rate
        + s.energy_rate_setpoint
        + s.balance_rate
        + s.balance_rate_setpoint
        + s.underspeed
        + s.pitch_setpoint
        + s.throttle
    )


@kernel
def _guide(
    nav: NavigationState, sp: Setpoint, p: FixedWingParameters, s: FixedWingState, level: float
) -> None:
    """The 50 Hz part: airspeed filter, lateral guidance, energy control."""
    dt = s.dt * s.divisor
    update_air(nav, p, s, dt)
    if level != to.FLY:
        s.flying = 0.0
        s.vel_setpoint[2] = math.nan
        s.heading_setpoint = math.nan
        s.course_setpoint = math.nan
        s.height_controlled = 0.0
        s.underspeed = 0.0
        s.roll_setpoint = nav.euler_rad[0]
        s.pitch_setpoint = nav.euler_rad[1]
        s.throttle = _given(sp.throttle, 0.0, 1.0)
        return
    entering = s.flying == 0.0
    if entering:  # from the attitude flown so far, so that the switch isn't felt
        s.flying = 1.0
        s.roll_setpoint = nav.euler_rad[0]
        s.pitch_setpoint = min(PITCH_LIMIT_RAD, max(-PITCH_LIMIT_RAD, nav.euler_rad[1]))
    lateral_control(nav, sp, p, s, dt)
    energy_control(nav, sp, p, s, dt, entering)
    if not math.isfinite(_sum_of_guidance(s)):  # absurd inputs have overflowed: begin again
        _clear_guidance(s)


@kernel
def control_step(
    navs: RecordArray, setpoints: RecordArray, parameters: RecordArray, states: RecordArray, actuators: Array
) -> None:
    """Write the actuators (MAX_ACTUATORS,) from navigation state, setpoint, parameters and state (1,)."""
    nav: NavigationState = navs[0]
    sp: Setpoint = setpoints[0]
    p, s = parameters[0], states[0]
    level = sp.level
    flown = level == to.FLY or level == to.RATES or level == to.SURFACES_DIRECT
    known = True
    for i in range(4):
        known = known and math.isfinite(nav.q_ned_from_frd[i])
    for i in range(3):
        known = known and math.isfinite(nav.rates_frd_rad_s[i])
    known = known and math.isfinite(nav.euler_rad[0] + nav.euler_rad[1] + nav.euler_rad[2])
    direct = level == to.SURFACES_DIRECT
    if not flown or not (known or direct):
        _rest(nav, s, actuators)
        return

    s.counter += 1.0
    if known and (s.counter >= s.divisor or level != s.last_level):
        s.counter = 0.0
        _guide(nav, sp, p, s, level)
    s.last_level = level

    surfaces = actuators[0:3]  # in the kernels' order: aileron, elevator, rudder
    yaw_stick = _given(sp.yaw_stick, -1.0, 1.0)
    steering = yaw_stick
    if direct:
        for i in range(3):
            surfaces[i] = _given(sp.surfaces[i], -1.0, 1.0)
            s.rate_integral[i] = 0.0
            s.rate_setpoint[i] = 0.0
        s.throttle = _given(sp.throttle, 0.0, 1.0)
        steering = surfaces[2]
    else:
        if level == to.RATES:
            for i in range(3):
                s.rate_setpoint[i] = _given(sp.rates_frd_rad_s[i], -20.0, 20.0)
            s.throttle = _given(sp.throttle, 0.0, 1.0)
        else:
            attitude_control(nav, p, s)
        rolling = math.isfinite(sp.steering_heading_rad)
        if rolling:
            steering = min(1.0, max(-1.0, wheel_control(nav, sp, p, s) + yaw_stick))
            yaw_stick = steering  # the rudder helps the wheels
        else:
            s.wheel_integral = 0.0
        rate_control(nav, p, s, surfaces, rolling)
        if rolling:
            ease_on_runway(p, s, surfaces)
        limit_surfaces(p, s, yaw_stick, surfaces)
    aileron, elevator, rudder = surfaces[0], surfaces[1], surfaces[2]
    actuators[AILERON] = aileron
    actuators[ELEVATOR] = elevator
    actuators[THROTTLE] = s.throttle
    actuators[RUDDER] = rudder
    actuators[FLAPS] = _given(sp.flaps, 0.0, 1.0)
    actuators[STEERING] = steering
    actuators[BRAKE] = _given(sp.brake, 0.0, 1.0)
    quaternion_from_euler(s.roll_setpoint, s.pitch_setpoint, nav.euler_rad[2], s.q_setpoint)
