"""PX4's fixed-wing parameters to the typed parameters of commander, flight tasks, control laws and filter.

What an aircraft's airframe file would set comes from its flight envelope (`airframe_overrides`); what PX4 has
no parameter for is taken from the envelope too.
"""

import math
from dataclasses import replace
from typing import Any, Final

from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.firmware import mapping
from autopilot_bridge.firmware.mapping import (
    FieldMap,
    RatioMap,
    build,
    clamp,
    field_values,
    integer,
    number,
    scaled_values,
)
from autopilot_bridge.firmware.navigation_noise import px4_noise
from autopilot_bridge.firmware.plane_limits import (
    controller_values,
    flight_values,
    only_in,
    tuned_controller,
    tuned_flight,
)
from autopilot_bridge.firmware.px4.copter import mapping as px4_mapping
from autopilot_bridge.firmware.px4.plane.parameters import PX4_PLANE_PARAMETERS
from autopilot_bridge.flight.fixed_wing.parameters import (
    FixedWingFlightParameters,
    LaunchKind,
    TurnInRule,
)
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.parameters import ParameterStore
from flightsim.flight_envelope import FlightEnvelope

_DEG: Final = math.radians(1.0)
_TERMINATION_OFF: Final = 121212  # CBRK_FLIGHTTERM
_DATA_CHECKS: Final = 1 | 2 | 4  # ASPD_DO_CHECKS: missing, stuck, innovation
_NEVER_S: Final = 1e6
_ROTATION_SHARE: Final = 0.9  # RWTO_ROT_AIRSPD -1: of the climb-out's airspeed

_LOW_ACCURACY: Final = {
    0: FailsafeAction.NONE,
    1: FailsafeAction.WARN,
    2: FailsafeAction.HOLD,
    3: FailsafeAction.RETURN,
    4: FailsafeAction.TERMINATE,
    5: FailsafeAction.LAND,
}  # COM_POS_LOW_ACT

