"""PX4 parameters to the typed parameters of commander, flight tasks, control laws and filter."""

import math
from typing import Final

from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.commander.geofence_parameters import FenceParameters
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from autopilot_bridge.firmware.external_mapping import px4_external
from autopilot_bridge.firmware.mapping import FieldMap, RatioMap, build, clamp, integer, number, scaled_values
from autopilot_bridge.firmware.navigation_noise import px4_noise
from autopilot_bridge.firmware.surroundings_mapping import (
    px4_avoidance,
    px4_follow,
    px4_precision,
    px4_return_precision,
)
from autopilot_bridge.flight.parameters import FlightParameters, YawBehaviour
from autopilot_bridge.flight.return_rules import RallyRule, ReturnDestination
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.parameters import ParameterStore

_DEG: Final = math.radians(1.0)

_OFFBOARD_LOSS: Final = {
    0: FailsafeAction.POSITION,
    1: FailsafeAction.ALTITUDE,
    2: FailsafeAction.STABILIZED,
    3: FailsafeAction.RETURN,
    4: FailsafeAction.LAND,
    5: FailsafeAction.HOLD,
    6: FailsafeAction.TERMINATE,
    7: FailsafeAction.DISARM,
}  # COM_OBL_RC_ACT
_LINK_LOSS: Final = {
    0: FailsafeAction.NONE,
    1: FailsafeAction.HOLD,
    2: FailsafeAction.RETURN,
    3: FailsafeAction.LAND,
    5: FailsafeAction.TERMINATE,
    6: FailsafeAction.DISARM,
}  # NAV_DLL_ACT, NAV_RCL_ACT
_FENCE: Final = {
    0: FailsafeAction.NONE,
    1: FailsafeAction.WARN,
    2: FailsafeAction.HOLD,
    3: FailsafeAction.RETURN,
    4: FailsafeAction.TERMINATE,
    5: FailsafeAction.LAND,
}  # GF_ACTION
_RETURNS: Final = {
    0: ReturnDestination.HOME,
    1: ReturnDestination.LANDING_OR_RALLY,
    2: ReturnDestination.ALONG_PLAN,
    3: ReturnDestination.CLOSEST,
    4: ReturnDestination.ALONG_PLAN_SHORTER,
}  # RTL_TYPE
_RALLY_RETURNS: Final = frozenset({0, 1, 3})
_BATTERY_CRITICAL: Final = {1: FailsafeAction.RETURN, 2: FailsafeAction.LAND, 3: FailsafeAction.RETURN}
_BATTERY_EMERGENCY: Final = {1: FailsafeAction.RETURN, 2: FailsafeAction.LAND, 3: FailsafeAction.LAND}
_EXCEPTIONS: Final = {
    1: FlightMode.MISSION,
    2: FlightMode.HOLD,
    4: FlightMode.OFFBOARD,
}  # COM_RCL_EXCEPT, COM_DLL_EXCEPT

