"""Gains and limits for an aircraft, derived from its flight envelope.

Rate loops: roll is a lag, p = K a / (tau s + 1): the feed-forward is 1/K, the proportional gain makes it some
times as quick as the roll angle shall be. Pitch and yaw are second order (short period, Dutch roll): the
proportional gain on the rate adds the damping that is missing. Attitude loops are as slow as the rate loops
inside them ask for, height and airspeed loops as slow as the attitude loops ask for. Energy rates come from
the envelope's climb and sink; the extra drag of a turn from the induced drag of a wing of that aspect ratio.
"""

import math
from typing import Final

from flightsim.flight_envelope import FlightEnvelope
from flightsim.foundation.atmosphere import GRAVITY_M_S2, SEA_LEVEL_DENSITY_KG_M3

_ROLL_BANDWIDTH: Final = 4.0  # of the roll rate, in bandwidths of the roll angle
_ROLL_RATE_RAD_S: Final = 2.6  # of a wing of 1 m; large aircraft roll with less haste
_HEADING_P_1_S: Final = 0.8885  # of PX4
_PITCH_DAMPING: Final = 0.8  # of the short period with the rate loop closed
_YAW_DAMPING: Final = 0.6  # of the Dutch roll
_SIDE_FORCE_SLOPE_PER_RAD: Final = 0.7  # usual size of the side-force slope, for the sideslip loop alone
_SIDESLIP_BANDWIDTH_RAD_S: Final = 0.8
_OSWALD_FACTOR: Final = 0.85
_LOAD_FACTOR_MAX: Final = 2.5


def gains_for(envelope: FlightEnvelope) -> dict[str, float | bool]:
    """Fields of `FixedWingParameters` for an aircraft.

    Raises:
        ValueError: a control has no effect, or the wrong sign.
    """
    for name in (
        "roll_rate_per_aileron_rad_s",
        "roll_time_constant_s",
        "pitch_acceleration_per_elevator_rad_s2",
        "pitch_rate_per_elevator_rad_s",
        "short_period_frequency_rad_s",
    ):
        if not getattr(envelope, name) > 0.0:
            raise ValueError(
                f"{envelope.name}: {name} = {getattr(envelope, name)}; a control law needs more than zero"
            )
    values: dict[str, float | bool] = {
        "airspeed_stall_m_s": envelope.stall_speed_m_s,
        "airspeed_min_m_s": envelope.airspeed_min_m_s,
        "airspeed_trim_m_s": envelope.airspeed_trim_m_s,
        "airspeed_max_m_s": envelope.airspeed_max_m_s,
        "scaling_airspeed_m_s": envelope.airspeed_trim_m_s,
        "roll_limit_rad": envelope.bank_max_rad,
        "load_factor_max": max(_LOAD_FACTOR_MAX, 1.0 / math.cos(envelope.bank_max_rad)),
        "pitch_min_rad": envelope.pitch_min_rad,
        "pitch_max_rad": envelope.pitch_max_rad,
        "trim_aileron": envelope.trim_aileron,
        "trim_elevator": envelope.trim_elevator,
        "trim_rudder": envelope.trim_rudder,
    }
    pitch_s = _rate_gains(envelope, values)
    _energy_gains(envelope, values, pitch_s)
    values["wheel_time_constant_s"] = 0.3
    values["wheel_p"] = 1.0
    values["wheel_i"] = 1.0
    values["wheel_ff"] = 0.4
    return values


