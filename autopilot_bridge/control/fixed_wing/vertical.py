"""Vertical speed by pitch alone, throttle given: short final and flare, where the energy control is too slow.

The lift that a vertical acceleration requires at the airspeed of this moment is flown by angle of attack, so
that a gust along the flight path is answered before it has changed the sink. What lift there is, the
accelerometers show: angle of attack that the pitch over the path has and the lift has not, or the other way
round, is a gust from below or above (or a wing that differs from its model), and the pitch makes up for it.
Incremental inversion does the same with differences (Sieberling, Chu and Mulder 2010). Airspeed is no concern
of the pitch here; the task's throttle sees to it.

Height trajectory of a fixed wing: what the energy control follows instead of height steps.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing.lateral import stall_speed
from autopilot_bridge.control.fixed_wing.layout import FixedWingState
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.navigation.layout import NavigationState
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

_GAIN: Final = 1.5  # error of the vertical speed to vertical acceleration, times the pitch's time constant
_HASTE: Final = 1.0  # the error of the pitch is added so often: it follows in half of its time constant
_ACCELERATION_MAX: Final = 0.8  # of gravity
_GUST_LAG: Final = 0.8  # over the time constant of the pitch: gusts that pass sooner are left to pass
_GUST_MAX_RAD: Final = 0.2
_STEEPEST_RAD: Final = math.radians(15.0)


@kernel
def _angle_of_attack(airspeed: float, load_factor: float, p: FixedWingParameters) -> float:
    """Pitch over the flight path that gives a load factor at an airspeed; short of the stall."""
    lift, trim = p.lift_angle_rad, p.airspeed_trim_m_s
    most = trim / stall_speed(p)
    ratio = trim / max(airspeed, 1.0)
    return p.trim_pitch_rad - lift + lift * min(most * most, load_factor * ratio * ratio)


@kernel
def pitch_for_climb(
    nav: NavigationState,
    p: FixedWingParameters,
    s: FixedWingState,
    dt: float,
    climb: float,
    lowest: float,
    highest: float,
) -> float:
    """Pitch setpoint, rad, that flies a climb rate within limits of the pitch."""
    airspeed = nav.airspeed_m_s if math.isfinite(nav.airspeed_m_s) else s.eas
    airspeed = max(airspeed, stall_speed(p))
    speed = max(s.eas, stall_speed(p)) * s.eas_to_tas
    actual = -nav.vel_ned_m_s[2] if math.isfinite(nav.vel_ned_m_s[2]) else 0.0
    missing = climb - actual
    share = min(
        _ACCELERATION_MAX, max(-_ACCELERATION_MAX, _GAIN / p.pitch_time_constant_s * missing / GRAVITY_M_S2)
    )
    load_factor = (1.0 + share) / max(0.5, math.cos(s.roll_setpoint))
    path = min(_STEEPEST_RAD, max(-_STEEPEST_RAD, actual / speed))
    pitch = _angle_of_attack(airspeed, load_factor, p) + path
    if s.climb_flown == 0.0:  # from the pitch flown so far
        s.climb_flown = 1.0
        s.liftless_pitch = s.pitch_setpoint - pitch
    felt = -nav.specific_force_frd_m_s2[2] / GRAVITY_M_S2
    if math.isfinite(felt):
        liftless = nav.euler_rad[1] - path - _angle_of_attack(airspeed, felt, p)
        lag_s = _GUST_LAG * p.pitch_time_constant_s
        s.liftless_pitch += dt / (dt + lag_s) * (liftless - s.liftless_pitch)
    s.liftless_pitch = min(_GUST_MAX_RAD, max(-_GUST_MAX_RAD, s.liftless_pitch))
    wanted = pitch + s.liftless_pitch
    wanted += _HASTE * (wanted - nav.euler_rad[1])
    return min(highest, max(lowest, wanted))


_CLOSING_1_S: Final = 0.8  # the last metres are closed in proportion to what is left
_LEASH: Final = 1.2  # the reference runs no further ahead than what would ask for the greatest climb


@kernel
def reset_height(height: float, climb: float, s: FixedWingState) -> None:
    """Start the trajectory from the present height and climb rate, both up."""
    s.height_reference = height if math.isfinite(height) else 0.0
    s.height_rate_reference = climb if math.isfinite(climb) else 0.0
    s.height_controlled = 0.0


@kernel
def follow_height(
    wanted: float, slope: float, height: float, p: FixedWingParameters, s: FixedWingState, dt: float
) -> None:
    """Move the reference towards `wanted`, which itself climbs with `slope`, within the rates for steps.

    Heights up, m; rates m/s. The reference's rate, HEIGHT_RATE_REFERENCE, is that over the slope.
    """
    acceleration = p.height_acceleration_m_s2
    left = wanted - s.height_reference
    size = abs(left)
    linear = acceleration / (_CLOSING_1_S * _CLOSING_1_S)
    speed = size * _CLOSING_1_S if size <= linear else math.sqrt(acceleration * (2.0 * size - linear))
    rate = math.copysign(speed, left)
    rate = min(
        min(p.climb_rate_target_m_s, p.climb_max_m_s), max(-min(p.sink_rate_target_m_s, p.sink_max_m_s), rate)
    )
    change = acceleration * dt
    s.height_rate_reference += min(change, max(-change, rate - s.height_rate_reference))
    reference = s.height_reference + (s.height_rate_reference + slope) * dt
    # where the vehicle can't follow (a glider, a stopped motor), the reference waits for it
    ahead = _LEASH * p.climb_max_m_s * p.height_time_constant_s
    behind = _LEASH * p.sink_max_m_s * p.height_time_constant_s
    s.height_reference = min(height + ahead, max(height - behind, reference))
    s.height_controlled = 1.0
