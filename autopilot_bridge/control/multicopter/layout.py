"""Indices into the controller's two float64 arrays: parameters and state.

Compiled kernels freeze these numbers: when the layout changes, remove the compile caches of this package.
"""

from dataclasses import fields
from typing import Final

from autopilot_bridge.control.multicopter.parameters import MulticopterParameters

PARAMETER_NAMES: Final = tuple(field.name for field in fields(MulticopterParameters))


def _index(name: str) -> int:
    return PARAMETER_NAMES.index(name)


POS_XY_P: Final = _index("pos_xy_p_1_s")
POS_Z_P: Final = _index("pos_z_p_1_s")
VEL_XY_P: Final = _index("vel_xy_p_1_s")
VEL_XY_I: Final = _index("vel_xy_i_1_s2")
VEL_XY_D: Final = _index("vel_xy_d")
VEL_Z_P: Final = _index("vel_z_p_1_s")
VEL_Z_I: Final = _index("vel_z_i_1_s2")
VEL_Z_D: Final = _index("vel_z_d")
VEL_D_CUTOFF: Final = _index("vel_derivative_cutoff_hz")
SPEED_XY_MAX: Final = _index("speed_xy_max_m_s")
SPEED_UP_MAX: Final = _index("speed_up_max_m_s")
SPEED_DOWN_MAX: Final = _index("speed_down_max_m_s")
TILT_MAX: Final = _index("tilt_max_rad")
THRUST_MIN: Final = _index("thrust_min")
THRUST_MAX: Final = _index("thrust_max")
THRUST_XY_MARGIN: Final = _index("thrust_xy_margin")
USE_HOVER_ESTIMATE: Final = _index("use_hover_thrust_estimate")
DRAG_CUTOFF: Final = _index("drag_compensation_cutoff_hz")
ATTITUDE_P: Final = _index("roll_p_1_s")  # roll, pitch, yaw follow each other
YAW_WEIGHT: Final = _index("yaw_weight")
RATE_MAX: Final = _index("roll_rate_max_rad_s")  # roll, pitch, yaw
RATE_GAINS: Final = _index("rate_roll_p")  # per axis: p, i, d, ff, k, integral limit
RATE_GAINS_PER_AXIS: Final = 6
RATE_D_CUTOFF: Final = _index("rate_derivative_cutoff_hz")
YAW_TORQUE_CUTOFF: Final = _index("yaw_torque_cutoff_hz")
THRUST_MODEL: Final = _index("thrust_model_factor")
MOTOR_IDLE: Final = _index("motor_idle")
ROTOR_TIME_CONSTANT: Final = _index("rotor_time_constant_s")

DT: Final = 0  # physics step, s
DIVISOR: Final = 1  # physics steps per position-loop step
COUNTER: Final = 2  # physics steps since the position loop ran
LAST_LEVEL: Final = 3
AIRBORNE: Final = 4  # latched by motion after the motors started
START_DOWN_M: Final = 5  # nav down coordinate when the motors started
VEL_INTEGRAL: Final = 6  # NED, m/s^2
ACC_FILTERED: Final = 9  # NED, m/s^2
DRAG: Final = 12  # NED, m/s^2: measured acceleration across the thrust axis, low-passed
BUMP: Final = 15  # NED, m/s^2: decaying offset that makes level switches smooth
ACC_SETPOINT: Final = 18  # NED, m/s^2
VEL_SETPOINT: Final = 21  # NED, m/s
Q_SETPOINT: Final = 24  # q_ned_from_frd
RATE_SETPOINT: Final = 28  # FRD, rad/s
THRUST_SETPOINT: Final = 31  # collective, 0..1
YAW_RATE_FF: Final = 32  # about NED down, rad/s
RATE_INTEGRAL: Final = 33  # FRD, normalised torque
RATE_PREVIOUS: Final = 36  # FRD, rad/s
RATE_DERIVATIVE: Final = 39  # FRD, rad/s^2, low-passed
UNALLOCATED: Final = 42  # normalised torque the mixer could not give
YAW_TORQUE: Final = 45  # low-passed yaw torque
HOVER: Final = 46  # hover thrust estimate
HOVER_VARIANCE: Final = 47
THRUST_LAGGED: Final = 48  # collective as the rotors should give it by now
MOTOR_THRUST: Final = 49  # 4 normalised motor thrusts
THRUST_GIVEN: Final = 53  # mean of the motor thrusts after desaturation
GROUND_CONTACT: Final = 54  # 1.0 while something else than the rotors may carry the vehicle
STATE_SIZE: Final = 55
