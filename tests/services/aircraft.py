"""A small aircraft's flight envelope: of the Aerosonde class, in round numbers."""

import math
from typing import Final

from flightsim.flight_envelope import FlightEnvelope

SMALL_AIRCRAFT: Final = FlightEnvelope(
    name="small aircraft",
    mass_kg=11.0,
    wing_span_m=2.9,
    wing_area_m2=0.55,
    chord_m=0.19,
    density_kg_m3=1.17,
    stall_speed_m_s=14.0,
    airspeed_min_m_s=17.6,
    airspeed_trim_m_s=25.0,
    airspeed_max_m_s=35.0,
    powered=True,
    trim_throttle=0.47,
    trim_throttle_min_speed=0.35,
    trim_throttle_max_speed=0.8,
    throttle_max=1.0,
    trim_pitch_rad=0.05,
    trim_angle_of_attack_rad=0.05,
    trim_elevator=-0.1,
    trim_aileron=0.0,
    trim_rudder=0.0,
    climb_max_m_s=5.5,
    sink_min_m_s=1.9,
    sink_max_m_s=5.0,
    glide_ratio=14.0,
    best_glide_speed_m_s=21.0,
    bank_max_rad=math.radians(45.0),
    pitch_min_rad=math.radians(-20.0),
    pitch_max_rad=math.radians(25.0),
    roll_rate_per_aileron_rad_s=3.0,
    roll_time_constant_s=0.06,
    pitch_acceleration_per_elevator_rad_s2=40.0,
    pitch_rate_per_elevator_rad_s=2.5,
    load_factor_per_elevator=4.0,
    short_period_frequency_rad_s=9.0,
    short_period_damping=0.6,
    yaw_acceleration_per_rudder_rad_s2=18.0,
    yaw_rate_per_rudder_rad_s=0.9,
    sideslip_per_rudder_rad=-0.2,
    dutch_roll_frequency_rad_s=5.0,
    dutch_roll_damping=0.1,
    spiral_time_constant_s=-20.0,
    thrust_per_throttle_n=60.0,
    lift_slope_per_rad=4.6,
    drag_n=8.5,
)
"""Figures of a size that belongs together; not those of a model in particular."""
