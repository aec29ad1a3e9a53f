"""The controller's state as a record, and indices into the float64 array of its parameters."""

from dataclasses import fields
from typing import Final

from autopilot_bridge.control.controller import ControllerState
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from flightsim.foundation.records import Vector3

PARAMETER_NAMES: Final = tuple(field.name for field in fields(FixedWingParameters))


def _index(name: str) -> int:
    return PARAMETER_NAMES.index(name)


AIRSPEED_STALL: Final = _index("airspeed_stall_m_s")
AIRSPEED_MIN: Final = _index("airspeed_min_m_s")
AIRSPEED_TRIM: Final = _index("airspeed_trim_m_s")
AIRSPEED_MAX: Final = _index("airspeed_max_m_s")
GROUND_SPEED_MIN: Final = _index("ground_speed_min_m_s")
HEADING_P: Final = _index("heading_p_1_s")
ROLL_LIMIT: Final = _index("roll_limit_rad")
ROLL_SLEW: Final = _index("roll_slew_rad_s")
LOAD_FACTOR_MAX: Final = _index("load_factor_max")
STALL_PREVENTION: Final = _index("stall_prevention")
STALL_MARGIN: Final = _index("stall_margin")
POWERED: Final = _index("powered")
TRIM_THROTTLE: Final = _index("trim_throttle")
TRIM_THROTTLE_MIN_SPEED: Final = _index("trim_throttle_min_speed")
TRIM_THROTTLE_MAX_SPEED: Final = _index("trim_throttle_max_speed")
THROTTLE_MIN: Final = _index("throttle_min")
THROTTLE_MAX: Final = _index("throttle_max")
THROTTLE_SLEW: Final = _index("throttle_slew_1_s")
PITCH_MIN: Final = _index("pitch_min_rad")
PITCH_MAX: Final = _index("pitch_max_rad")
TRIM_PITCH: Final = _index("trim_pitch_rad")
LIFT_ANGLE: Final = _index("lift_angle_rad")
CLIMB_MAX: Final = _index("climb_max_m_s")
SINK_MIN: Final = _index("sink_min_m_s")
SINK_MAX: Final = _index("sink_max_m_s")
CLIMB_TARGET: Final = _index("climb_rate_target_m_s")
SINK_TARGET: Final = _index("sink_rate_target_m_s")
HEIGHT_TC: Final = _index("height_time_constant_s")
AIRSPEED_TC: Final = _index("airspeed_time_constant_s")
HEIGHT_RATE_FF: Final = _index("height_rate_ff")
HEIGHT_ACCELERATION: Final = _index("height_acceleration_m_s2")
BALANCE_FF: Final = _index("energy_balance_ff")
PITCH_DAMPING: Final = _index("pitch_damping")
PITCH_I: Final = _index("pitch_integral_1_s")
THROTTLE_DAMPING: Final = _index("throttle_damping")
THROTTLE_I: Final = _index("throttle_integral_1_s")
SPEED_WEIGHT: Final = _index("speed_weight")
ENERGY_RATE_TC: Final = _index("energy_rate_time_constant_s")
VERTICAL_ACCELERATION: Final = _index("vertical_acceleration_max_m_s2")
TURN_ENERGY: Final = _index("turn_energy_rate_m2_s3")
AIRSPEED_NOISE: Final = _index("airspeed_noise_m_s")
AIRSPEED_RATE_NOISE: Final = _index("airspeed_rate_noise_m_s2")
AIRSPEED_PROCESS: Final = _index("airspeed_rate_process_noise_m_s2")
ROLL_TC: Final = _index("roll_time_constant_s")
PITCH_TC: Final = _index("pitch_time_constant_s")
ROLL_RATE_MAX: Final = _index("roll_rate_max_rad_s")
PITCH_RATE_UP: Final = _index("pitch_rate_max_up_rad_s")
PITCH_RATE_DOWN: Final = _index("pitch_rate_max_down_rad_s")
YAW_RATE_MAX: Final = _index("yaw_rate_max_rad_s")
SIDESLIP_GAIN: Final = _index("sideslip_gain_rad_s_per_m_s2")
AIRSPEED_SCALING: Final = _index("airspeed_scaling")
SCALING_AIRSPEED: Final = _index("scaling_airspeed_m_s")
RATE_GAINS: Final = _index("rate_roll_p")  # per axis: p, i, d, ff, integral limit
RATE_GAINS_PER_AXIS: Final = 5
RATE_D_CUTOFF: Final = _index("rate_derivative_cutoff_hz")
ROLL_TO_RUDDER: Final = _index("roll_to_rudder_ff")
TRIM_SURFACES: Final = _index("trim_aileron")  # aileron, elevator, rudder follow each other
WHEEL_TC: Final = _index("wheel_time_constant_s")
WHEEL_RATE_MAX: Final = _index("wheel_rate_max_rad_s")
WHEEL_P: Final = _index("wheel_p")
WHEEL_I: Final = _index("wheel_i")
WHEEL_INTEGRAL_MAX: Final = _index("wheel_integral_max")
WHEEL_FF: Final = _index("wheel_ff")


class FixedWingState(ControllerState):
    """The controller's state, of a flight from `counter` on: zero at levels OFF and IDLE."""

    # state, kept until the physics rate changes
    # state of a flight: zero at levels OFF and IDLE
    counter: float  # physics steps since guidance ran
    last_level: float
    flying: float  # 1.0 once guidance has run since the level became FLY
    # air
    eas: float  # filtered equivalent airspeed, m/s; trim airspeed when it isn't known
    eas_rate: float  # its rate, m/s^2
    eas_to_tas: float  # true over equivalent airspeed
    eas_known: float  # 1.0 while the airspeed is known
    # lateral
    heading_setpoint: float  # through the air, rad; NaN where none is flown
    course_setpoint: float
    lateral_acceleration: float  # wanted, m/s^2
    roll_setpoint: float
    roll_limited: float  # bank limit in force
    # longitudinal
    height_reference: float  # up, local, m
    height_rate_reference: float  # of the height trajectory, m/s
    height_controlled: float  # 1.0 while the reference is flown
    height_rate_setpoint: float  # wanted climb rate, m/s; NaN where none is flown
    airspeed_setpoint: float  # equivalent, limits applied, m/s
    pitch_integral: float  # rad
    throttle_integral: float
    energy_rate: float  # specific total energy rate, low-passed, m^2/s^3
    energy_rate_setpoint: float
    balance_rate: float  # specific energy balance rate
    balance_rate_setpoint: float
    underspeed: float  # 0 none .. 1 full
    pitch_setpoint: float
    throttle: float
    # attitude
    rate_integral: Vector3  # surface
    rate_previous: Vector3  # FRD, rad/s
    rate_derivative: Vector3  # FRD, rad/s^2, low-passed
    unallocated: Vector3  # surface command beyond the stops
    wheel_integral: float
    airspeed_floor: float  # equivalent airspeed that the least ground speed requires, m/s
    powerless: float  # 0 the throttle does its work .. 1 the energy falls at full throttle
    climb_flown: float  # 1.0 while pitch alone flies the vertical speed
    liftless_pitch: float  # pitch over the path without lift, rad, low-passed