CONTROLLER: Final = (
    FieldMap("airspeed_stall_m_s", "FW_AIRSPD_STALL", low=1.0, high=200.0),
    FieldMap("airspeed_min_m_s", "FW_AIRSPD_MIN", low=1.0, high=300.0),
    FieldMap("airspeed_trim_m_s", "FW_AIRSPD_TRIM", low=1.0, high=300.0),
    FieldMap("airspeed_max_m_s", "FW_AIRSPD_MAX", low=1.0, high=400.0),
    FieldMap("scaling_airspeed_m_s", "FW_AIRSPD_TRIM", low=1.0, high=300.0),
    FieldMap("ground_speed_min_m_s", "FW_GND_SPD_MIN", low=0.0, high=40.0),
    FieldMap("roll_limit_rad", "FW_R_LIM", _DEG, low=0.2, high=1.3),
    FieldMap("roll_slew_rad_s", "FW_PN_R_SLEW_MAX", _DEG, low=0.05, high=7.0),
    FieldMap("trim_throttle", "FW_THR_TRIM", low=0.0, high=1.0),
    FieldMap("trim_throttle_min_speed", "FW_THR_ASPD_MIN", low=0.0, high=1.0),
    FieldMap("trim_throttle_max_speed", "FW_THR_ASPD_MAX", low=0.0, high=1.0),
    FieldMap("throttle_min", "FW_THR_MIN", low=0.0, high=0.5),
    FieldMap("throttle_max", "FW_THR_MAX", low=0.1, high=1.0),
    FieldMap("throttle_slew_1_s", "FW_THR_SLEW_MAX", low=0.0, high=100.0),
    FieldMap("pitch_min_rad", "FW_P_LIM_MIN", _DEG, low=-1.3, high=-0.05),
    FieldMap("pitch_max_rad", "FW_P_LIM_MAX", _DEG, low=0.05, high=1.3),
    FieldMap("trim_pitch_rad", "FW_PSP_OFF", _DEG, low=-0.3, high=0.3),
    FieldMap("climb_max_m_s", "FW_T_CLMB_MAX", low=0.1, high=200.0),
    FieldMap("sink_min_m_s", "FW_T_SINK_MIN", low=0.05, high=100.0),
    FieldMap("sink_max_m_s", "FW_T_SINK_MAX", low=0.1, high=200.0),
    FieldMap("climb_rate_target_m_s", "FW_T_CLMB_R_SP", low=0.05, high=200.0),
    FieldMap("sink_rate_target_m_s", "FW_T_SINK_R_SP", low=0.05, high=200.0),
    FieldMap("height_time_constant_s", "FW_T_ALT_TC", low=0.5, high=100.0),
    FieldMap("airspeed_time_constant_s", "FW_T_TAS_TC", low=0.5, high=100.0),
    FieldMap("height_rate_ff", "FW_T_HRATE_FF", low=0.0, high=1.0),
    FieldMap("energy_balance_ff", "FW_T_SEB_R_FF", low=0.0, high=1.5),
    FieldMap("pitch_damping", "FW_T_PTCH_DAMP", low=0.0, high=2.0),
    FieldMap("pitch_integral_1_s", "FW_T_I_GAIN_PIT", low=0.0, high=2.0),
    FieldMap("throttle_damping", "FW_T_THR_DAMPING", low=0.0, high=1.0),
    FieldMap("throttle_integral_1_s", "FW_T_THR_INTEG", low=0.0, high=1.0),
    FieldMap("speed_weight", "FW_T_SPDWEIGHT", low=0.0, high=2.0),
    FieldMap("energy_rate_time_constant_s", "FW_T_STE_R_TC", low=0.0, high=2.0),
    FieldMap("vertical_acceleration_max_m_s2", "FW_T_VERT_ACC", low=1.0, high=20.0),
    FieldMap("turn_energy_rate_m2_s3", "FW_T_RLL2THR", low=0.0, high=1e4),
    FieldMap("airspeed_noise_m_s", "FW_T_SPD_STD", low=0.01, high=10.0),
    FieldMap("airspeed_rate_noise_m_s2", "FW_T_SPD_DEV_STD", low=0.01, high=10.0),
    FieldMap("airspeed_rate_process_noise_m_s2", "FW_T_SPD_PRC_STD", low=0.01, high=10.0),
    FieldMap("roll_time_constant_s", "FW_R_TC", low=0.1, high=10.0),
    FieldMap("pitch_time_constant_s", "FW_P_TC", low=0.1, high=10.0),
    FieldMap("roll_rate_max_rad_s", "FW_R_RMAX", _DEG, low=0.05, high=6.3),
    FieldMap("pitch_rate_max_up_rad_s", "FW_P_RMAX_POS", _DEG, low=0.05, high=6.3),
    FieldMap("pitch_rate_max_down_rad_s", "FW_P_RMAX_NEG", _DEG, low=0.05, high=6.3),
    FieldMap("yaw_rate_max_rad_s", "FW_Y_RMAX", _DEG, low=0.05, high=6.3),
    FieldMap("rate_roll_p", "FW_RR_P", low=0.0, high=10.0),
    FieldMap("rate_roll_i", "FW_RR_I", low=0.0, high=10.0),
    FieldMap("rate_roll_d", "FW_RR_D", low=0.0, high=0.1),
    FieldMap("rate_roll_ff", "FW_RR_FF", low=0.0, high=10.0),
    FieldMap("rate_roll_integral_max", "FW_RR_IMAX", low=0.0, high=1.0),
    FieldMap("rate_pitch_p", "FW_PR_P", low=0.0, high=10.0),
    FieldMap("rate_pitch_i", "FW_PR_I", low=0.0, high=10.0),
    FieldMap("rate_pitch_d", "FW_PR_D", low=0.0, high=0.1),
    FieldMap("rate_pitch_ff", "FW_PR_FF", low=0.0, high=10.0),
    FieldMap("rate_pitch_integral_max", "FW_PR_IMAX", low=0.1, high=1.0),
    FieldMap("rate_yaw_p", "FW_YR_P", low=0.0, high=10.0),
    FieldMap("rate_yaw_i", "FW_YR_I", low=0.0, high=10.0),
    FieldMap("rate_yaw_d", "FW_YR_D", low=0.0, high=0.1),
    FieldMap("rate_yaw_ff", "FW_YR_FF", low=0.0, high=10.0),
    FieldMap("rate_yaw_integral_max", "FW_YR_IMAX", low=0.0, high=1.0),
    FieldMap("rate_derivative_cutoff_hz", "IMU_DGYRO_CUTOFF", low=1.0, high=100.0),
    FieldMap("roll_to_rudder_ff", "FW_RLL_TO_YAW_FF", low=0.0, high=1.0),
    FieldMap("trim_aileron", "TRIM_ROLL", low=-0.5, high=0.5),
    FieldMap("trim_elevator", "TRIM_PITCH", low=-0.5, high=0.5),
    FieldMap("trim_rudder", "TRIM_YAW", low=-0.5, high=0.5),
    FieldMap("wheel_rate_max_rad_s", "FW_W_RMAX", _DEG, low=0.05, high=1.6),
    FieldMap("wheel_p", "FW_WR_P", low=0.0, high=10.0),
    FieldMap("wheel_i", "FW_WR_I", low=0.0, high=10.0),
    FieldMap("wheel_integral_max", "FW_WR_IMAX", low=0.0, high=1.0),
    FieldMap("wheel_ff", "FW_WR_FF", low=0.0, high=10.0),
)

