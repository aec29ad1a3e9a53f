"""ArduCopter parameters to the typed parameters of commander, flight tasks, control laws and filter."""

import math
from collections.abc import Mapping
from typing import Final

from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.commander.geofence_parameters import (
    ALL_FENCES,
    AutoEnable,
    FenceParameters,
    FenceType,
)
from autopilot_bridge.commander.modes import STICK_MODES, FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from autopilot_bridge.firmware.external_mapping import ardupilot_external
from autopilot_bridge.firmware.gps_source import GpsSource, ardupilot_gps_source
from autopilot_bridge.firmware.mapping import FieldMap, RatioMap, build, clamp, integer, number, scaled_values
from autopilot_bridge.firmware.navigation_noise import ardupilot_noise
from autopilot_bridge.firmware.surroundings_mapping import (
    ardupilot_avoidance,
    ardupilot_follow,
    ardupilot_precision,
)
from autopilot_bridge.flight.parameters import FlightParameters, YawBehaviour
from autopilot_bridge.flight.return_rules import RallyRule
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.parameters import ParameterStore

_CM: Final = 0.01
_CENTIDEGREE: Final = math.radians(0.01)
_DEG: Final = math.radians(1.0)
_NEVER_S: Final = 1e9

# A return over the remembered path is not flown here: where the firmware would fall back to RTL or LAND
# without one, so do these tables.
_GCS: Final = {
    1: FailsafeAction.RETURN,
    2: FailsafeAction.RETURN,
    3: FailsafeAction.RETURN,
    4: FailsafeAction.LAND,
    5: FailsafeAction.LAND,
    6: FailsafeAction.RETURN,
    7: FailsafeAction.BRAKE,
}  # FS_GCS_ENABLE
_RADIO: Final = {
    1: FailsafeAction.RETURN,
    2: FailsafeAction.RETURN,
    3: FailsafeAction.LAND,
    4: FailsafeAction.RETURN,
    5: FailsafeAction.LAND,
    6: FailsafeAction.RETURN,
    7: FailsafeAction.BRAKE,
}  # FS_THR_ENABLE
_BATTERY: Final = {
    0: FailsafeAction.WARN,
    1: FailsafeAction.LAND,
    2: FailsafeAction.RETURN,
    3: FailsafeAction.RETURN,
    4: FailsafeAction.LAND,
    5: FailsafeAction.TERMINATE,
    6: FailsafeAction.RETURN,
    7: FailsafeAction.BRAKE,
}  # BATT_FS_LOW_ACT, BATT_FS_CRT_ACT
_EKF: Final = {
    0: FailsafeAction.WARN,
    1: FailsafeAction.LAND,
    2: FailsafeAction.ALTITUDE,
    3: FailsafeAction.LAND,
}  # FS_EKF_ACTION
_FENCE: Final = {
    0: FailsafeAction.WARN,
    1: FailsafeAction.RETURN,
    2: FailsafeAction.LAND,
    3: FailsafeAction.RETURN,
    4: FailsafeAction.BRAKE,
    5: FailsafeAction.LAND,
}  # FENCE_ACTION
_GIVE_UP_M: Final = 100.0  # so far outside the copter lands (AC_FENCE_GIVE_UP_DISTANCE)
_UNION: Final = 2  # of FENCE_OPTIONS
_LOCKS_MODE: Final = 1
_CONTINUE_AUTO_ON_RADIO: Final = 1
_CONTINUE_AUTO_ON_GCS: Final = 2
_CONTINUE_GUIDED_ON_RADIO: Final = 4
_CONTINUE_LANDING: Final = 8
_CONTINUE_PILOT_ON_GCS: Final = 16

POSITION_LOSS_S: Final = 3.0
"""From the filter's own loss of position (5 s after the last aiding) to the EKF failsafe: 8 s in all."""

