"""The Aerosonde's flight envelope, worked out by hand from the coefficients of its model.

Aerodynamics, mass and inertia: Beard and McLain, Small Unmanned Aircraft, appendix E; derivatives by the
formulas of their chapter 5 at 25 m/s. Throttles, climb and sink: flown with the model.
"""

import math

from flightsim.flight_envelope import FlightEnvelope

AEROSONDE = FlightEnvelope(
    name="aerosonde",
    mass_kg=11.0,
    wing_span_m=2.8956,
    wing_area_m2=0.55,
    chord_m=0.18994,
    density_kg_m3=1.2,
    stall_speed_m_s=13.5,
    airspeed_min_m_s=18.0,
    airspeed_trim_m_s=25.0,
    airspeed_max_m_s=33.0,
    powered=True,
    trim_throttle=0.795,
    trim_throttle_min_speed=0.596,
    trim_throttle_max_speed=1.0,
    throttle_max=1.0,
    trim_pitch_rad=0.0533,
    trim_angle_of_attack_rad=0.0533,
    trim_elevator=0.166,
    trim_aileron=0.0,
    trim_rudder=0.0,
    climb_max_m_s=5.3,
    sink_min_m_s=7.5,
    sink_max_m_s=9.0,
    glide_ratio=14.0,
    best_glide_speed_m_s=17.0,
    bank_max_rad=math.radians(45.0),
    pitch_min_rad=math.radians(-20.0),
    pitch_max_rad=math.radians(25.0),
    roll_rate_per_aileron_rad_s=3.03,
    roll_time_constant_s=0.0458,
    pitch_acceleration_per_elevator_rad_s2=27.4,
    pitch_rate_per_elevator_rad_s=0.99,
    load_factor_per_elevator=2.5,
    short_period_frequency_rad_s=10.9,
    short_period_damping=0.43,
    yaw_acceleration_per_rudder_rad_s2=10.5,
    yaw_rate_per_rudder_rad_s=0.5,
    sideslip_per_rudder_rad=-0.55,
    dutch_roll_frequency_rad_s=4.4,
    dutch_roll_damping=0.22,
    spiral_time_constant_s=100.0,
    thrust_per_throttle_n=40.0,
    lift_slope_per_rad=5.61,
    drag_n=12.0,
)
