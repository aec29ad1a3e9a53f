"""PX4 parameters to the typed parameters of commander, flight tasks, control laws and filter."""

import math
from typing import Final

from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.commander.geofence_parameters import FenceParameters
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from autopilot_bridge.firmware.external_mapping import px4_external
from autopilot_bridge.firmware.mapping import FieldMap, RatioMap, build, integer, scaled_values
from autopilot_bridge.firmware.navigation_noise import px4_noise
from autopilot_bridge.firmware.surroundings_mapping import (
    px4_avoidance,
    px4_follow,
    px4_precision,
    px4_return_precision,
)
from autopilot_bridge.flight.parameters import FlightParameters, RallyRule, ReturnDestination, YawBehaviour
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
    FieldMap("cruise_speed_m_s", "MPC_XY_CRUISE"),
    FieldMap("max_speed_m_s", "MPC_XY_VEL_MAX"),
    FieldMap("climb_speed_m_s", "MPC_Z_V_AUTO_UP"),
    FieldMap("descend_speed_m_s", "MPC_Z_V_AUTO_DN"),
    FieldMap("acceleration_m_s2", "MPC_ACC_HOR"),
    FieldMap("acceleration_up_m_s2", "MPC_ACC_UP_MAX"),
    FieldMap("acceleration_down_m_s2", "MPC_ACC_DOWN_MAX"),
    FieldMap("jerk_m_s3", "MPC_JERK_AUTO"),
    FieldMap("trajectory_p_1_s", "MPC_XY_TRAJ_P"),
    FieldMap("trajectory_error_max_m", "MPC_XY_ERR_MAX"),
    FieldMap("yaw_rate_max_rad_s", "MPC_YAWRAUTO_MAX", _DEG),
    FieldMap("yaw_acceleration_rad_s2", "MPC_YAWRAUTO_ACC", _DEG),
    FieldMap("acceptance_radius_m", "NAV_ACC_RAD"),
    FieldMap("acceptance_altitude_m", "NAV_MC_ALT_RAD"),
    FieldMap("takeoff_altitude_m", "MIS_TAKEOFF_ALT"),
    FieldMap("takeoff_speed_m_s", "MPC_TKO_SPEED"),
    FieldMap("takeoff_ramp_time_s", "MPC_TKO_RAMP_T"),
    FieldMap("spoolup_time_s", "COM_SPOOLUP_TIME"),
    FieldMap("land_speed_m_s", "MPC_LAND_SPEED"),
    FieldMap("land_descend_speed_m_s", "MPC_Z_V_AUTO_DN"),
    FieldMap("return_altitude_m", "RTL_RETURN_ALT"),
    FieldMap("return_descend_altitude_m", "RTL_DESCEND_ALT"),
    FieldMap("return_loiter_time_s", "RTL_LAND_DELAY"),
    FieldMap("return_speed_m_s", "MPC_XY_CRUISE"),
    FieldMap("return_cone_half_angle_rad", "RTL_CONE_ANG", _DEG),
    FieldMap("return_min_distance_m", "RTL_MIN_DIST"),
    FieldMap("manual_speed_m_s", "MPC_VEL_MANUAL"),
    FieldMap("manual_climb_speed_m_s", "MPC_Z_VEL_MAX_UP"),
    FieldMap("manual_descend_speed_m_s", "MPC_Z_VEL_MAX_DN"),
    FieldMap("manual_tilt_rad", "MPC_MAN_TILT_MAX", _DEG),
    FieldMap("manual_yaw_rate_rad_s", "MPC_MAN_Y_MAX", _DEG),
    FieldMap("acro_rate_rad_s", "MC_ACRO_R_MAX", _DEG),
    FieldMap("acro_yaw_rate_rad_s", "MC_ACRO_Y_MAX", _DEG),
    FieldMap("manual_throttle_min", "MPC_MANTHR_MIN"),
    FieldMap("manual_deadzone", "MPC_HOLD_DZ"),
    FieldMap("manual_expo", "MPC_XY_MAN_EXPO"),
)