FLIGHT: Final = (
    FieldMap("cruise_speed_m_s", "WPNAV_SPEED", _CM, low=0.2, high=20.0),
    FieldMap("max_speed_m_s", "WPNAV_SPEED", _CM, low=0.2, high=20.0),
    FieldMap("climb_speed_m_s", "WPNAV_SPEED_UP", _CM, low=0.1, high=10.0),
    FieldMap("descend_speed_m_s", "WPNAV_SPEED_DN", _CM, low=0.1, high=5.0),
    FieldMap("acceleration_m_s2", "WPNAV_ACCEL", _CM, low=0.5, high=5.0),
    FieldMap("acceleration_up_m_s2", "WPNAV_ACCEL_Z", _CM, low=0.5, high=5.0),
    FieldMap("acceleration_down_m_s2", "WPNAV_ACCEL_Z", _CM, low=0.5, high=5.0),
    FieldMap("jerk_m_s3", "PSC_JERK_XY", low=1.0, high=20.0),
    FieldMap("yaw_rate_max_rad_s", "ATC_SLEW_YAW", _CENTIDEGREE, low=0.1, high=3.15),
    FieldMap("acceptance_radius_m", "WPNAV_RADIUS", _CM, low=0.05, high=10.0),
    FieldMap("takeoff_speed_m_s", "WPNAV_SPEED_UP", _CM, low=0.1, high=10.0),
    FieldMap("takeoff_ramp_time_s", "TKOFF_SLEW_TIME", low=0.0, high=20.0),
    FieldMap("spoolup_time_s", "MOT_SPOOL_TIME", low=0.0, high=2.0),
    FieldMap("land_speed_m_s", "LAND_SPEED", _CM, low=0.3, high=2.0),
    FieldMap("land_descend_speed_m_s", "WPNAV_SPEED_DN", _CM, low=0.1, high=5.0),
    FieldMap("land_slow_altitude_m", "LAND_ALT_LOW", _CM, low=1.0, high=100.0),
    FieldMap("land_fast_altitude_m", "LAND_ALT_LOW", _CM, low=1.0, high=100.0),
    FieldMap("return_altitude_m", "RTL_ALT", _CM, low=0.3, high=3000.0),
    FieldMap("return_descend_altitude_m", "RTL_ALT_FINAL", _CM, low=0.0, high=1000.0),
    FieldMap("return_loiter_time_s", "RTL_LOIT_TIME", 1e-3, low=0.0, high=60.0),
    FieldMap("return_climb_min_m", "RTL_CLIMB_MIN", _CM, low=0.0, high=30.0),
    FieldMap("orbit_radius_m", "CIRCLE_RADIUS", _CM, low=0.5, high=2000.0),
    FieldMap("manual_speed_m_s", "LOIT_SPEED", _CM, low=0.2, high=35.0),
    FieldMap("manual_climb_speed_m_s", "PILOT_SPEED_UP", _CM, low=0.5, high=5.0),
    FieldMap("manual_tilt_rad", "ANGLE_MAX", _CENTIDEGREE, low=0.17, high=1.4),
    FieldMap("manual_yaw_rate_rad_s", "PILOT_Y_RATE", _DEG, low=0.02, high=6.3),
    FieldMap("acro_rate_rad_s", "ACRO_RP_RATE", _DEG, low=0.02, high=18.0),
    FieldMap("acro_yaw_rate_rad_s", "ACRO_Y_RATE", _DEG, low=0.02, high=6.3),
    FieldMap("manual_expo", "ACRO_RP_EXPO", low=0.0, high=0.95),
    FieldMap("guided_timeout_s", "GUID_TIMEOUT", low=0.1, high=5.0),
)

CONTROLLER: Final = (
    FieldMap("pos_xy_p_1_s", "PSC_POSXY_P", low=0.05, high=4.0),
    FieldMap("pos_z_p_1_s", "PSC_POSZ_P", low=0.05, high=4.0),
    FieldMap("vel_xy_p_1_s", "PSC_VELXY_P", low=0.1, high=6.0),
    FieldMap("vel_xy_i_1_s2", "PSC_VELXY_I", low=0.0, high=4.0),
    FieldMap("vel_xy_d", "PSC_VELXY_D", low=0.0, high=1.0),
    FieldMap("roll_p_1_s", "ATC_ANG_RLL_P", low=1.0, high=12.0),
    FieldMap("pitch_p_1_s", "ATC_ANG_PIT_P", low=1.0, high=12.0),
    FieldMap("yaw_p_1_s", "ATC_ANG_YAW_P", low=0.5, high=12.0),
    FieldMap("rate_roll_p", "ATC_RAT_RLL_P", low=0.001, high=0.5),
    FieldMap("rate_roll_i", "ATC_RAT_RLL_I", low=0.0, high=2.0),
    FieldMap("rate_roll_d", "ATC_RAT_RLL_D", low=0.0, high=0.05),
    FieldMap("rate_roll_ff", "ATC_RAT_RLL_FF", low=0.0, high=0.5),
    FieldMap("rate_roll_integral_max", "ATC_RAT_RLL_IMAX", low=0.0, high=1.0),
    FieldMap("rate_pitch_p", "ATC_RAT_PIT_P", low=0.001, high=0.5),
    FieldMap("rate_pitch_i", "ATC_RAT_PIT_I", low=0.0, high=2.0),
    FieldMap("rate_pitch_d", "ATC_RAT_PIT_D", low=0.0, high=0.05),
    FieldMap("rate_pitch_ff", "ATC_RAT_PIT_FF", low=0.0, high=0.5),
    FieldMap("rate_pitch_integral_max", "ATC_RAT_PIT_IMAX", low=0.0, high=1.0),
    FieldMap("rate_yaw_p", "ATC_RAT_YAW_P", low=0.001, high=2.5),
    FieldMap("rate_yaw_i", "ATC_RAT_YAW_I", low=0.0, high=1.0),
    FieldMap("rate_yaw_d", "ATC_RAT_YAW_D", low=0.0, high=0.02),
    FieldMap("rate_yaw_ff", "ATC_RAT_YAW_FF", low=0.0, high=0.5),
    FieldMap("rate_yaw_integral_max", "ATC_RAT_YAW_IMAX", low=0.0, high=1.0),
    FieldMap("hover_thrust", "MOT_THST_HOVER", low=0.1, high=0.8),
    FieldMap("thrust_model_factor", "MOT_THST_EXPO", low=0.0, high=1.0),
    FieldMap("motor_idle", "MOT_SPIN_ARM", low=0.0, high=0.3),
)

