"""Indices into the controller's two float64 arrays: parameters and state.

Compiled kernels freeze these numbers: when the layout changes, remove the compile caches of this package.
"""

from dataclasses import fields
from typing import Final

from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from flightsim.foundation.layouts import Slots

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

_at = Slots()
DT: Final = _at.place()  # physics step, s
DIVISOR: Final = _at.place()  # physics steps per position-loop step
COUNTER: Final = _at.place()  # physics steps since the position loop ran
LAST_LEVEL: Final = _at.place()
AIRBORNE: Final = _at.place()  # latched by motion after the motors started
START_DOWN_M: Final = _at.place()  # nav down coordinate when the motors started
VEL_INTEGRAL: Final = _at.place(3)  # NED, m/s^2
ACC_FILTERED: Final = _at.place(3)  # NED, m/s^2
DRAG: Final = _at.place(3)  # NED, m/s^2: measured acceleration across the thrust axis, low-passed
BUMP: Final = _at.place(3)  # NED, m/s^2: decaying offset that makes level switches smooth
ACC_SETPOINT: Final = _at.place(3)  # NED, m/s^2
VEL_SETPOINT: Final = _at.place(3)  # NED, m/s
Q_SETPOINT: Final = _at.place(4)  # q_ned_from_frd
RATE_SETPOINT: Final = _at.place(3)  # FRD, rad/s
THRUST_SETPOINT: Final = _at.place()  # collective, 0..1
YAW_RATE_FF: Final = _at.place()  # about NED down, rad/s
RATE_INTEGRAL: Final = _at.place(3)  # FRD, normalised torque
RATE_PREVIOUS: Final = _at.place(3)  # FRD, rad/s
RATE_DERIVATIVE: Final = _at.place(3)  # FRD, rad/s^2, low-passed
UNALLOCATED: Final = _at.place(3)  # normalised torque the mixer could not give
YAW_TORQUE: Final = _at.place()  # low-passed yaw torque
HOVER: Final = _at.place()  # hover thrust estimate
HOVER_VARIANCE: Final = _at.place()
THRUST_LAGGED: Final = _at.place()  # collective as the rotors should give it by now
MOTOR_THRUST: Final = _at.place(4)  # 4 normalised motor thrusts
THRUST_GIVEN: Final = _at.place()  # mean of the motor thrusts after desaturation
GROUND_CONTACT: Final = _at.place()  # 1.0 while something else than the rotors may carry the vehicle
STATE_SIZE: Final = _at.size