AIRFRAME_FLIGHT: Final = (
    FieldMap("airspeed_min_m_s", "FW_AIRSPD_MIN", low=1.0, high=300.0),
    FieldMap("airspeed_trim_m_s", "FW_AIRSPD_TRIM", low=1.0, high=300.0),
    FieldMap("airspeed_max_m_s", "FW_AIRSPD_MAX", low=1.0, high=400.0),
    FieldMap("climb_rate_m_s", "FW_T_CLMB_R_SP", low=0.05, high=200.0),
    FieldMap("sink_rate_m_s", "FW_T_SINK_R_SP", low=0.05, high=200.0),
    FieldMap("bank_max_rad", "FW_R_LIM", _DEG, low=0.2, high=1.3),
    FieldMap("pitch_max_rad", "FW_P_LIM_MAX", _DEG, low=0.05, high=1.3),
    FieldMap("pitch_min_rad", "FW_P_LIM_MIN", _DEG, low=-1.3, high=-0.05),
    FieldMap("trim_throttle", "FW_THR_TRIM", low=0.0, high=1.0),
    FieldMap("guidance_period_s", "NPFG_PERIOD", low=2.0, high=100.0),
    FieldMap("guidance_damping", "NPFG_DAMPING", low=0.3, high=1.0),
    FieldMap("guidance_period_safety", "NPFG_PERIOD_SF", low=1.0, high=10.0),
    FieldMap("roll_time_constant_s", "NPFG_ROLL_TC", low=0.05, high=2.0),
    FieldMap("switch_distance_multiplier", "NPFG_SW_DST_MLT", low=0.1, high=1.0),
    FieldMap("loiter_radius_m", "NAV_LOITER_RAD", low=10.0, high=1e4),
    FieldMap("return_loiter_radius_m", "RTL_LOITER_RAD", low=10.0, high=1e4),
    FieldMap("takeoff_airspeed_m_s", "FW_TKO_AIRSPD", low=1.0, high=300.0),
    FieldMap("takeoff_pitch_min_rad", "FW_TKO_PITCH_MIN", _DEG, low=0.02, high=0.6),
    FieldMap("takeoff_throttle_max", "RWTO_MAX_THR", low=0.3, high=1.0),
    FieldMap("takeoff_throttle_ramp_s", "RWTO_RAMP_TIME", low=0.0, high=15.0),
    FieldMap("takeoff_roll_pitch_rad", "RWTO_PSP", _DEG, low=-0.17, high=0.35),
    FieldMap("rotation_airspeed_m_s", "RWTO_ROT_AIRSPD", low=1.0, high=300.0),
    FieldMap("rotation_time_s", "RWTO_ROT_TIME", low=0.1, high=10.0),
    FieldMap("launch_acceleration_m_s2", "FW_LAUN_AC_THLD", low=1.0, high=200.0),
    FieldMap("launch_time_s", "FW_LAUN_AC_T", low=0.0, high=5.0),
    FieldMap("launch_delay_s", "FW_LAUN_MOT_DEL", low=0.0, high=10.0),
    FieldMap("landing_angle_rad", "FW_LND_ANG", _DEG, low=0.017, high=0.26),
    FieldMap("landing_airspeed_m_s", "FW_LND_AIRSPD", low=1.0, high=300.0),
    FieldMap("flare_height_m", "FW_LND_FLALT", low=0.05, high=30.0),
    FieldMap("flare_time_s", "FW_LND_FL_TIME", low=0.1, high=5.0),
    FieldMap("flare_sink_m_s", "FW_LND_FL_SINK", low=0.05, high=2.0),
    FieldMap("flare_pitch_min_rad", "FW_LND_FL_PMIN", _DEG, low=-0.09, high=0.26),
    FieldMap("flare_pitch_max_rad", "FW_LND_FL_PMAX", _DEG, low=0.02, high=0.6),
    FieldMap("flaps_takeoff", "FW_FLAPS_TO_SCL", low=0.0, high=1.0),
    FieldMap("flaps_landing", "FW_FLAPS_LND_SCL", low=0.0, high=1.0),
    FieldMap("manual_bank_max_rad", "FW_MAN_R_MAX", _DEG, low=0.1, high=1.3),
    FieldMap("manual_pitch_max_rad", "FW_MAN_P_MAX", _DEG, low=0.05, high=1.3),
)
"""What an airframe file sets of the flight tasks."""