NAVIGATION: Final = (
    FieldMap("gps_gate", "EK3_POS_I_GATE", 0.01, low=1.0, high=10.0),
    FieldMap("gps_velocity_gate", "EK3_VEL_I_GATE", 0.01, low=1.0, high=10.0),
    FieldMap("barometer_gate", "EK3_HGT_I_GATE", 0.01, low=1.0, high=10.0),
    FieldMap("magnetometer_gate", "EK3_MAG_I_GATE", 0.01, low=1.0, high=10.0),
    FieldMap("no_aid_noise_m", "EK3_NOAID_M_NSE", low=0.5, high=50.0),
)

NAVIGATION_RATIOS: Final = (
    RatioMap(
        (
            "gps_required_eph_m",
            "gps_required_epv_m",
            "gps_required_speed_accuracy_m_s",
            "gps_required_hdop",
        ),
        "EK3_CHECK_SCALE",
    ),
)
_SOURCE_GPS: Final = 3  # of EK3_SRC1_POSXY


def commander_parameters(store: ParameterStore) -> CommanderParameters:
    """FS_*, FENCE_*, BATT_*, DISARM_DELAY, ARMING_CHECK (ArduCopter 4.6 parameter reference)."""
    options = integer(store, "FS_OPTIONS", 16)
    gcs = integer(store, "FS_GCS_ENABLE", 0)
    radio = integer(store, "FS_THR_ENABLE", 1)
    capacity_mah = max(1.0, number(store, "BATT_CAPACITY", 3300.0))
    monitored = integer(store, "BATT_MONITOR", 4) != 0
    return CommanderParameters(
        offboard_loss_s=_NEVER_S,
        offboard_loss_action=FailsafeAction.NONE,
        gcs_loss_s=clamp(number(store, "FS_GCS_TIMEOUT", 5.0), 2.0, 120.0) if gcs else 0.0,
        gcs_loss_action=_GCS.get(gcs, FailsafeAction.RETURN),
        gcs_loss_exempt=_exempt(
            options,
            {
                _CONTINUE_AUTO_ON_GCS: (FlightMode.MISSION,),
                _CONTINUE_LANDING: (FlightMode.LAND,),
                _CONTINUE_PILOT_ON_GCS: (*STICK_MODES, FlightMode.HOLD),
            },
        ),
        stick_timeout_s=clamp(number(store, "RC_OVERRIDE_TIME", 3.0), 0.1, 120.0),
        crash_check=integer(store, "FS_CRASH_CHECK", 1) != 0,
        manual_loss_s=1.0 if radio else 0.0,
        manual_loss_action=_RADIO.get(radio, FailsafeAction.LAND),
        manual_loss_exempt=_exempt(
            options,
            {
                _CONTINUE_AUTO_ON_RADIO: (FlightMode.MISSION,),
                _CONTINUE_GUIDED_ON_RADIO: (FlightMode.GUIDED, FlightMode.GUIDED_NOGPS),
                _CONTINUE_LANDING: (FlightMode.LAND,),
            },
        ),
        action_delay_s=0.0,
        battery_low_remaining=clamp(number(store, "BATT_LOW_MAH", 0.0) / capacity_mah, 0.0, 1.0),
        battery_critical_remaining=clamp(number(store, "BATT_CRT_MAH", 0.0) / capacity_mah, 0.0, 1.0),
        battery_emergency_remaining=0.0,
        battery_low_v=clamp(number(store, "BATT_LOW_VOLT", 10.5), 0.0, 1e3) if monitored else 0.0,
        battery_critical_v=clamp(number(store, "BATT_CRT_VOLT", 0.0), 0.0, 1e3) if monitored else 0.0,
        battery_timer_s=clamp(number(store, "BATT_LOW_TIMER", 10.0), 0.0, 120.0),
        battery_low_action=_BATTERY.get(integer(store, "BATT_FS_LOW_ACT", 0), FailsafeAction.WARN),
        battery_critical_action=_BATTERY.get(integer(store, "BATT_FS_CRT_ACT", 0), FailsafeAction.WARN),
        battery_emergency_action=FailsafeAction.WARN,
        position_loss_s=POSITION_LOSS_S,
        position_loss_action=_EKF.get(integer(store, "FS_EKF_ACTION", 1), FailsafeAction.LAND),
        fence=fence_parameters(store, _FENCE, give_up_m=_GIVE_UP_M),
        disarm_preflight_s=clamp(number(store, "DISARM_DELAY", 10.0), 0.0, 127.0),
        disarm_landed_s=1.0,
        stick_override=False,
        stick_override_offboard=False,
        stick_override_threshold=1.0,
        check_arming=integer(store, "ARMING_CHECK", 1) != 0,
        follow_enabled=integer(store, "FOLL_ENABLE", 0) != 0,
    )