FLIGHT: Final = (
    FieldMap("cruise_speed_m_s", "MPC_XY_CRUISE", low=0.3, high=20.0),
    FieldMap("max_speed_m_s", "MPC_XY_VEL_MAX", low=0.3, high=20.0),
    FieldMap("climb_speed_m_s", "MPC_Z_V_AUTO_UP", low=0.2, high=8.0),
    FieldMap("descend_speed_m_s", "MPC_Z_V_AUTO_DN", low=0.2, high=4.0),
    FieldMap("acceleration_m_s2", "MPC_ACC_HOR", low=0.5, high=15.0),
    FieldMap("acceleration_up_m_s2", "MPC_ACC_UP_MAX", low=0.5, high=15.0),
    FieldMap("acceleration_down_m_s2", "MPC_ACC_DOWN_MAX", low=0.5, high=8.0),
    FieldMap("jerk_m_s3", "MPC_JERK_AUTO", low=0.5, high=80.0),
    FieldMap("trajectory_p_1_s", "MPC_XY_TRAJ_P", low=0.1, high=1.0),
    FieldMap("trajectory_error_max_m", "MPC_XY_ERR_MAX", low=0.1, high=10.0),
    FieldMap("yaw_rate_max_rad_s", "MPC_YAWRAUTO_MAX", _DEG, low=0.01, high=6.3),
    FieldMap("yaw_acceleration_rad_s2", "MPC_YAWRAUTO_ACC", _DEG, low=0.05, high=6.3),
    FieldMap("acceptance_radius_m", "NAV_ACC_RAD", low=0.05, high=200.0),
    FieldMap("acceptance_altitude_m", "NAV_MC_ALT_RAD", low=0.05, high=200.0),
    FieldMap("takeoff_altitude_m", "MIS_TAKEOFF_ALT", low=0.5, high=500.0),
    FieldMap("takeoff_speed_m_s", "MPC_TKO_SPEED", low=0.3, high=5.0),
    FieldMap("takeoff_ramp_time_s", "MPC_TKO_RAMP_T", low=0.0, high=5.0),
    FieldMap("spoolup_time_s", "COM_SPOOLUP_TIME", low=0.0, high=30.0),
    FieldMap("land_speed_m_s", "MPC_LAND_SPEED", low=0.2, high=3.0),
    FieldMap("land_descend_speed_m_s", "MPC_Z_V_AUTO_DN", low=0.2, high=4.0),
    FieldMap("return_altitude_m", "RTL_RETURN_ALT", low=0.1, high=500.0),
    FieldMap("return_descend_altitude_m", "RTL_DESCEND_ALT", low=0.0, high=500.0),
    FieldMap("return_loiter_time_s", "RTL_LAND_DELAY", low=-1.0, high=3600.0),
    FieldMap("return_speed_m_s", "MPC_XY_CRUISE", low=0.3, high=20.0),
    FieldMap("return_cone_half_angle_rad", "RTL_CONE_ANG", _DEG, low=0.0, high=math.pi / 2.0),
    FieldMap("return_min_distance_m", "RTL_MIN_DIST", low=0.0, high=1000.0),
    FieldMap("manual_speed_m_s", "MPC_VEL_MANUAL", low=0.3, high=20.0),
    FieldMap("manual_climb_speed_m_s", "MPC_Z_VEL_MAX_UP", low=0.2, high=8.0),
    FieldMap("manual_descend_speed_m_s", "MPC_Z_VEL_MAX_DN", low=0.2, high=4.0),
    FieldMap("manual_tilt_rad", "MPC_MAN_TILT_MAX", _DEG, low=0.05, high=1.2),
    FieldMap("manual_yaw_rate_rad_s", "MPC_MAN_Y_MAX", _DEG, low=0.01, high=7.0),
    FieldMap("acro_rate_rad_s", "MC_ACRO_R_MAX", _DEG, low=0.1, high=30.0),
    FieldMap("acro_yaw_rate_rad_s", "MC_ACRO_Y_MAX", _DEG, low=0.1, high=30.0),
    FieldMap("manual_throttle_min", "MPC_MANTHR_MIN", low=0.01, high=0.9),
    FieldMap("manual_deadzone", "MPC_HOLD_DZ", low=0.0, high=0.9),
    FieldMap("manual_expo", "MPC_XY_MAN_EXPO", low=0.0, high=1.0),
)