FLIGHT: Final = (
    *AIRFRAME_FLIGHT,
    FieldMap("climb_max_m_s", "FW_T_CLMB_MAX", low=0.0, high=200.0),
    FieldMap("sink_max_m_s", "FW_T_SINK_MAX", low=0.1, high=200.0),
    FieldMap("trim_pitch_rad", "FW_PSP_OFF", _DEG, low=-0.3, high=0.3),
    FieldMap("throttle_idle", "FW_THR_IDLE", low=0.0, high=0.4),
    FieldMap("acceptance_radius_m", "NAV_ACC_RAD", low=0.5, high=200.0),
    FieldMap("acceptance_altitude_m", "NAV_FW_ALT_RAD", low=0.5, high=200.0),
    FieldMap("takeoff_altitude_m", "MIS_TAKEOFF_ALT", low=5.0, high=5000.0),
    FieldMap("landing_abort_climb_m", "MIS_LND_ABRT_ALT", low=5.0, high=1000.0),
    FieldMap("return_altitude_m", "RTL_RETURN_ALT", low=5.0, high=5000.0),
    FieldMap("return_descend_altitude_m", "RTL_DESCEND_ALT", low=5.0, high=5000.0),
    FieldMap("return_loiter_time_s", "RTL_LAND_DELAY", low=-1.0, high=36000.0),
    FieldMap("manual_pitch_down_max_rad", "FW_MAN_P_MAX", _DEG, low=0.05, high=1.3),
    FieldMap("acro_roll_rate_rad_s", "FW_ACRO_X_MAX", _DEG, low=0.1, high=12.6),
    FieldMap("acro_pitch_rate_rad_s", "FW_ACRO_Y_MAX", _DEG, low=0.1, high=12.6),
    FieldMap("acro_yaw_rate_rad_s", "FW_ACRO_Z_MAX", _DEG, low=0.1, high=12.6),
    FieldMap("position_lost_bank_rad", "FW_GPSF_R", _DEG, low=0.02, high=0.6),
    FieldMap("position_lost_wait_s", "FW_GPSF_LT", low=0.0, high=3600.0),
)

