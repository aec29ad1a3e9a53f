"""The controller's state as a record."""

from autopilot_bridge.control.controller import ControllerState
from flightsim.foundation.records import Vector3, Vector4


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
