"""Indices into the controller's two float64 arrays: parameters and state."""

from dataclasses import fields
from typing import Final

from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from flightsim.foundation.layouts import Slots

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

_at = Slots()
# state, kept until the physics rate changes
DT: Final = _at.place()  # physics step, s
DIVISOR: Final = _at.place()  # physics steps per guidance step
GROUND_CONTACT: Final = _at.place()  # 1.0 while the wheels or the launcher may carry the vehicle
# state of a flight: zero at levels OFF and IDLE
COUNTER: Final = _at.place()  # physics steps since guidance ran
LAST_LEVEL: Final = _at.place()
FLYING: Final = _at.place()  # 1.0 once guidance has run since the level became FLY
# air
EAS: Final = _at.place()  # filtered equivalent airspeed, m/s; trim airspeed when it isn't known
EAS_RATE: Final = _at.place()  # its rate, m/s^2
EAS_TO_TAS: Final = _at.place()  # true over equivalent airspeed
EAS_KNOWN: Final = _at.place()  # 1.0 while the airspeed is known
# lateral
HEADING_SETPOINT: Final = _at.place()  # through the air, rad; NaN where none is flown
COURSE_SETPOINT: Final = _at.place()
LATERAL_ACCELERATION: Final = _at.place()  # wanted, m/s^2
ROLL_SETPOINT: Final = _at.place()
ROLL_LIMITED: Final = _at.place()  # bank limit in force
# longitudinal
HEIGHT_REFERENCE: Final = _at.place()  # up, local, m
HEIGHT_RATE_REFERENCE: Final = _at.place()  # of the height trajectory, m/s
HEIGHT_CONTROLLED: Final = _at.place()  # 1.0 while the reference is flown
HEIGHT_RATE_SETPOINT: Final = _at.place()  # wanted climb rate, m/s; NaN where none is flown
AIRSPEED_SETPOINT: Final = _at.place()  # equivalent, limits applied, m/s
PITCH_INTEGRAL: Final = _at.place()  # rad
THROTTLE_INTEGRAL: Final = _at.place()
ENERGY_RATE: Final = _at.place()  # specific total energy rate, low-passed, m^2/s^3
ENERGY_RATE_SETPOINT: Final = _at.place()
BALANCE_RATE: Final = _at.place()  # specific energy balance rate
BALANCE_RATE_SETPOINT: Final = _at.place()
UNDERSPEED: Final = _at.place()  # 0 none .. 1 full
PITCH_SETPOINT: Final = _at.place()
THROTTLE: Final = _at.place()
# attitude
Q_SETPOINT: Final = _at.place(4)  # q_ned_from_frd
RATE_SETPOINT: Final = _at.place(3)  # FRD, rad/s
RATE_INTEGRAL: Final = _at.place(3)  # surface
RATE_PREVIOUS: Final = _at.place(3)  # FRD, rad/s
RATE_DERIVATIVE: Final = _at.place(3)  # FRD, rad/s^2, low-passed
UNALLOCATED: Final = _at.place(3)  # surface command beyond the stops
WHEEL_INTEGRAL: Final = _at.place()
VEL_SETPOINT: Final = _at.place(3)  # NED, m/s; only the vertical one is flown
AIRSPEED_FLOOR: Final = _at.place()  # equivalent airspeed that the least ground speed requires, m/s
POWERLESS: Final = _at.place()  # 0 the throttle does its work .. 1 the energy falls at full throttle
CLIMB_FLOWN: Final = _at.place()  # 1.0 while pitch alone flies the vertical speed
LIFTLESS_PITCH: Final = _at.place()  # pitch over the path without lift, rad, low-passed
STATE_SIZE: Final = _at.size