NAVIGATION: Final = (
    *px4_mapping.NAVIGATION,
    FieldMap("airspeed_gate", "EKF2_TAS_GATE", low=1.0, high=20.0),
    FieldMap("sideslip_gate", "EKF2_BETA_GATE", low=1.0, high=20.0),
    FieldMap("airspeed_scale", "ASPD_SCALE_1", low=0.5, high=2.0),
    FieldMap("airspeed_check_innovation_m_s", "ASPD_FS_INNOV", low=0.5, high=20.0),
    FieldMap("airspeed_check_integral_m", "ASPD_FS_INTEG", low=0.5, high=100.0),
    FieldMap("airspeed_stop_delay_s", "ASPD_FS_T_STOP", low=0.1, high=60.0),
)

NAVIGATION_RATIOS: Final = (
    *px4_mapping.NAVIGATION_RATIOS,
    RatioMap(("airspeed_noise_m_s",), "EKF2_EAS_NOISE"),
    RatioMap(("sideslip_noise_rad",), "EKF2_BETA_NOISE"),
    RatioMap(("wind_walk_m_s_sqrt_s",), "EKF2_WIND_NSD"),
)
"""Of the air, relative to the defaults: theirs contain the gusts, which the filter measures apart."""


def airframe_overrides(envelope: FlightEnvelope) -> dict[str, float]:
    """Parameters that an airframe file for this aircraft sets, with their values."""
    flight = tuned_flight(envelope)
    span_m = max(0.2, envelope.wing_span_m)
    threshold_m_s = min(8.0, 0.8 * envelope.airspeed_min_m_s)  # airspeed counts in every flight
    return {
        **mapping.airframe_overrides(
            tuned_controller(envelope), only_in(CONTROLLER, AIRFRAME_FLIGHT), PX4_PLANE_PARAMETERS
        ),
        **mapping.airframe_overrides(flight, AIRFRAME_FLIGHT, PX4_PLANE_PARAMETERS),
        "FW_WING_SPAN": span_m,
        "FW_WING_HEIGHT": 0.5 * span_m * math.sin(flight.ground_bank_max_rad),
        "EKF2_ARSP_THR": threshold_m_s,
        **({} if envelope.powered else {"CA_ROTOR_COUNT": 0}),
    }


def commander_parameters(store: ParameterStore) -> CommanderParameters:
    """The parameters of the multicopter, and those that PX4 uses on an aircraft: COM_POS_*, FD_FAIL_*."""
    accuracy_m = number(store, "COM_POS_FS_EPH", 50.0)
    terminates = integer(store, "CBRK_FLIGHTTERM", _TERMINATION_OFF) != _TERMINATION_OFF
    return replace(
        px4_mapping.commander_parameters(store),
        position_accuracy_max_m=math.inf if accuracy_m <= 0.0 else clamp(accuracy_m, 1.0, 1e4),
        position_accuracy_low_m=clamp(number(store, "COM_POS_LOW_EPH", 50.0), 0.0, 1e4),
        position_accuracy_low_action=_LOW_ACCURACY.get(
            integer(store, "COM_POS_LOW_ACT", 3), FailsafeAction.WARN
        ),
        attitude_roll_max_rad=clamp(number(store, "FD_FAIL_R", 60.0), 0.0, 180.0) * _DEG,
        attitude_pitch_max_rad=clamp(number(store, "FD_FAIL_P", 60.0), 0.0, 180.0) * _DEG,
        attitude_time_s=clamp(number(store, "FD_FAIL_R_TTRI", 0.3), 0.02, 5.0),
        attitude_action=FailsafeAction.TERMINATE if terminates else FailsafeAction.WARN,
    )


def controller_parameters(
    store: ParameterStore, envelope: FlightEnvelope | None = None
) -> FixedWingParameters:
    """FW_*, NPFG_*, TRIM_*; fields without a parameter, and limits, from the envelope."""
    tuned = tuned_controller(envelope)
    values: dict[str, Any] = field_values(store, CONTROLLER)
    period_s = clamp(number(store, "NPFG_PERIOD", 10.0), 2.0, 100.0)
    damping = clamp(number(store, "NPFG_DAMPING", 0.7), 0.3, 1.0)
    values["heading_p_1_s"] = 4.0 * math.pi * damping / period_s
    values["airspeed_scaling"] = bool(integer(store, "FW_ARSP_SCALE_EN", 1))
    values["powered"] = tuned.powered and integer(store, "CA_ROTOR_COUNT", 1) > 0
    return replace(tuned, **controller_values(values, tuned))