CONTROLLER: Final = (
    FieldMap("pos_xy_p_1_s", "MPC_XY_P"),
    FieldMap("pos_z_p_1_s", "MPC_Z_P"),
    FieldMap("vel_xy_p_1_s", "MPC_XY_VEL_P_ACC"),
    FieldMap("vel_xy_i_1_s2", "MPC_XY_VEL_I_ACC"),
    FieldMap("vel_xy_d", "MPC_XY_VEL_D_ACC"),
    FieldMap("vel_z_p_1_s", "MPC_Z_VEL_P_ACC"),
    FieldMap("vel_z_i_1_s2", "MPC_Z_VEL_I_ACC"),
    FieldMap("vel_z_d", "MPC_Z_VEL_D_ACC"),
    FieldMap("vel_derivative_cutoff_hz", "MPC_VELD_LP"),
    FieldMap("speed_xy_max_m_s", "MPC_XY_VEL_MAX"),
    FieldMap("speed_up_max_m_s", "MPC_Z_VEL_MAX_UP"),
    FieldMap("speed_down_max_m_s", "MPC_Z_VEL_MAX_DN"),
    FieldMap("tilt_max_rad", "MPC_TILTMAX_AIR", _DEG),
    FieldMap("thrust_min", "MPC_THR_MIN"),
    FieldMap("thrust_max", "MPC_THR_MAX"),
    FieldMap("thrust_xy_margin", "MPC_THR_XY_MARG"),
    FieldMap("hover_thrust", "MPC_THR_HOVER"),
    FieldMap("roll_p_1_s", "MC_ROLL_P"),
    FieldMap("pitch_p_1_s", "MC_PITCH_P"),
    FieldMap("yaw_p_1_s", "MC_YAW_P"),
    FieldMap("yaw_weight", "MC_YAW_WEIGHT"),
    FieldMap("roll_rate_max_rad_s", "MC_ROLLRATE_MAX", _DEG),
    FieldMap("pitch_rate_max_rad_s", "MC_PITCHRATE_MAX", _DEG),
    FieldMap("yaw_rate_max_rad_s", "MC_YAWRATE_MAX", _DEG),
    FieldMap("rate_roll_p", "MC_ROLLRATE_P"),
    FieldMap("rate_roll_i", "MC_ROLLRATE_I"),
    FieldMap("rate_roll_d", "MC_ROLLRATE_D"),
    FieldMap("rate_roll_ff", "MC_ROLLRATE_FF"),
    FieldMap("rate_roll_k", "MC_ROLLRATE_K"),
    FieldMap("rate_roll_integral_max", "MC_RR_INT_LIM"),
    FieldMap("rate_pitch_p", "MC_PITCHRATE_P"),
    FieldMap("rate_pitch_i", "MC_PITCHRATE_I"),
    FieldMap("rate_pitch_d", "MC_PITCHRATE_D"),
    FieldMap("rate_pitch_ff", "MC_PITCHRATE_FF"),
    FieldMap("rate_pitch_k", "MC_PITCHRATE_K"),
    FieldMap("rate_pitch_integral_max", "MC_PR_INT_LIM"),
    FieldMap("rate_yaw_p", "MC_YAWRATE_P"),
    FieldMap("rate_yaw_i", "MC_YAWRATE_I"),
    FieldMap("rate_yaw_d", "MC_YAWRATE_D"),
    FieldMap("rate_yaw_ff", "MC_YAWRATE_FF"),
    FieldMap("rate_yaw_k", "MC_YAWRATE_K"),
    FieldMap("rate_yaw_integral_max", "MC_YR_INT_LIM"),
    FieldMap("rate_derivative_cutoff_hz", "IMU_DGYRO_CUTOFF"),
    FieldMap("yaw_torque_cutoff_hz", "MC_YAW_TQ_CUTOFF"),
    FieldMap("thrust_model_factor", "THR_MDL_FAC"),
)

NAVIGATION: Final = (
    FieldMap("no_aid_timeout_s", "EKF2_NOAID_TOUT", 1e-6),
    FieldMap("gps_required_eph_m", "EKF2_REQ_EPH"),
    FieldMap("gps_required_epv_m", "EKF2_REQ_EPV"),
    FieldMap("gps_required_speed_accuracy_m_s", "EKF2_REQ_SACC"),
    FieldMap("gps_gate", "EKF2_GPS_P_GATE"),
    FieldMap("gps_velocity_gate", "EKF2_GPS_V_GATE"),
    FieldMap("barometer_gate", "EKF2_BARO_GATE"),
    FieldMap("magnetometer_gate", "EKF2_MAG_GATE"),
    FieldMap("gps_required_hdop", "EKF2_REQ_PDOP"),
    FieldMap("no_aid_noise_m", "EKF2_NOAID_NOISE"),
)

NAVIGATION_RATIOS: Final = (
    RatioMap(("gps_check_time_s",), "EKF2_REQ_GPS_H"),
    RatioMap(("gyro_bias_rad_s",), "EKF2_GBIAS_INIT"),
)
_GPS_POSITION_OR_VELOCITY: Final = 1 | 4  # of EKF2_GPS_CTRL