CONTROLLER: Final = (
    FieldMap("pos_xy_p_1_s", "MPC_XY_P", low=0.05, high=4.0),
    FieldMap("pos_z_p_1_s", "MPC_Z_P", low=0.05, high=4.0),
    FieldMap("vel_xy_p_1_s", "MPC_XY_VEL_P_ACC", low=0.1, high=15.0),
    FieldMap("vel_xy_i_1_s2", "MPC_XY_VEL_I_ACC", low=0.0, high=15.0),
    FieldMap("vel_xy_d", "MPC_XY_VEL_D_ACC", low=0.0, high=2.0),
    FieldMap("vel_z_p_1_s", "MPC_Z_VEL_P_ACC", low=0.1, high=15.0),
    FieldMap("vel_z_i_1_s2", "MPC_Z_VEL_I_ACC", low=0.0, high=15.0),
    FieldMap("vel_z_d", "MPC_Z_VEL_D_ACC", low=0.0, high=2.0),
    FieldMap("vel_derivative_cutoff_hz", "MPC_VELD_LP", low=0.5, high=50.0),
    FieldMap("speed_xy_max_m_s", "MPC_XY_VEL_MAX", low=0.3, high=20.0),
    FieldMap("speed_up_max_m_s", "MPC_Z_VEL_MAX_UP", low=0.2, high=8.0),
    FieldMap("speed_down_max_m_s", "MPC_Z_VEL_MAX_DN", low=0.2, high=4.0),
    FieldMap("tilt_max_rad", "MPC_TILTMAX_AIR", _DEG, low=0.1, high=1.5),
    FieldMap("thrust_min", "MPC_THR_MIN", low=0.01, high=0.3),
    FieldMap("thrust_max", "MPC_THR_MAX", low=0.4, high=1.0),
    FieldMap("thrust_xy_margin", "MPC_THR_XY_MARG", low=0.0, high=0.5),
    FieldMap("hover_thrust", "MPC_THR_HOVER", low=0.1, high=0.8),
    FieldMap("roll_p_1_s", "MC_ROLL_P", low=0.5, high=12.0),
    FieldMap("pitch_p_1_s", "MC_PITCH_P", low=0.5, high=12.0),
    FieldMap("yaw_p_1_s", "MC_YAW_P", low=0.1, high=5.0),
    FieldMap("yaw_weight", "MC_YAW_WEIGHT", low=0.0, high=1.0),
    FieldMap("roll_rate_max_rad_s", "MC_ROLLRATE_MAX", _DEG, low=0.1, high=31.0),
    FieldMap("pitch_rate_max_rad_s", "MC_PITCHRATE_MAX", _DEG, low=0.1, high=31.0),
    FieldMap("yaw_rate_max_rad_s", "MC_YAWRATE_MAX", _DEG, low=0.1, high=31.0),
    FieldMap("rate_roll_p", "MC_ROLLRATE_P", low=0.001, high=0.5),
    FieldMap("rate_roll_i", "MC_ROLLRATE_I", low=0.0, high=2.0),
    FieldMap("rate_roll_d", "MC_ROLLRATE_D", low=0.0, high=0.01),
    FieldMap("rate_roll_ff", "MC_ROLLRATE_FF", low=0.0, high=1.0),
    FieldMap("rate_roll_k", "MC_ROLLRATE_K", low=0.01, high=5.0),
    FieldMap("rate_roll_integral_max", "MC_RR_INT_LIM", low=0.0, high=1.0),
    FieldMap("rate_pitch_p", "MC_PITCHRATE_P", low=0.001, high=0.6),
    FieldMap("rate_pitch_i", "MC_PITCHRATE_I", low=0.0, high=2.0),
    FieldMap("rate_pitch_d", "MC_PITCHRATE_D", low=0.0, high=0.01),
    FieldMap("rate_pitch_ff", "MC_PITCHRATE_FF", low=0.0, high=1.0),
    FieldMap("rate_pitch_k", "MC_PITCHRATE_K", low=0.01, high=5.0),
    FieldMap("rate_pitch_integral_max", "MC_PR_INT_LIM", low=0.0, high=1.0),
    FieldMap("rate_yaw_p", "MC_YAWRATE_P", low=0.001, high=0.6),
    FieldMap("rate_yaw_i", "MC_YAWRATE_I", low=0.0, high=2.0),
    FieldMap("rate_yaw_d", "MC_YAWRATE_D", low=0.0, high=0.01),
    FieldMap("rate_yaw_ff", "MC_YAWRATE_FF", low=0.0, high=1.0),
    FieldMap("rate_yaw_k", "MC_YAWRATE_K", low=0.01, high=5.0),
    FieldMap("rate_yaw_integral_max", "MC_YR_INT_LIM", low=0.0, high=1.0),
    FieldMap("rate_derivative_cutoff_hz", "IMU_DGYRO_CUTOFF", low=1.0, high=100.0),
    FieldMap("yaw_torque_cutoff_hz", "MC_YAW_TQ_CUTOFF", low=0.0, high=10.0),
    FieldMap("thrust_model_factor", "THR_MDL_FAC", low=0.0, high=1.0),
)

