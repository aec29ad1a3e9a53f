"""The figures of a flight envelope; `flightsim.flight_envelope` works them out."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightEnvelope:
    """Performance and control response of a fixed-wing aircraft.

    Speeds are equivalent airspeeds (sea level density), rates of climb and sink are at home's altitude with
    the atmosphere's density there. Actuator levels are those of `flightsim.interface`: surfaces -1..1,
    positive rolls right, pitches the nose up, turns the nose right; throttle 0..1. Control response is that
    of level flight at the trim airspeed; a moment grows with the square of airspeed, a steady rate and the
    inverse of a time constant in proportion to it.

    Attributes:
        name: the vehicle.
        mass_kg, wing_span_m, wing_area_m2, chord_m: of the model.
        density_kg_m3: of the air for which all this holds.
        stall_speed_m_s: lowest speed of steady 1 g flight, power off.
        airspeed_min_m_s, airspeed_trim_m_s, airspeed_max_m_s: limits and cruise for the autopilot.
        powered: False for a glider; its throttle does nothing.
        trim_throttle: in level flight at the trim airspeed (0 for a glider).
        trim_throttle_min_speed, trim_throttle_max_speed: at the lowest and highest airspeed, limited to 1.
        throttle_max: highest useful throttle.
        trim_pitch_rad: pitch in level flight at the trim airspeed (for a glider: in its glide).
        trim_angle_of_attack_rad: angle of attack there.
        trim_elevator, trim_aileron, trim_rudder: surfaces there, -1..1.
        climb_max_m_s: rate of climb, full throttle, at the trim airspeed (negative for a glider).
        sink_min_m_s: rate of sink, idle, at the trim airspeed.
        sink_max_m_s: rate of sink, idle, at the highest airspeed.
        glide_ratio: best distance over height with the throttle closed, no slower than the lowest airspeed.
        best_glide_speed_m_s: equivalent airspeed of it.
        bank_max_rad, pitch_min_rad, pitch_max_rad: limits for the autopilot.
        roll_rate_per_aileron_rad_s: steady roll rate of full aileron.
        roll_time_constant_s: of the roll rate.
        pitch_acceleration_per_elevator_rad_s2: at once, of full elevator.
        pitch_rate_per_elevator_rad_s: steady (short period) pitch rate of full elevator.
        load_factor_per_elevator: steady increase of the load factor (g) of full elevator.
        short_period_frequency_rad_s, short_period_damping: of the pair of roots (geometric mean and mean
            over it when they are real).
        yaw_acceleration_per_rudder_rad_s2: at once, of full rudder.
        yaw_rate_per_rudder_rad_s: steady yaw rate of full rudder, wings held level.
        sideslip_per_rudder_rad: steady sideslip of full rudder, wings held level (negative: right rudder
            makes wind from the left).
        dutch_roll_frequency_rad_s, dutch_roll_damping: of that pair of roots.
        spiral_time_constant_s: positive decays, negative grows.
        thrust_per_throttle_n: slope of thrust at the trim throttle.
        lift_slope_per_rad: d(lift coefficient) / d(angle of attack).
        drag_n: with the throttle closed (idling propeller included), at the trim airspeed.
        standing_height_m: of the centre of gravity over the ground, on its wheels (or belly).
    """

    name: str
    mass_kg: float
    wing_span_m: float
    wing_area_m2: float
    chord_m: float
    density_kg_m3: float
    stall_speed_m_s: float
    airspeed_min_m_s: float
    airspeed_trim_m_s: float
    airspeed_max_m_s: float
    powered: bool
    trim_throttle: float
    trim_throttle_min_speed: float
    trim_throttle_max_speed: float
    throttle_max: float
    trim_pitch_rad: float
    trim_angle_of_attack_rad: float
    trim_elevator: float
    trim_aileron: float
    trim_rudder: float
    climb_max_m_s: float
    sink_min_m_s: float
    sink_max_m_s: float
    glide_ratio: float
    best_glide_speed_m_s: float
    bank_max_rad: float
    pitch_min_rad: float
    pitch_max_rad: float
    roll_rate_per_aileron_rad_s: float
    roll_time_constant_s: float
    pitch_acceleration_per_elevator_rad_s2: float
    pitch_rate_per_elevator_rad_s: float
    load_factor_per_elevator: float
    short_period_frequency_rad_s: float
    short_period_damping: float
    yaw_acceleration_per_rudder_rad_s2: float
    yaw_rate_per_rudder_rad_s: float
    sideslip_per_rudder_rad: float
    dutch_roll_frequency_rad_s: float
    dutch_roll_damping: float
    spiral_time_constant_s: float
    thrust_per_throttle_n: float
    lift_slope_per_rad: float
    drag_n: float
    standing_height_m: float = 0.3