def fence_parameters(
    store: ParameterStore,
    actions: Mapping[int, FailsafeAction],
    *,
    give_up_m: float = 0.0,
    backup_m: float = 20.0,
) -> FenceParameters:
    """FENCE_*.

    Args:
        actions: what each FENCE_ACTION does on this vehicle; any other only reports.
        give_up_m: farther outside the vehicle lands; 0: never.
        backup_m: so much farther out the circle counts as broken once more.
    """
    types = FenceType(integer(store, "FENCE_TYPE", 7) & int(ALL_FENCES))
    options = integer(store, "FENCE_OPTIONS", 0)
    auto = integer(store, "FENCE_AUTOENABLE", 0)
    limit = clamp(number(store, "FENCE_ALT_MAX", 100.0), 1e-3, 1e6)
    return FenceParameters(
        enabled=bool(integer(store, "FENCE_ENABLE", 0)),
        action=actions.get(integer(store, "FENCE_ACTION", 1), FailsafeAction.WARN),
        radius_m=clamp(number(store, "FENCE_RADIUS", 150.0), 1e-3, 1e6) if FenceType.CIRCLE in types else 0.0,
        height_max_m=limit if FenceType.HEIGHT_MAX in types else 0.0,
        floor=FenceType.HEIGHT_MIN in types,
        height_min_m=clamp(number(store, "FENCE_ALT_MIN", -10.0), -1e5, 1e5),
        shapes=FenceType.SHAPES in types,
        margin_m=clamp(number(store, "FENCE_MARGIN", 2.0), 0.0, 1e3),
        inclusions_join=bool(options & _UNION),
        locks_mode=bool(options & _LOCKS_MODE),
        auto_enable=AutoEnable(auto) if auto in tuple(AutoEnable) else AutoEnable.OFF,
        give_up_m=give_up_m,
        backup_radius_m=backup_m,
        backup_height_m=20.0,
        return_to_rally=bool(integer(store, "FENCE_RET_RALLY", 0)),
        return_height_m=clamp(number(store, "FENCE_RET_ALT", 0.0), 0.0, 1e5),
        counts_breaches=True,
    )


def rally_rule(store: ParameterStore, *, within_fence: bool) -> RallyRule:
    """RALLY_*."""
    limit_km = clamp(number(store, "RALLY_LIMIT_KM", 0.3), 0.0, 1e5)
    return RallyRule(
        home_competes=bool(integer(store, "RALLY_INCL_HOME", 1)),
        limit_m=1e3 * limit_km if limit_km > 0.0 else math.inf,
        within_fence=within_fence,
        altitude_is_ground=False,
    )