NAVIGATION: Final = (
    FieldMap("no_aid_timeout_s", "EKF2_NOAID_TOUT", 1e-6, low=0.5, high=10.0),
    FieldMap("gps_required_eph_m", "EKF2_REQ_EPH", low=2.0, high=100.0),
    FieldMap("gps_required_epv_m", "EKF2_REQ_EPV", low=2.0, high=100.0),
    FieldMap("gps_required_speed_accuracy_m_s", "EKF2_REQ_SACC", low=0.5, high=5.0),
    FieldMap("gps_gate", "EKF2_GPS_P_GATE", low=1.0, high=20.0),
    FieldMap("gps_velocity_gate", "EKF2_GPS_V_GATE", low=1.0, high=20.0),
    FieldMap("barometer_gate", "EKF2_BARO_GATE", low=1.0, high=20.0),
    FieldMap("magnetometer_gate", "EKF2_MAG_GATE", low=1.0, high=20.0),
    FieldMap("gps_required_hdop", "EKF2_REQ_PDOP", low=1.5, high=5.0),
    FieldMap("no_aid_noise_m", "EKF2_NOAID_NOISE", low=0.5, high=50.0),
)

NAVIGATION_RATIOS: Final = (
    RatioMap(("gps_check_time_s",), "EKF2_REQ_GPS_H"),
    RatioMap(("gyro_bias_rad_s",), "EKF2_GBIAS_INIT"),
)
_GPS_POSITION_OR_VELOCITY: Final = 1 | 4  # of EKF2_GPS_CTRL


def commander_parameters(store: ParameterStore) -> CommanderParameters:
    """COM_*, NAV_*, BAT_*, GF_* (PX4 v1.16 parameter reference)."""
    low_battery = integer(store, "COM_LOW_BAT_ACT", 0)
    override = integer(store, "COM_RC_OVERRIDE", 1)
    manual_loss_s = clamp(number(store, "COM_RC_LOSS_T", 0.5), 0.1, 35.0)
    return CommanderParameters(
        offboard_loss_s=clamp(number(store, "COM_OF_LOSS_T", 1.0), 0.05, 60.0),
        offboard_loss_action=_OFFBOARD_LOSS.get(integer(store, "COM_OBL_RC_ACT", 0), FailsafeAction.POSITION),
        gcs_loss_s=clamp(number(store, "COM_DL_LOSS_T", 10.0), 1.0, 300.0),
        gcs_loss_action=_LINK_LOSS.get(integer(store, "NAV_DLL_ACT", 0), FailsafeAction.NONE),
        gcs_loss_exempt=_exempt(integer(store, "COM_DLL_EXCEPT", 0)),
        stick_timeout_s=manual_loss_s,
        manual_loss_s=manual_loss_s,
        manual_loss_action=_LINK_LOSS.get(integer(store, "NAV_RCL_ACT", 2), FailsafeAction.NONE),
        manual_loss_exempt=_exempt(integer(store, "COM_RCL_EXCEPT", 0)),
        action_delay_s=clamp(number(store, "COM_FAIL_ACT_T", 5.0), 0.0, 25.0),
        battery_low_remaining=clamp(number(store, "BAT_LOW_THR", 0.15), 0.0, 1.0),
        battery_critical_remaining=clamp(number(store, "BAT_CRIT_THR", 0.07), 0.0, 1.0),
        battery_emergency_remaining=clamp(number(store, "BAT_EMERGEN_THR", 0.05), 0.0, 1.0),
        battery_low_v=0.0,
        battery_critical_v=0.0,
        battery_timer_s=0.0,
        battery_low_action=FailsafeAction.WARN,
        battery_critical_action=_BATTERY_CRITICAL.get(low_battery, FailsafeAction.WARN),
        battery_emergency_action=_BATTERY_EMERGENCY.get(low_battery, FailsafeAction.WARN),
        position_loss_s=0.0,
        position_loss_action=FailsafeAction.DESCEND,
        fence=fence_parameters(store),
        disarm_preflight_s=clamp(number(store, "COM_DISARM_PRFLT", 10.0), -1.0, 1e6),
        disarm_landed_s=clamp(number(store, "COM_DISARM_LAND", 2.0), -1.0, 1e6),
        stick_override=bool(override & 1),
        stick_override_offboard=bool(override & 2),
        stick_override_threshold=clamp(number(store, "COM_RC_STICK_OV", 30.0) / 100.0, 0.05, 0.8),
        check_arming=True,
    )


