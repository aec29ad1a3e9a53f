"""The controller's state as a record, and indices into the float64 array of its parameters."""

from dataclasses import fields
from typing import Final

from autopilot_bridge.control.controller import ControllerState
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from flightsim.foundation.records import Vector3, Vector4

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


class MulticopterState(ControllerState):
    """The controller's state."""

    counter: float  # physics steps since the position loop ran
    last_level: float
    airborne: float  # latched by motion after the motors started
    start_down_m: float  # nav down coordinate when the motors started
    vel_integral: Vector3  # NED, m/s^2
    acc_filtered: Vector3  # NED, m/s^2
    drag: Vector3  # NED, m/s^2: measured acceleration across the thrust axis, low-passed
    bump: Vector3  # NED, m/s^2: decaying offset that makes level switches smooth
    acc_setpoint: Vector3  # NED, m/s^2
    thrust_setpoint: float  # collective, 0..1
    yaw_rate_ff: float  # about NED down, rad/s
    rate_integral: Vector3  # FRD, normalised torque
    rate_previous: Vector3  # FRD, rad/s
    rate_derivative: Vector3  # FRD, rad/s^2, low-passed
    unallocated: Vector3  # normalised torque the mixer could not give
    yaw_torque: float  # low-passed yaw torque
    hover: float  # hover thrust estimate
    hover_variance: float
    thrust_lagged: float  # collective as the rotors should give it by now
    motor_thrust: Vector4  # 4 normalised motor thrusts
    thrust_given: float  # mean of the motor thrusts after desaturation