def commander_parameters(store: ParameterStore) -> CommanderParameters:
    """COM_*, NAV_*, BAT_*, GF_* (PX4 v1.16 parameter reference)."""
    low_battery = integer(store, "COM_LOW_BAT_ACT")
    override = integer(store, "COM_RC_OVERRIDE")
    manual_loss_s = store.limited("COM_RC_LOSS_T")
    return CommanderParameters(
        offboard_loss_s=store.limited("COM_OF_LOSS_T"),
        offboard_loss_action=_OFFBOARD_LOSS.get(integer(store, "COM_OBL_RC_ACT"), FailsafeAction.POSITION),
        gcs_loss_s=store.limited("COM_DL_LOSS_T"),
        gcs_loss_action=_LINK_LOSS.get(integer(store, "NAV_DLL_ACT"), FailsafeAction.NONE),
        gcs_loss_exempt=_exempt(integer(store, "COM_DLL_EXCEPT")),
        stick_timeout_s=manual_loss_s,
        manual_loss_s=manual_loss_s,
        manual_loss_action=_LINK_LOSS.get(integer(store, "NAV_RCL_ACT"), FailsafeAction.NONE),
        manual_loss_exempt=_exempt(integer(store, "COM_RCL_EXCEPT")),
        action_delay_s=store.limited("COM_FAIL_ACT_T"),
        battery_low_remaining=store.limited("BAT_LOW_THR"),
        battery_critical_remaining=store.limited("BAT_CRIT_THR"),
        battery_emergency_remaining=store.limited("BAT_EMERGEN_THR"),
        battery_low_v=0.0,
        battery_critical_v=0.0,
        battery_timer_s=0.0,
        battery_low_action=FailsafeAction.WARN,
        battery_critical_action=_BATTERY_CRITICAL.get(low_battery, FailsafeAction.WARN),
        battery_emergency_action=_BATTERY_EMERGENCY.get(low_battery, FailsafeAction.WARN),
        position_loss_s=0.0,
        position_loss_action=FailsafeAction.DESCEND,
        fence=fence_parameters(store),
        disarm_preflight_s=store.limited("COM_DISARM_PRFLT"),
        disarm_landed_s=store.limited("COM_DISARM_LAND"),
        stick_override=bool(override & 1),
        stick_override_offboard=bool(override & 2),
        stick_override_threshold=store.limited("COM_RC_STICK_OV") / 100.0,
        check_arming=True,
    )


def flight_parameters(store: ParameterStore) -> FlightParameters:
    """MPC_*, MIS_*, RTL_*, NAV_*."""
    yaw_mode = integer(store, "MPC_YAW_MODE")
    yaw = {0: YawBehaviour.TOWARDS_TARGET, 3: YawBehaviour.ALONG_TRACK, 4: YawBehaviour.TOWARDS_TARGET}
    slow_m = store.limited("MPC_LAND_ALT2")
    fast_m = max(slow_m, store.limited("MPC_LAND_ALT1"))
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
        nose_follows_roi=not integer(store, "MIS_MNT_YAW_CTL"),
        yaw_behaviour=yaw.get(yaw_mode, YawBehaviour.KEEP),
        land_slow_altitude_m=slow_m,
        land_fast_altitude_m=fast_m,
    )


def return_rules(store: ParameterStore) -> tuple[ReturnDestination, RallyRule]:
    """RTL_TYPE: where a return leads, and whether rally points count."""
    kind = integer(store, "RTL_TYPE")
    return _RETURNS.get(kind, ReturnDestination.HOME), RallyRule(used=kind in _RALLY_RETURNS)


def fence_parameters(store: ParameterStore) -> FenceParameters:
    """GF_*."""
    action = _FENCE.get(integer(store, "GF_ACTION"), FailsafeAction.NONE)
    return FenceParameters(
        enabled=action is not FailsafeAction.NONE,
        action=action,
        radius_m=store.limited("GF_MAX_HOR_DIST"),
        height_max_m=store.limited("GF_MAX_VER_DIST"),
        shapes=True,
        predicts=bool(integer(store, "GF_PREDICT")),
        by_gps=bool(integer(store, "GF_SOURCE")),
    )


def controller_parameters(store: ParameterStore) -> MulticopterParameters:
    """MPC_*, MC_*."""
    return build(
        MulticopterParameters,
        store,
        CONTROLLER,
        use_hover_thrust_estimate=bool(integer(store, "MPC_USE_HTE")),
    )


def navigation_parameters(store: ParameterStore) -> NavigationParameters:
    """EKF2_*: noise, gates, checks and time-outs; EKF2_REQ_GPS_H, EKF2_GBIAS_INIT relative to PX4's default.

    GPS is fused as a whole: with neither position nor velocity in EKF2_GPS_CTRL not at all.
    """
    return build(
        NavigationParameters,
        store,
        NAVIGATION,
        gps_required_satellites=int(store.limited("EKF2_REQ_NSATS")),
        use_gps=gps_is_fused(store),
        external=px4_external(store),
        **px4_noise(store),
        **scaled_values(NavigationParameters(), store, NAVIGATION_RATIOS),
    )


def gps_is_fused(store: ParameterStore) -> bool:
    """EKF2_GPS_CTRL enables position or velocity."""
    return bool(integer(store, "EKF2_GPS_CTRL") & _GPS_POSITION_OR_VELOCITY)


def _exempt(bits: int) -> frozenset[FlightMode]:
    return frozenset(mode for bit, mode in _EXCEPTIONS.items() if bits & bit)