def flight_parameters(
    store: ParameterStore, envelope: FlightEnvelope | None = None
) -> FixedWingFlightParameters:
    """FW_*, NPFG_*, RWTO_*, NAV_*, MIS_*, RTL_*; the rest, and limits, from the envelope."""
    tuned, controller = tuned_flight(envelope), tuned_controller(envelope)
    values: dict[str, Any] = field_values(store, FLIGHT)
    least_m_s = values["airspeed_min_m_s"]
    if number(store, "FW_TKO_AIRSPD", -1.0) <= 0.0:
        values["takeoff_airspeed_m_s"] = least_m_s
    if number(store, "RWTO_ROT_AIRSPD", -1.0) <= 0.0:
        values["rotation_airspeed_m_s"] = _ROTATION_SHARE * values["takeoff_airspeed_m_s"]
    if number(store, "FW_LND_AIRSPD", -1.0) <= 0.0:
        values["landing_airspeed_m_s"] = least_m_s
    half_span_m = 0.5 * max(0.1, number(store, "FW_WING_SPAN", 3.0))
    height_m = clamp(number(store, "FW_WING_HEIGHT", 0.5), 0.0, half_span_m)
    values["ground_bank_max_rad"] = clamp(math.asin(height_m / half_span_m), 0.03, 0.35)
    values["guidance_period_lower_bound"] = bool(integer(store, "NPFG_LB_PERIOD", 1))
    values["guidance_period_upper_bound"] = bool(integer(store, "NPFG_UB_PERIOD", 1))
    values["turn_in"] = TurnInRule.SWITCH_DISTANCE
    values["launch"] = _launch(store)
    values["rangefinder_landing"] = integer(store, "FW_LND_USETER", 1) > 0
    values["return_destination"], values["rally"] = px4_mapping.return_rules(store, default=1)
    values["return_climbs"] = True
    values["return_cone_half_angle_rad"] = 0.0  # RTL_CONE_ANG is the multicopter's
    return replace(tuned, **flight_values(values, tuned, controller))


def navigation_parameters(store: ParameterStore) -> NavigationParameters:
    """EKF2_*, ASPD_*: as for the multicopter, and wind, airspeed and sideslip."""
    satellites = integer(store, "EKF2_REQ_NSATS", 6)
    threshold_m_s = number(store, "EKF2_ARSP_THR", 8.0)
    start_s = number(store, "ASPD_FS_T_START", -1.0)
    return build(
        NavigationParameters,
        store,
        NAVIGATION,
        gps_required_satellites=max(4, min(12, satellites)),
        use_gps=px4_mapping.gps_is_fused(store),
        fixed_wing=True,
        use_airspeed=threshold_m_s > 0.0
        and integer(store, "ASPD_PRIMARY", 1) > 0
        and integer(store, "FW_USE_AIRSPD", 1) > 0,
        airspeed_threshold_m_s=clamp(threshold_m_s, 1.0, 50.0),
        use_sideslip=integer(store, "EKF2_FUSE_BETA", 1) > 0,
        airspeed_checks=bool(integer(store, "ASPD_DO_CHECKS", 7) & _DATA_CHECKS),
        airspeed_start_delay_s=_NEVER_S if start_s < 0.0 else clamp(start_s, 0.1, _NEVER_S),
        **px4_noise(store),
        **scaled_values(NavigationParameters(), store, NAVIGATION_RATIOS),
    )


def _launch(store: ParameterStore) -> LaunchKind:
    """A runway take-off unless a launch is to be detected (RWTO_TKOFF, FW_LAUN_DETCN_ON)."""
    if integer(store, "RWTO_TKOFF", 1) or not integer(store, "FW_LAUN_DETCN_ON", 0):
        return LaunchKind.RUNWAY
    return LaunchKind.CATAPULT
