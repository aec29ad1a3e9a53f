"""Gains and limits of the multicopter control laws; PX4's parameter is given beside each field."""

import math
from dataclasses import dataclass

from flightsim.foundation.checks import NotNegative, Positive, Share
from flightsim.foundation.options import Options


@dataclass(frozen=True, slots=True, kw_only=True)
class MulticopterParameters(Options):
    """Parameters of `MulticopterController`.

    Torques and thrust are normalised as in PX4: 1 is what the motors can give at most. Defaults are PX4's
    where PX4 has them, except the horizontal position loop, the yaw rate loop and the thrust curve, which
    are tuned for the iris model.

    Raises:
        ValueError: a field is not finite or outside its range.
    """

    # position and velocity
    pos_xy_p_1_s: Positive = 1.2  # MPC_XY_P
    pos_z_p_1_s: Positive = 1.0  # MPC_Z_P
    vel_xy_p_1_s: Positive = 2.6  # MPC_XY_VEL_P_ACC
    vel_xy_i_1_s2: NotNegative = 0.8  # MPC_XY_VEL_I_ACC
    vel_xy_d: NotNegative = 0.2  # MPC_XY_VEL_D_ACC
    vel_z_p_1_s: Positive = 4.0  # MPC_Z_VEL_P_ACC
    vel_z_i_1_s2: NotNegative = 2.0  # MPC_Z_VEL_I_ACC
    vel_z_d: NotNegative = 0.0  # MPC_Z_VEL_D_ACC
    vel_derivative_cutoff_hz: Positive = 5.0  # MPC_VELD_LP
    speed_xy_max_m_s: Positive = 12.0  # MPC_XY_VEL_MAX
    speed_up_max_m_s: Positive = 3.0  # MPC_Z_VEL_MAX_UP
    speed_down_max_m_s: Positive = 1.5  # MPC_Z_VEL_MAX_DN
    tilt_max_rad: Positive = math.radians(45.0)  # MPC_TILTMAX_AIR
    thrust_min: Share = 0.08  # MPC_THR_MIN
    thrust_max: Share = 1.0  # MPC_THR_MAX
    thrust_xy_margin: Share = 0.3  # MPC_THR_XY_MARG
    hover_thrust: Positive = 0.45  # MPC_THR_HOVER: start of the estimate
    use_hover_thrust_estimate: bool = True  # MPC_USE_HTE
    drag_compensation_cutoff_hz: NotNegative = 0.8  # (none): measured drag is fed forward below it; 0: off

    # attitude
    roll_p_1_s: Positive = 6.5  # MC_ROLL_P
    pitch_p_1_s: Positive = 6.5  # MC_PITCH_P
    yaw_p_1_s: Positive = 2.8  # MC_YAW_P
    yaw_weight: Share = 0.4  # MC_YAW_WEIGHT
    roll_rate_max_rad_s: Positive = math.radians(220.0)  # MC_ROLLRATE_MAX
    pitch_rate_max_rad_s: Positive = math.radians(220.0)  # MC_PITCHRATE_MAX
    yaw_rate_max_rad_s: Positive = math.radians(200.0)  # MC_YAWRATE_MAX

    # body rates
    rate_roll_p: Positive = 0.15  # MC_ROLLRATE_P
    rate_roll_i: NotNegative = 0.2  # MC_ROLLRATE_I
    rate_roll_d: NotNegative = 0.003  # MC_ROLLRATE_D
    rate_roll_ff: NotNegative = 0.0  # MC_ROLLRATE_FF
    rate_roll_k: Positive = 1.0  # MC_ROLLRATE_K
    rate_roll_integral_max: NotNegative = 0.3  # MC_RR_INT_LIM
    rate_pitch_p: Positive = 0.15  # MC_PITCHRATE_P
    rate_pitch_i: NotNegative = 0.2  # MC_PITCHRATE_I
    rate_pitch_d: NotNegative = 0.003  # MC_PITCHRATE_D
    rate_pitch_ff: NotNegative = 0.0  # MC_PITCHRATE_FF
    rate_pitch_k: Positive = 1.0  # MC_PITCHRATE_K
    rate_pitch_integral_max: NotNegative = 0.3  # MC_PR_INT_LIM
    rate_yaw_p: Positive = 0.45  # MC_YAWRATE_P
    rate_yaw_i: NotNegative = 0.15  # MC_YAWRATE_I
    rate_yaw_d: NotNegative = 0.0  # MC_YAWRATE_D
    rate_yaw_ff: NotNegative = 0.0  # MC_YAWRATE_FF
    rate_yaw_k: Positive = 1.0  # MC_YAWRATE_K
    rate_yaw_integral_max: NotNegative = 0.3  # MC_YR_INT_LIM
    rate_derivative_cutoff_hz: Positive = 30.0  # IMU_DGYRO_CUTOFF
    yaw_torque_cutoff_hz: NotNegative = 2.0  # MC_YAW_TQ_CUTOFF; 0: off

    # motors
    thrust_model_factor: Share = 0.5  # THR_MDL_FAC, MOT_THST_EXPO: thrust = f c^2 + (1 - f) c
    motor_idle: Share = 0.1  # lowest command of a running motor | MOT_SPIN_ARM
    rotor_time_constant_s: NotNegative = 0.035  # of the thrust, for the hover-thrust estimate

    def check_together(self) -> None:
        if self.hover_thrust > 1.0:
            raise ValueError(f"hover_thrust = {self.hover_thrust} is not in 0..1")
        if self.thrust_min >= self.thrust_max:
            raise ValueError(f"thrust_min = {self.thrust_min} is not below thrust_max = {self.thrust_max}")
        if self.tilt_max_rad >= math.radians(89.0):
            raise ValueError(f"tilt_max_rad = {self.tilt_max_rad} is not below 89 deg")