def _rate_gains(envelope: FlightEnvelope, values: dict[str, float | bool]) -> float:
    """Write the gains of attitude and rates; the time constant of the pitch angle."""
    roll_gain = envelope.roll_rate_per_aileron_rad_s
    lag_s = min(0.6, envelope.roll_time_constant_s)
    roll_s = max(0.35, 2.0 * lag_s)
    values["roll_time_constant_s"] = roll_s
    values["rate_roll_ff"] = 1.0 / roll_gain
    values["rate_roll_p"] = max(0.2, lag_s * _ROLL_BANDWIDTH / roll_s - 1.0) / roll_gain
    values["rate_roll_i"] = 1.0 / roll_gain
    values["rate_roll_integral_max"] = 0.3
    roll_rate = min(_ROLL_RATE_RAD_S / math.sqrt(envelope.wing_span_m), 0.6 * roll_gain)
    values["roll_rate_max_rad_s"] = roll_rate
    values["roll_slew_rad_s"] = min(math.radians(90.0), roll_rate, 0.6 / roll_s)
    # the bank must be gone when the heading is reached: a slow roller begins to roll out earlier
    values["heading_p_1_s"] = min(_HEADING_P_1_S, 1.2 * roll_rate / envelope.bank_max_rad)

    pitch_gain = envelope.pitch_rate_per_elevator_rad_s
    natural = envelope.short_period_frequency_rad_s
    missing = max(2.0 * (_PITCH_DAMPING - envelope.short_period_damping) * natural, 0.9 * natural)
    values["rate_pitch_ff"] = 0.6 / pitch_gain
    values["rate_pitch_p"] = missing / envelope.pitch_acceleration_per_elevator_rad_s2
    values["rate_pitch_i"] = 0.6 / pitch_gain
    values["rate_pitch_integral_max"] = 0.5
    pitch_s = max(0.25, 2.5 / natural)
    values["pitch_time_constant_s"] = pitch_s
    pitch_rate = min(math.radians(60.0), 0.6 * pitch_gain)
    values["pitch_rate_max_up_rad_s"] = pitch_rate
    values["pitch_rate_max_down_rad_s"] = pitch_rate

    values["rate_yaw_ff"] = 0.0
    if not envelope.yaw_acceleration_per_rudder_rad_s2 > 0.0:  # no rudder
        values["rate_yaw_p"] = values["rate_yaw_i"] = 0.0
        return pitch_s
    turn = envelope.dutch_roll_frequency_rad_s
    missing = max(2.0 * (_YAW_DAMPING - envelope.dutch_roll_damping) * turn, 0.5)
    yaw_p = missing / envelope.yaw_acceleration_per_rudder_rad_s2
    values["rate_yaw_p"] = yaw_p
    values["rate_yaw_i"] = 2.0 * yaw_p
    values["rate_yaw_integral_max"] = 0.4
    pressure_pa = 0.5 * SEA_LEVEL_DENSITY_KG_M3 * envelope.airspeed_trim_m_s**2
    side_m_s2_per_rad = pressure_pa * envelope.wing_area_m2 * _SIDE_FORCE_SLOPE_PER_RAD / envelope.mass_kg
    side_per_rudder_m_s2 = side_m_s2_per_rad * max(0.05, abs(envelope.sideslip_per_rudder_rad))
    values["sideslip_gain_rad_s_per_m_s2"] = _SIDESLIP_BANDWIDTH_RAD_S / (2.0 * yaw_p * side_per_rudder_m_s2)
    return pitch_s


def _energy_gains(envelope: FlightEnvelope, values: dict[str, float | bool], pitch_s: float) -> None:
    """Write the gains of height and airspeed; `pitch_s` is the time constant of the pitch angle."""
    climb_max = max(0.5, envelope.climb_max_m_s) if envelope.powered else 1.0
    sink_min = max(0.2, envelope.sink_min_m_s)
    sink_max = max(1.2 * sink_min, envelope.sink_max_m_s)
    values["powered"] = envelope.powered
    values["throttle_max"] = envelope.throttle_max if envelope.powered else 1.0
    values["trim_throttle"] = envelope.trim_throttle
    values["trim_throttle_min_speed"] = envelope.trim_throttle_min_speed
    values["trim_throttle_max_speed"] = envelope.trim_throttle_max_speed
    values["throttle_slew_1_s"] = 2.0
    values["climb_max_m_s"] = climb_max
    values["sink_min_m_s"] = sink_min
    values["sink_max_m_s"] = sink_max
    values["climb_rate_target_m_s"] = 0.6 * climb_max
    values["sink_rate_target_m_s"] = min(0.6 * sink_max, 0.8 * climb_max) if envelope.powered else sink_min

    pressure_pa = 0.5 * SEA_LEVEL_DENSITY_KG_M3 * envelope.airspeed_trim_m_s**2
    lift = envelope.mass_kg * GRAVITY_M_S2 / (pressure_pa * envelope.wing_area_m2)
    values["trim_pitch_rad"] = envelope.trim_pitch_rad
    values["lift_angle_rad"] = lift / envelope.lift_slope_per_rad

    values["height_time_constant_s"] = max(1.5, 6.0 * pitch_s)
    values["airspeed_time_constant_s"] = max(1.0, 4.0 * pitch_s)
    values["energy_rate_time_constant_s"] = max(0.2, 0.8 * pitch_s)
    values["height_rate_ff"] = 1.0
    values["height_acceleration_m_s2"] = min(1.5, 0.4 / pitch_s)
    values["pitch_damping"] = 0.6
    values["pitch_integral_1_s"] = 0.45 / values["height_time_constant_s"]
    values["throttle_damping"] = 0.9 / values["airspeed_time_constant_s"]
    values["throttle_integral_1_s"] = 0.24 / values["airspeed_time_constant_s"]
    # gusts change airspeed and height both: most of the airspeed is the throttle's
    values["speed_weight"] = 0.4 if envelope.powered else 2.0
    values["airspeed_rate_process_noise_m_s2"] = 0.7
    # induced drag grows with the square of the load factor, n^2 - 1 = 2.2 (n - 1) about n = 1.2
    aspect_ratio = envelope.wing_span_m**2 / envelope.wing_area_m2
    induced_m_s2 = GRAVITY_M_S2 * lift / (math.pi * _OSWALD_FACTOR * aspect_ratio)
    values["turn_energy_rate_m2_s3"] = 2.2 * induced_m_s2 * envelope.airspeed_trim_m_s
