"""Attitude and body rates of a fixed wing to surfaces; the wheels' heading on the ground.

Attitude: the error of each angle over a time constant is the wanted Euler rate, the turn rate of a
coordinated turn joins them, and their sum in body axes is what the rate loops fly (PX4
FixedwingAttitudeControl). Rates: PID and feed-forward; a surface's moment grows with the square of airspeed
and the steady rate it gives in proportion to it, so the PID scales with the inverse square, the feed-
forward with the inverse. The wanted yaw rate leans against lateral acceleration (ArduPilot's YAW2SRV_SLIP),
so that the rudder nulls it in steady flight.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing.lateral import ROLL_MAX_RAD, stall_speed
from autopilot_bridge.control.fixed_wing.layout import FixedWingState
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.control.fixed_wing.setpoint import Setpoint
from autopilot_bridge.navigation.layout import NavigationState
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import wrap_pi

Array = NDArray[np.float64]


_WHEEL_SPEED_SHARE: Final = 0.6  # of the lowest airspeed: below it wheel gains stay as they are (PX4)
_ROLLING_SPEED_SHARE: Final = 0.7  # of the stall speed: below it the surfaces give way in the take-off roll
_RATE_LIMIT_RAD_S: Final = 40.0  # no gyro reads more
_SLIP_MAX_M_S2: Final = 3.0  # lateral acceleration the rudder works against


@kernel
def attitude_control(nav: NavigationState, p: FixedWingParameters, s: FixedWingState) -> None:
    """Write RATE_SETPOINT (FRD) for ROLL_SETPOINT and PITCH_SETPOINT."""
    roll, pitch = nav.euler_rad[0], nav.euler_rad[1]
    roll_rate = wrap_pi(s.roll_setpoint - roll) / p.roll_time_constant_s
    pitch_rate = (s.pitch_setpoint - pitch) / p.pitch_time_constant_s
    airspeed = max(0.7 * p.airspeed_min_m_s, s.eas) * s.eas_to_tas
    bank = min(ROLL_MAX_RAD, max(-ROLL_MAX_RAD, roll))
    turn_rate = GRAVITY_M_S2 * math.tan(bank) * math.cos(pitch) / airspeed
    if s.ground_contact != 0.0:
        turn_rate = 0.0
    cos_roll, sin_roll = math.cos(roll), math.sin(roll)
    cos_pitch, sin_pitch = math.cos(pitch), math.sin(pitch)
    x = roll_rate - sin_pitch * turn_rate
    y = cos_roll * pitch_rate + cos_pitch * sin_roll * turn_rate
    z = -sin_roll * pitch_rate + cos_pitch * cos_roll * turn_rate
    slip = nav.specific_force_frd_m_s2[1]
    if s.ground_contact == 0.0 and math.isfinite(slip):
        z -= p.sideslip_gain_rad_s_per_m_s2 * min(_SLIP_MAX_M_S2, max(-_SLIP_MAX_M_S2, slip))
    s.rate_setpoint[0] = min(p.roll_rate_max_rad_s, max(-p.roll_rate_max_rad_s, x))
    s.rate_setpoint[1] = min(p.pitch_rate_max_up_rad_s, max(-p.pitch_rate_max_down_rad_s, y))
    s.rate_setpoint[2] = min(p.yaw_rate_max_rad_s, max(-p.yaw_rate_max_rad_s, z))


@kernel
def _rate_axis(
    axis: int,
    gains: tuple[float, float, float, float, float],
    rate: float,
    s: FixedWingState,
    scale: float,
    alpha: float,
    rolling: bool,
) -> float:
    """The surface of one axis without its trim; gains are p, i, d, feed-forward and the limit of the
    integral.
    """
    kp, ki, kd, ff, limit = gains
    rate = min(_RATE_LIMIT_RAD_S, max(-_RATE_LIMIT_RAD_S, rate))
    wanted = s.rate_setpoint[axis]
    error = wanted - rate
    raw = (rate - s.rate_previous[axis]) / s.dt
    s.rate_previous[axis] = rate
    s.rate_derivative[axis] += alpha * (raw - s.rate_derivative[axis])
    moment = kp * error + s.rate_integral[axis] - kd * s.rate_derivative[axis]
    missing = s.unallocated[axis]
    surface = scale * (scale * moment + ff * wanted)
    if s.ground_contact != 0.0:
        s.rate_integral[axis] = 0.0  # the wheels hold the vehicle: it would only store a kick
    elif not (rolling or (missing > 0.0 and error > 0.0) or (missing < 0.0 and error < 0.0)):
        s.rate_integral[axis] = min(limit, max(-limit, s.rate_integral[axis] + ki * error * s.dt))
    return surface


@kernel
def rate_control(
    nav: NavigationState, p: FixedWingParameters, s: FixedWingState, surfaces: Array, rolling: bool
) -> None:
    """surfaces (3,) = aileron, elevator, rudder that fly RATE_SETPOINT; `rolling`: on the runway, integrators
    wait."""
    dt = s.dt
    scale = 1.0
    if p.airspeed_scaling:
        airspeed = min(1.5 * p.airspeed_max_m_s, max(stall_speed(p), s.eas))
        scale = p.scaling_airspeed_m_s / airspeed
    alpha = dt / (dt + 1.0 / (2.0 * math.pi * p.rate_derivative_cutoff_hz))
    roll = (p.rate_roll_p, p.rate_roll_i, p.rate_roll_d, p.rate_roll_ff, p.rate_roll_integral_max)
    pitch = (p.rate_pitch_p, p.rate_pitch_i, p.rate_pitch_d, p.rate_pitch_ff, p.rate_pitch_integral_max)
    yaw = (p.rate_yaw_p, p.rate_yaw_i, p.rate_yaw_d, p.rate_yaw_ff, p.rate_yaw_integral_max)
    surfaces[0] = _rate_axis(0, roll, nav.rates_frd_rad_s[0], s, scale, alpha, rolling) + p.trim_aileron
    surfaces[1] = _rate_axis(1, pitch, nav.rates_frd_rad_s[1], s, scale, alpha, rolling) + p.trim_elevator
    surfaces[2] = _rate_axis(2, yaw, nav.rates_frd_rad_s[2], s, scale, alpha, rolling) + p.trim_rudder


@kernel
def ease_on_runway(p: FixedWingParameters, s: FixedWingState, surfaces: Array) -> None:
    """Aileron and elevator fade in with the airspeed of the take-off roll.

    Without airspeed they have no effect; in a wind from behind the wrong one, and turn the vehicle over.
    """
    share = min(1.0, s.eas / (_ROLLING_SPEED_SHARE * stall_speed(p)))
    surfaces[0] = share * min(1.0, max(-1.0, surfaces[0]))
    surfaces[1] = share * min(1.0, max(-1.0, surfaces[1]))


@kernel
def limit_surfaces(p: FixedWingParameters, s: FixedWingState, yaw_stick: float, surfaces: Array) -> None:
    """Add to the rudder what goes with the aileron and the stick; stop at the stops."""
    aileron = min(1.0, max(-1.0, surfaces[0]))
    surfaces[2] += p.roll_to_rudder_ff * aileron + yaw_stick
    for i in range(3):
        limited = min(1.0, max(-1.0, surfaces[i]))
        s.unallocated[i] = surfaces[i] - limited
        surfaces[i] = limited


@kernel
def wheel_control(nav: NavigationState, sp: Setpoint, p: FixedWingParameters, s: FixedWingState) -> float:
    """Steering -1..1 that holds the setpoint's heading on the ground; its yaw rate is the rudder's too."""
    error = wrap_pi(sp.steering_heading_rad - nav.euler_rad[2])
    limit = p.wheel_rate_max_rad_s
    wanted = min(limit, max(-limit, error / p.wheel_time_constant_s))
    s.rate_setpoint[2] = wanted
    speed = math.sqrt(nav.vel_ned_m_s[0] * nav.vel_ned_m_s[0] + nav.vel_ned_m_s[1] * nav.vel_ned_m_s[1])
    slow = _WHEEL_SPEED_SHARE * p.airspeed_min_m_s
    scale = slow / speed if speed > slow else 1.0  # false for NaN
    rate_error = wanted - nav.rates_frd_rad_s[2]
    command = scale * (p.wheel_ff * wanted + scale * (p.wheel_p * rate_error + s.wheel_integral))
    if speed > 1.0 and abs(command) < 1.0:
        limit = p.wheel_integral_max
        integral = s.wheel_integral + p.wheel_i * rate_error * s.dt
        s.wheel_integral = min(limit, max(-limit, integral))
    return min(1.0, max(-1.0, command))