def flight_parameters(store: ParameterStore) -> FlightParameters:
    """MPC_*, MIS_*, RTL_*, NAV_*."""
    yaw_mode = integer(store, "MPC_YAW_MODE", 0)
    yaw = {0: YawBehaviour.TOWARDS_TARGET, 3: YawBehaviour.ALONG_TRACK, 4: YawBehaviour.TOWARDS_TARGET}
    slow_m = clamp(number(store, "MPC_LAND_ALT2", 5.0), 0.1, 100.0)
    fast_m = clamp(number(store, "MPC_LAND_ALT1", 10.0), slow_m, 100.0)
    destination, rally = return_rules(store)
    return build(
        FlightParameters,
        store,
        FLIGHT,
        return_precision=px4_return_precision(store),
        follow=px4_follow(store),
        precision=px4_precision(store),
        avoidance=px4_avoidance(store),
        return_destination=destination,
        rally=rally,
        nose_follows_roi=not integer(store, "MIS_MNT_YAW_CTL", 0),
        yaw_behaviour=yaw.get(yaw_mode, YawBehaviour.KEEP),
        land_slow_altitude_m=slow_m,
        land_fast_altitude_m=fast_m,
    )


def return_rules(store: ParameterStore, default: int = 0) -> tuple[ReturnDestination, RallyRule]:
    """RTL_TYPE: where a return leads, and whether rally points count."""
    kind = integer(store, "RTL_TYPE", default)
    return _RETURNS.get(kind, ReturnDestination.HOME), RallyRule(used=kind in _RALLY_RETURNS)


def fence_parameters(store: ParameterStore) -> FenceParameters:
    """GF_*."""
    action = _FENCE.get(integer(store, "GF_ACTION", 2), FailsafeAction.NONE)
    return FenceParameters(
        enabled=action is not FailsafeAction.NONE,
        action=action,
        radius_m=clamp(number(store, "GF_MAX_HOR_DIST", 0.0), 0.0, 1e6),
        height_max_m=clamp(number(store, "GF_MAX_VER_DIST", 0.0), 0.0, 1e6),
        shapes=True,
        predicts=bool(integer(store, "GF_PREDICT", 0)),
        by_gps=bool(integer(store, "GF_SOURCE", 0)),
    )


def controller_parameters(store: ParameterStore) -> MulticopterParameters:
    """MPC_*, MC_*."""
    return build(
        MulticopterParameters,
        store,
        CONTROLLER,
        use_hover_thrust_estimate=bool(integer(store, "MPC_USE_HTE", 1)),
    )


def navigation_parameters(store: ParameterStore) -> NavigationParameters:
    """EKF2_*: noise, gates, checks and time-outs; EKF2_REQ_GPS_H, EKF2_GBIAS_INIT relative to PX4's default.

    GPS is fused as a whole: with neither position nor velocity in EKF2_GPS_CTRL not at all.
    """
    satellites = integer(store, "EKF2_REQ_NSATS", 6)
    return build(
        NavigationParameters,
        store,
        NAVIGATION,
        gps_required_satellites=max(4, min(12, satellites)),
        use_gps=gps_is_fused(store),
        external=px4_external(store),
        **px4_noise(store),
        **scaled_values(NavigationParameters(), store, NAVIGATION_RATIOS),
    )


def gps_is_fused(store: ParameterStore) -> bool:
    """EKF2_GPS_CTRL enables position or velocity."""
    return bool(integer(store, "EKF2_GPS_CTRL", 7) & _GPS_POSITION_OR_VELOCITY)


def _exempt(bits: int) -> frozenset[FlightMode]:
    return frozenset(mode for bit, mode in _EXCEPTIONS.items() if bits & bit)
