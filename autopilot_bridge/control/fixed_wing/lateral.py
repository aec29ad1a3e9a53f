"""Lateral guidance of a fixed wing: course, heading or lateral acceleration to a bank angle within limits.

The structure of PX4 1.16: a course is mapped to a heading through the wind triangle
(CourseToAirspeedRefMapper), the error of the direction through the air gives a lateral acceleration
(AirspeedDirectionController), and that a bank angle. A course is flown by the air velocity, ground velocity
less estimated wind: an error of the wind estimate then bends both the wanted and the flown direction and
falls out of the course. A heading is flown by the nose.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing.layout import FixedWingState
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.control.fixed_wing.setpoint import Setpoint
from autopilot_bridge.navigation.layout import NavigationState
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import wrap_pi

Array = NDArray[np.float64]


ROLL_MAX_RAD: Final = math.radians(80.0)  # of a bank angle given past the guidance
_BANK_ALWAYS_RAD: Final = math.radians(15.0)  # left for turning however slow the vehicle is
_STALL_SHARE_UNKNOWN: Final = 0.8  # of the lowest airspeed, where the stall speed isn't given


@kernel
def stall_speed(p: FixedWingParameters) -> float:
    """Stall speed at 1 g, equivalent, m/s."""
    if p.airspeed_stall_m_s > 0.0:
        return p.airspeed_stall_m_s
    return _STALL_SHARE_UNKNOWN * p.airspeed_min_m_s


@kernel
def heading_for_course(course: float, airspeed: float, wind_n: float, wind_e: float) -> float:
    """Heading through the air, rad, that makes a course over ground in a wind.

    Where the wind lets no heading make the course, the one that comes nearest: flying against the wind so
    that the vehicle drifts as little as possible from the bearing (PX4 CourseToAirspeedRefMapper). Angles in
    rad, speeds in m/s, wind is the air's velocity.
    """
    cos_course, sin_course = math.cos(course), math.sin(course)
    cross = wind_e * cos_course - wind_n * sin_course  # to the right of the course
    along = wind_n * cos_course + wind_e * sin_course
    wind = math.sqrt(wind_n * wind_n + wind_e * wind_e)
    if abs(cross) < airspeed and (along > 0.0 or wind < airspeed):
        return wrap_pi(course - math.asin(cross / airspeed))
    reach = math.sqrt(max(0.0, wind * wind - airspeed * airspeed))
    return math.atan2(reach * sin_course - wind_e, reach * cos_course - wind_n)


@kernel
def airspeed_for_ground_speed(course: float, ground_speed: float, wind_n: float, wind_e: float) -> float:
    """True airspeed, m/s, that gives a ground speed along a course in a wind."""
    cos_course, sin_course = math.cos(course), math.sin(course)
    cross = wind_e * cos_course - wind_n * sin_course
    missing = ground_speed - (wind_n * cos_course + wind_e * sin_course)
    if missing <= 0.0:
        return 0.0
    return math.sqrt(cross * cross + missing * missing)


@kernel
def bank_limit(sp: Setpoint, p: FixedWingParameters, s: FixedWingState) -> float:
    """Largest bank angle, rad: of parameters, setpoint, load factor, and stall at the present airspeed."""
    limit = min(p.roll_limit_rad, math.acos(1.0 / p.load_factor_max))
    if sp.roll_limit_rad >= 0.0:  # false for NaN
        limit = min(limit, sp.roll_limit_rad)
    if p.stall_prevention and s.eas_known != 0.0:
        ratio = s.eas / (p.stall_margin * stall_speed(p))
        by_stall = math.acos(1.0 / (ratio * ratio)) if ratio > 1.0 else 0.0
        limit = min(limit, max(by_stall, _BANK_ALWAYS_RAD))
    return limit


@kernel
def lateral_control(
    nav: NavigationState, sp: Setpoint, p: FixedWingParameters, s: FixedWingState, dt: float
) -> None:
    """One guidance step: writes ROLL_SETPOINT and what led to it."""
    true_airspeed = s.eas * s.eas_to_tas
    limit = bank_limit(sp, p, s)
    s.roll_limited = limit
    s.heading_setpoint = math.nan
    s.course_setpoint = math.nan
    s.airspeed_floor = 0.0
    if math.isfinite(sp.roll_rad):
        roll = min(ROLL_MAX_RAD, max(-ROLL_MAX_RAD, sp.roll_rad))
        s.roll_setpoint = roll
        s.lateral_acceleration = GRAVITY_M_S2 * math.tan(roll)
        return
    acceleration = sp.lateral_acceleration_m_s2 if math.isfinite(sp.lateral_acceleration_m_s2) else 0.0
    present, wanted = math.nan, math.nan
    yaw = nav.euler_rad[2]
    if math.isfinite(sp.course_rad):
        wind_n, wind_e = nav.wind_ned_m_s[0], nav.wind_ned_m_s[1]
        if not math.isfinite(wind_n + wind_e):
            wind_n, wind_e = 0.0, 0.0
        air_n, air_e = nav.vel_ned_m_s[0] - wind_n, nav.vel_ned_m_s[1] - wind_e
        if not math.isfinite(air_n + air_e):
            air_n, air_e = true_airspeed * math.cos(yaw), true_airspeed * math.sin(yaw)
        airspeed = max(1.0, math.sqrt(air_n * air_n + air_e * air_e))
        present = math.atan2(air_e, air_n)
        wanted = heading_for_course(sp.course_rad, airspeed, wind_n, wind_e)
        s.course_setpoint = wrap_pi(sp.course_rad)
        s.airspeed_floor = (
            airspeed_for_ground_speed(sp.course_rad, p.ground_speed_min_m_s, wind_n, wind_e) / s.eas_to_tas
        )
    elif math.isfinite(sp.heading_rad):
        present = yaw
        wanted = wrap_pi(sp.heading_rad)
    if math.isfinite(wanted):
        error = wrap_pi(wanted - present)
        # beyond a right angle: turn at full strength, whichever way is shorter
        turn = math.sin(error) if abs(error) < 0.5 * math.pi else math.copysign(1.0, error)
        acceleration += p.heading_p_1_s * true_airspeed * turn
        s.heading_setpoint = wanted
    s.lateral_acceleration = acceleration
    roll = min(limit, max(-limit, math.atan(acceleration / GRAVITY_M_S2)))
    step = p.roll_slew_rad_s * dt
    s.roll_setpoint += min(step, max(-step, roll - s.roll_setpoint))
