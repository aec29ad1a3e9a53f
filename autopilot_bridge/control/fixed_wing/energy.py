"""Total-energy control of height and airspeed (TECS) to pitch and throttle.

Throttle adds energy, pitch shares it out: the throttle flies the rate of the specific total energy, the
pitch the rate of its balance, potential less kinetic (Lambregts, "Vertical flight path and speed control
autopilot design using total energy principles", AIAA 83-2239). Structure, gains and limits are those of
PX4's TECS; what is added: the angle of attack that an airspeed and a bank ask for is fed forward, and the
underspeed band lies between stall and lowest airspeed.

Energies are per mass: m^2/s^2, their rates m^2/s^3.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing.air import acceleration_along_flow
from autopilot_bridge.control.fixed_wing.lateral import stall_speed
from autopilot_bridge.control.fixed_wing.layout import FixedWingState
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.control.fixed_wing.setpoint import Setpoint
from autopilot_bridge.control.fixed_wing.vertical import follow_height, pitch_for_climb, reset_height
from autopilot_bridge.navigation.layout import NavigationState
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]


PITCH_LIMIT_RAD: Final = math.radians(80.0)  # of a pitch angle given past the energy control
_MIN_SPEED_M_S: Final = 3.0  # for divisions
_UNDERSPEED_START: Final = 0.9  # share of the way from stall to lowest airspeed
_UNDERSPEED_FULL: Final = 0.4
_POWERLESS_S: Final = 3.0  # so long full throttle may fail to keep the energy up
_POWERLESS_DOUBT: Final = 0.4  # of that time: a gust downwards passes
_GLIDE_SHARE: Final = 1.1  # of the lowest airspeed at this bank
_FULL_THROTTLE: Final = 0.95  # of its limit
_PITCH_ONLY_ACCELERATION_M_S2: Final = 1.5  # speed change commanded when pitch alone flies the airspeed


@kernel
def _clip(value: float, low: float, high: float) -> float:
    return min(high, max(low, value))


@kernel
def _load_factor(s: FixedWingState) -> float:
    """Load factor of a level turn at the commanded bank."""
    return 1.0 / max(0.2, math.cos(s.roll_setpoint))


@kernel
def _underspeed(p: FixedWingParameters, s: FixedWingState, load_factor: float) -> float:
    """How much too slow the vehicle is: 0 not at all, 1 near the stall."""
    if s.eas_known == 0.0:
        return 0.0
    raised = math.sqrt(load_factor)
    stall = stall_speed(p)
    room = p.airspeed_min_m_s - stall
    full = raised * (stall + _UNDERSPEED_FULL * room)
    start = raised * (stall + _UNDERSPEED_START * room)
    return _clip((start - s.eas) / max(1e-3, start - full), 0.0, 1.0)


@kernel
def _update_powerless(
    p: FixedWingParameters, s: FixedWingState, dt: float, flown: bool, energy_rate: float
) -> float:
    """How sure it is that full throttle doesn't keep the energy up: a failed motor, or air that sinks.

    Height can't be held then, and the airspeed must be (PX4's uncommanded descent, ArduPilot's bad descent).
    `flown`: throttle and pitch are the energy control's; `energy_rate`: m^2/s^3, of height and inertial
    acceleration. A gust that takes airspeed isn't in it: that gives it back, and to give up height and
    airspeed for it would cost much more.
    """
    full = s.throttle >= _FULL_THROTTLE * p.throttle_max
    falling = energy_rate < 0.0 and s.energy_rate_setpoint > energy_rate
    step = dt / _POWERLESS_S if flown and full and falling else -dt / _POWERLESS_S
    s.powerless = _clip(s.powerless + step, 0.0, 1.0)
    return max(0.0, (s.powerless - _POWERLESS_DOUBT) / (1.0 - _POWERLESS_DOUBT))


@kernel
def _trim_throttle(airspeed: float, p: FixedWingParameters) -> float:
    """Throttle of level flight at an airspeed, between the three that are known."""
    trim, at = p.trim_throttle, p.airspeed_trim_m_s
    if airspeed < at:
        end, end_at = p.trim_throttle_min_speed, p.airspeed_min_m_s
    else:
        end, end_at = p.trim_throttle_max_speed, p.airspeed_max_m_s
    if end <= 0.0 or abs(end_at - at) < 1e-3:
        return trim
    return trim + (end - trim) * (airspeed - at) / (end_at - at)


@kernel
def _trim_pitch(airspeed: float, p: FixedWingParameters, s: FixedWingState) -> float:
    """Pitch of level flight at an airspeed and the commanded bank.

    The lift angle grows with the load factor and falls with the square of airspeed; in a level turn
    tan(pitch) = cos(bank) tan(angle of attack).
    """
    lift = p.lift_angle_rad
    if lift == 0.0:
        return p.trim_pitch_rad
    ratio = p.airspeed_trim_m_s / max(_MIN_SPEED_M_S, airspeed)
    return (p.trim_pitch_rad - lift) / _load_factor(s) + lift * min(4.0, ratio * ratio)


@kernel
def _wanted_climb(
    nav: NavigationState, sp: Setpoint, p: FixedWingParameters, s: FixedWingState, dt: float, hold: bool
) -> float:
    """Climb rate to fly, m/s; NaN: no climb rate is commanded. `hold`: the present height by default."""
    height, climb = -nav.pos_ned_m[2], -nav.vel_ned_m_s[2]
    wanted, rate = -sp.down_m, sp.height_rate_m_s
    if math.isfinite(wanted) or not (math.isfinite(rate) or not hold):
        if not math.isfinite(height):
            return 0.0 if not math.isfinite(rate) else rate
        if s.height_controlled == 0.0:
            reset_height(height, climb, s)
        slope = rate if math.isfinite(rate) else 0.0
        if not math.isfinite(wanted):
            wanted = s.height_reference
        elif s.height_controlled == 0.0:
            s.height_rate_reference -= slope
        follow_height(wanted, slope, height, p, s, dt)
        return _clip(
            (s.height_reference - height) / p.height_time_constant_s
            + p.height_rate_ff * s.height_rate_reference
            + slope,
            -p.sink_max_m_s,
            p.climb_max_m_s,
        )
    reset_height(height, climb, s)
    return rate


@kernel
def _fly_pitch(
    sp: Setpoint, p: FixedWingParameters, s: FixedWingState, dt: float, speed: float, under: float
) -> None:
    """PITCH_SETPOINT that flies the rate of the energy balance; `speed` is the true airspeed."""
    lowest = sp.pitch_min_rad if math.isfinite(sp.pitch_min_rad) else p.pitch_min_rad
    highest = sp.pitch_max_rad if math.isfinite(sp.pitch_max_rad) else p.pitch_max_rad
    # a climb-out's least pitch gives way before the wing stalls
    lowest = (1.0 - under) * lowest + under * min(lowest, p.pitch_min_rad)
    highest = max(highest, lowest)
    per_rad = speed * GRAVITY_M_S2
    wanted = s.balance_rate_setpoint / per_rad
    missing = wanted - s.balance_rate / per_rad
    previous = s.pitch_setpoint
    step = p.pitch_integral_1_s * missing * dt
    winding = (previous >= highest and step > 0.0) or (previous <= lowest and step < 0.0)
    if s.ground_contact == 0.0 and not winding:
        s.pitch_integral = _clip(s.pitch_integral + step, lowest - highest, highest - lowest)
    pitch = (
        _trim_pitch(s.airspeed_setpoint, p, s)
        + p.pitch_damping * missing
        + p.energy_balance_ff * wanted
        + s.pitch_integral
    )
    change = dt * p.vertical_acceleration_max_m_s2 / speed
    s.pitch_setpoint = _clip(_clip(pitch, lowest, highest), previous - change, previous + change)


@kernel
def _fly_climb_by_pitch(
    nav: NavigationState, sp: Setpoint, p: FixedWingParameters, s: FixedWingState, dt: float, climb: float
) -> None:
    """PITCH_SETPOINT that flies a climb rate whatever becomes of the airspeed."""
    lowest = sp.pitch_min_rad if math.isfinite(sp.pitch_min_rad) else p.pitch_min_rad
    highest = sp.pitch_max_rad if math.isfinite(sp.pitch_max_rad) else p.pitch_max_rad
    s.pitch_setpoint = pitch_for_climb(nav, p, s, dt, climb, lowest, max(lowest, highest))


@kernel
def _fly_throttle(sp: Setpoint, p: FixedWingParameters, s: FixedWingState, dt: float, under: float) -> None:
    """THROTTLE that flies the rate of the total energy."""
    lowest, highest = p.throttle_min, p.throttle_max
    if math.isfinite(sp.throttle_max):
        highest = _clip(sp.throttle_max, 0.0, highest)
        lowest = min(lowest, highest)
    rate_max, rate_min = GRAVITY_M_S2 * p.climb_max_m_s, -GRAVITY_M_S2 * p.sink_min_m_s
    wanted = s.energy_rate_setpoint
    trim = _clip(_trim_throttle(s.airspeed_setpoint, p), lowest, highest)
    if wanted >= 0.0:
        throttle = trim + wanted / rate_max * (highest - trim)
    else:
        throttle = trim + wanted / rate_min * (lowest - trim)
    missing = (wanted - s.energy_rate) / (rate_max - rate_min)
    previous = s.throttle
    known = s.eas_known != 0.0
    if known and s.ground_contact == 0.0:
        step = p.throttle_integral_1_s * missing * dt * (1.0 - under)
        if not ((previous >= highest and step > 0.0) or (previous <= lowest and step < 0.0)):
            s.throttle_integral = _clip(s.throttle_integral + step, -1.0, 1.0)
    # without airspeed a positive integral stays: it was needed when there was one (PX4)
    integral = s.throttle_integral if known else max(0.0, s.throttle_integral)
    throttle += p.throttle_damping * missing + integral
    throttle = _clip(under * highest + (1.0 - under) * throttle, lowest, highest)
    if p.throttle_slew_1_s > 0.0:
        change = p.throttle_slew_1_s * dt
        throttle = _clip(throttle, previous - change, previous + change)
    s.throttle = _clip(throttle, lowest, highest)


@kernel
def _wanted_speed_rate(p: FixedWingParameters, s: FixedWingState, speed: float, weight: float) -> float:
    """Rate of change of the true airspeed to fly, m/s^2, within what half of the power can do."""
    if s.eas_known == 0.0:
        return 0.0
    faster = 0.5 * GRAVITY_M_S2 * p.climb_max_m_s / speed
    slower = -0.5 * GRAVITY_M_S2 * p.sink_min_m_s / speed
    if weight >= 2.0:
        faster, slower = _PITCH_ONLY_ACCELERATION_M_S2, -_PITCH_ONLY_ACCELERATION_M_S2
    return _clip((s.airspeed_setpoint * s.eas_to_tas - speed) / p.airspeed_time_constant_s, slower, faster)


@kernel
def energy_control(
    nav: NavigationState, sp: Setpoint, p: FixedWingParameters, s: FixedWingState, dt: float, entering: bool
) -> None:
    """One guidance step: writes PITCH_SETPOINT, THROTTLE and what led to them."""
    pitch_given, throttle_given = math.isfinite(sp.pitch_rad), math.isfinite(sp.throttle)
    powered, known = p.powered, s.eas_known != 0.0
    climb = -nav.vel_ned_m_s[2] if math.isfinite(nav.vel_ned_m_s[2]) else 0.0
    if entering or s.ground_contact != 0.0:
        reset_height(-nav.pos_ned_m[2], climb, s)
        s.pitch_integral = 0.0
        s.throttle_integral = 0.0
    load_factor = _load_factor(s)
    wanted_climb = _wanted_climb(nav, sp, p, s, dt, not pitch_given and not throttle_given)
    climb_given = math.isfinite(wanted_climb)
    flare = throttle_given and not pitch_given and climb_given and s.height_controlled == 0.0
    s.height_rate_setpoint = wanted_climb
    s.vel_setpoint[2] = -wanted_climb
    under = 0.0 if flare else _underspeed(p, s, load_factor)
    s.underspeed = under
    energy_flown = powered and known and climb_given and not (pitch_given or throttle_given)
    speed = max(_MIN_SPEED_M_S, s.eas * s.eas_to_tas)
    potential_rate = GRAVITY_M_S2 * climb
    kinetic_rate = speed * s.eas_rate * s.eas_to_tas
    acceleration = acceleration_along_flow(nav)
    inertial_rate = speed * acceleration if math.isfinite(acceleration) else kinetic_rate
    powerless = _update_powerless(p, s, dt, energy_flown, potential_rate + inertial_rate)

    airspeed_min = min(p.airspeed_max_m_s, p.airspeed_min_m_s * math.sqrt(load_factor))
    airspeed = sp.airspeed_m_s if math.isfinite(sp.airspeed_m_s) else p.airspeed_trim_m_s
    airspeed = max(airspeed, s.airspeed_floor)
    # a glide lasts longest, with room left over the stall, a little above the lowest airspeed
    airspeed -= powerless * max(0.0, airspeed - _GLIDE_SHARE * airspeed_min)
    airspeed = under * airspeed_min + (1.0 - under) * airspeed
    s.airspeed_setpoint = _clip(airspeed, airspeed_min, p.airspeed_max_m_s)

    weight = p.speed_weight if powered else 2.0
    if not known or flare:
        weight = 0.0
    elif throttle_given and not climb_given:
        weight = 2.0
    gives_way = max(under, powerless)
    weight = 2.0 * gives_way + (1.0 - gives_way) * weight

    wanted_potential_rate = GRAVITY_M_S2 * wanted_climb if climb_given else potential_rate
    if not powered and not known:  # its glide, by the attitude it should have
        wanted_potential_rate = -GRAVITY_M_S2 * p.sink_min_m_s
    wanted_kinetic_rate = speed * _wanted_speed_rate(p, s, speed, weight)

    height_share, speed_share = _clip(2.0 - weight, 0.0, 1.0), _clip(weight, 0.0, 1.0)
    s.balance_rate = height_share * potential_rate - speed_share * kinetic_rate
    s.balance_rate_setpoint = height_share * wanted_potential_rate - speed_share * wanted_kinetic_rate
    share = 1.0 if entering else min(1.0, dt / (dt + p.energy_rate_time_constant_s))
    s.energy_rate += share * (potential_rate + kinetic_rate - s.energy_rate)
    s.energy_rate_setpoint = _clip(
        wanted_potential_rate + wanted_kinetic_rate + p.turn_energy_rate_m2_s3 * (load_factor - 1.0),
        -GRAVITY_M_S2 * p.sink_min_m_s,
        GRAVITY_M_S2 * p.climb_max_m_s,
    )

    if pitch_given:
        s.pitch_setpoint = _clip(sp.pitch_rad, -PITCH_LIMIT_RAD, PITCH_LIMIT_RAD)
    elif flare and known and p.lift_angle_rad > 0.0:
        _fly_climb_by_pitch(nav, sp, p, s, dt, wanted_climb)
    else:
        if s.climb_flown != 0.0:
            s.climb_flown = 0.0
            s.pitch_integral = 0.0
        _fly_pitch(sp, p, s, dt, speed, under)
    if throttle_given:
        s.throttle = _clip(sp.throttle, 0.0, 1.0)
    elif powered:
        _fly_throttle(sp, p, s, dt, under)
    else:
        s.throttle = 0.0