def flight_parameters(store: ParameterStore) -> FlightParameters:
    """WPNAV_*, RTL_*, LAND_*, LOIT_*, PILOT_*, CIRCLE_*, GUID_TIMEOUT."""
    fixed: dict[str, object] = {"use_waypoint_yaw": False, "return_loiters_high": True}
    climb_m_s = clamp(number(store, "PILOT_SPEED_UP", 250.0) * _CM, 0.5, 5.0)
    descend_m_s = clamp(number(store, "PILOT_SPEED_DN", 0.0) * _CM, 0.0, 5.0)
    fixed["manual_descend_speed_m_s"] = descend_m_s or climb_m_s  # 0: as fast as up
    cruise_m_s = clamp(number(store, "WPNAV_SPEED", 1000.0) * _CM, 0.2, 20.0)
    return_m_s = clamp(number(store, "RTL_SPEED", 0.0) * _CM, 0.0, 20.0)
    fixed["return_speed_m_s"] = return_m_s or cruise_m_s  # 0: WPNAV_SPEED
    fast_landing_m_s = clamp(number(store, "LAND_SPEED_HIGH", 0.0) * _CM, 0.0, 5.0)
    if fast_landing_m_s:
        fixed["land_descend_speed_m_s"] = fast_landing_m_s
    slope = clamp(number(store, "RTL_CONE_SLOPE", 3.0), 0.0, 10.0)
    fixed["return_cone_half_angle_rad"] = math.atan(1.0 / slope) if slope else 0.0
    fixed["return_min_distance_m"] = math.inf
    behaviour = {1: YawBehaviour.TOWARDS_TARGET, 2: YawBehaviour.TOWARDS_TARGET, 3: YawBehaviour.ALONG_TRACK}
    fixed["yaw_behaviour"] = behaviour.get(integer(store, "WP_YAW_BEHAVIOR", 2), YawBehaviour.KEEP)
    radius_m = clamp(number(store, "CIRCLE_RADIUS", 1000.0) * _CM, 0.5, 2000.0)
    rate_rad_s = clamp(abs(number(store, "CIRCLE_RATE", 20.0)) * _DEG, 0.01, 1.6)
    fixed["orbit_speed_m_s"] = clamp(radius_m * rate_rad_s, 0.1, 20.0)
    corner = number(store, "WPNAV_ACCEL_C", 0.0) * _CM
    if corner > 0.0:
        fixed["corner_acceleration_m_s2"] = clamp(corner, 0.5, 5.0)
    fence = fence_parameters(store, _FENCE)
    if fence.enabled and fence.height_max_m > 0.0:
        fixed["return_height_max_m"] = max(1.0, fence.height_max_m - fence.margin_m)
    fixed["return_stays_at_m"] = clamp(number(store, "RTL_ALT_FINAL", 0.0) * _CM, 0.0, 1000.0)
    fixed["rally"] = rally_rule(store, within_fence=True)
    fixed["nose_follows_roi"] = not integer(store, "MNT1_TYPE", 0)
    fixed["follow"] = ardupilot_follow(store)
    fixed["precision"] = ardupilot_precision(store)
    fixed["avoidance"] = ardupilot_avoidance(store)
    return build(FlightParameters, store, FLIGHT, **fixed)


def controller_parameters(store: ParameterStore) -> MulticopterParameters:
    """PSC_*, ATC_*, MOT_*, ANGLE_MAX."""
    return build(
        MulticopterParameters,
        store,
        CONTROLLER,
        speed_xy_max_m_s=max(12.0, clamp(number(store, "WPNAV_SPEED", 1000.0) * _CM, 0.2, 20.0)),
        speed_up_max_m_s=max(3.0, clamp(number(store, "WPNAV_SPEED_UP", 250.0) * _CM, 0.1, 10.0)),
        speed_down_max_m_s=max(1.5, clamp(number(store, "WPNAV_SPEED_DN", 150.0) * _CM, 0.1, 5.0)),
        tilt_max_rad=clamp(number(store, "ANGLE_MAX", 3000.0) * _CENTIDEGREE, 0.17, 1.4),
    )


def navigation_parameters(store: ParameterStore) -> NavigationParameters:
    """EK3_*: noise and gates; EK3_CHECK_SCALE relative to ArduPilot's default.

    GPS is fused as a whole, when EK3_SRC1_POSXY names it.
    """
    return build(
        NavigationParameters,
        store,
        NAVIGATION,
        use_gps=gps_is_fused(store),
        gps_may_repeat=ardupilot_gps_source(store) is GpsSource.MESSAGES,
        external=ardupilot_external(store),
        **ardupilot_noise(store),
        **scaled_values(NavigationParameters(), store, NAVIGATION_RATIOS),
    )


def gps_is_fused(store: ParameterStore) -> bool:
    """EK3_SRC1_POSXY names GPS."""
    return integer(store, "EK3_SRC1_POSXY", _SOURCE_GPS) == _SOURCE_GPS


def _exempt(options: int, table: Mapping[int, tuple[FlightMode, ...]]) -> frozenset[FlightMode]:
    return frozenset(mode for bit, modes in table.items() if options & bit for mode in modes)
