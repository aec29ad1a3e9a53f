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
_LEAST_CLIMB_M_S: Final = 0.1  # of the control laws
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
    FieldMap("airspeed_stall_m_s", "FW_AIRSPD_STALL"),
    FieldMap("airspeed_min_m_s", "FW_AIRSPD_MIN"),
    FieldMap("airspeed_trim_m_s", "FW_AIRSPD_TRIM"),
    FieldMap("airspeed_max_m_s", "FW_AIRSPD_MAX"),
    FieldMap("scaling_airspeed_m_s", "FW_AIRSPD_TRIM"),
    FieldMap("ground_speed_min_m_s", "FW_GND_SPD_MIN"),
    FieldMap("roll_limit_rad", "FW_R_LIM", _DEG),
    FieldMap("roll_slew_rad_s", "FW_PN_R_SLEW_MAX", _DEG),
    FieldMap("trim_throttle", "FW_THR_TRIM"),
    FieldMap("trim_throttle_min_speed", "FW_THR_ASPD_MIN"),
    FieldMap("trim_throttle_max_speed", "FW_THR_ASPD_MAX"),
    FieldMap("throttle_min", "FW_THR_MIN"),
    FieldMap("throttle_max", "FW_THR_MAX"),
    FieldMap("throttle_slew_1_s", "FW_THR_SLEW_MAX"),
    FieldMap("pitch_min_rad", "FW_P_LIM_MIN", _DEG),
    FieldMap("pitch_max_rad", "FW_P_LIM_MAX", _DEG),
    FieldMap("trim_pitch_rad", "FW_PSP_OFF", _DEG),
    FieldMap("climb_max_m_s", "FW_T_CLMB_MAX"),
    FieldMap("sink_min_m_s", "FW_T_SINK_MIN"),
    FieldMap("sink_max_m_s", "FW_T_SINK_MAX"),
    FieldMap("climb_rate_target_m_s", "FW_T_CLMB_R_SP"),
    FieldMap("sink_rate_target_m_s", "FW_T_SINK_R_SP"),
    FieldMap("height_time_constant_s", "FW_T_ALT_TC"),
    FieldMap("airspeed_time_constant_s", "FW_T_TAS_TC"),
    FieldMap("height_rate_ff", "FW_T_HRATE_FF"),
    FieldMap("energy_balance_ff", "FW_T_SEB_R_FF"),
    FieldMap("pitch_damping", "FW_T_PTCH_DAMP"),
    FieldMap("pitch_integral_1_s", "FW_T_I_GAIN_PIT"),
    FieldMap("throttle_damping", "FW_T_THR_DAMPING"),
    FieldMap("throttle_integral_1_s", "FW_T_THR_INTEG"),
    FieldMap("speed_weight", "FW_T_SPDWEIGHT"),
    FieldMap("energy_rate_time_constant_s", "FW_T_STE_R_TC"),
    FieldMap("vertical_acceleration_max_m_s2", "FW_T_VERT_ACC"),
    FieldMap("turn_energy_rate_m2_s3", "FW_T_RLL2THR"),
    FieldMap("airspeed_noise_m_s", "FW_T_SPD_STD"),
    FieldMap("airspeed_rate_noise_m_s2", "FW_T_SPD_DEV_STD"),
    FieldMap("airspeed_rate_process_noise_m_s2", "FW_T_SPD_PRC_STD"),
    FieldMap("roll_time_constant_s", "FW_R_TC"),
    FieldMap("pitch_time_constant_s", "FW_P_TC"),
    FieldMap("roll_rate_max_rad_s", "FW_R_RMAX", _DEG),
    FieldMap("pitch_rate_max_up_rad_s", "FW_P_RMAX_POS", _DEG),
    FieldMap("pitch_rate_max_down_rad_s", "FW_P_RMAX_NEG", _DEG),
    FieldMap("yaw_rate_max_rad_s", "FW_Y_RMAX", _DEG),
    FieldMap("rate_roll_p", "FW_RR_P"),
    FieldMap("rate_roll_i", "FW_RR_I"),
    FieldMap("rate_roll_d", "FW_RR_D"),
    FieldMap("rate_roll_ff", "FW_RR_FF"),
    FieldMap("rate_roll_integral_max", "FW_RR_IMAX"),
    FieldMap("rate_pitch_p", "FW_PR_P"),
    FieldMap("rate_pitch_i", "FW_PR_I"),
    FieldMap("rate_pitch_d", "FW_PR_D"),
    FieldMap("rate_pitch_ff", "FW_PR_FF"),
    FieldMap("rate_pitch_integral_max", "FW_PR_IMAX"),
    FieldMap("rate_yaw_p", "FW_YR_P"),
    FieldMap("rate_yaw_i", "FW_YR_I"),
    FieldMap("rate_yaw_d", "FW_YR_D"),
    FieldMap("rate_yaw_ff", "FW_YR_FF"),
    FieldMap("rate_yaw_integral_max", "FW_YR_IMAX"),
    FieldMap("rate_derivative_cutoff_hz", "IMU_DGYRO_CUTOFF"),
    FieldMap("roll_to_rudder_ff", "FW_RLL_TO_YAW_FF"),
    FieldMap("trim_aileron", "TRIM_ROLL"),
    FieldMap("trim_elevator", "TRIM_PITCH"),
    FieldMap("trim_rudder", "TRIM_YAW"),
    FieldMap("wheel_rate_max_rad_s", "FW_W_RMAX", _DEG),
    FieldMap("wheel_p", "FW_WR_P"),
    FieldMap("wheel_i", "FW_WR_I"),
    FieldMap("wheel_integral_max", "FW_WR_IMAX"),
    FieldMap("wheel_ff", "FW_WR_FF"),
)

AIRFRAME_FLIGHT: Final = (
    FieldMap("airspeed_min_m_s", "FW_AIRSPD_MIN"),
    FieldMap("airspeed_trim_m_s", "FW_AIRSPD_TRIM"),
    FieldMap("airspeed_max_m_s", "FW_AIRSPD_MAX"),
    FieldMap("climb_rate_m_s", "FW_T_CLMB_R_SP"),
    FieldMap("sink_rate_m_s", "FW_T_SINK_R_SP"),
    FieldMap("bank_max_rad", "FW_R_LIM", _DEG),
    FieldMap("pitch_max_rad", "FW_P_LIM_MAX", _DEG),
    FieldMap("pitch_min_rad", "FW_P_LIM_MIN", _DEG),
    FieldMap("trim_throttle", "FW_THR_TRIM"),
    FieldMap("guidance_period_s", "NPFG_PERIOD"),
    FieldMap("guidance_damping", "NPFG_DAMPING"),
    FieldMap("guidance_period_safety", "NPFG_PERIOD_SF"),
    FieldMap("roll_time_constant_s", "NPFG_ROLL_TC"),
    FieldMap("switch_distance_multiplier", "NPFG_SW_DST_MLT"),
    FieldMap("loiter_radius_m", "NAV_LOITER_RAD"),
    FieldMap("return_loiter_radius_m", "RTL_LOITER_RAD"),
    FieldMap("takeoff_airspeed_m_s", "FW_TKO_AIRSPD"),
    FieldMap("takeoff_pitch_min_rad", "FW_TKO_PITCH_MIN", _DEG),
    FieldMap("takeoff_throttle_max", "RWTO_MAX_THR"),
    FieldMap("takeoff_throttle_ramp_s", "RWTO_RAMP_TIME"),
    FieldMap("takeoff_roll_pitch_rad", "RWTO_PSP", _DEG),
    FieldMap("rotation_airspeed_m_s", "RWTO_ROT_AIRSPD"),
    FieldMap("rotation_time_s", "RWTO_ROT_TIME"),
    FieldMap("launch_acceleration_m_s2", "FW_LAUN_AC_THLD"),
    FieldMap("launch_time_s", "FW_LAUN_AC_T"),
    FieldMap("launch_delay_s", "FW_LAUN_MOT_DEL"),
    FieldMap("landing_angle_rad", "FW_LND_ANG", _DEG),
    FieldMap("landing_airspeed_m_s", "FW_LND_AIRSPD"),
    FieldMap("flare_height_m", "FW_LND_FLALT"),
    FieldMap("flare_time_s", "FW_LND_FL_TIME"),
    FieldMap("flare_sink_m_s", "FW_LND_FL_SINK"),
    FieldMap("flare_pitch_min_rad", "FW_LND_FL_PMIN", _DEG),
    FieldMap("flare_pitch_max_rad", "FW_LND_FL_PMAX", _DEG),
    FieldMap("flaps_takeoff", "FW_FLAPS_TO_SCL"),
    FieldMap("flaps_landing", "FW_FLAPS_LND_SCL"),
    FieldMap("manual_bank_max_rad", "FW_MAN_R_MAX", _DEG),
    FieldMap("manual_pitch_max_rad", "FW_MAN_P_MAX", _DEG),
)
"""What an airframe file sets of the flight tasks."""

FLIGHT: Final = (
    *AIRFRAME_FLIGHT,
    FieldMap("climb_max_m_s", "FW_T_CLMB_MAX"),
    FieldMap("sink_max_m_s", "FW_T_SINK_MAX"),
    FieldMap("trim_pitch_rad", "FW_PSP_OFF", _DEG),
    FieldMap("throttle_idle", "FW_THR_IDLE"),
    FieldMap("acceptance_radius_m", "NAV_ACC_RAD"),
    FieldMap("acceptance_altitude_m", "NAV_FW_ALT_RAD"),
    FieldMap("takeoff_altitude_m", "MIS_TAKEOFF_ALT"),
    FieldMap("landing_abort_climb_m", "MIS_LND_ABRT_ALT"),
    FieldMap("return_altitude_m", "RTL_RETURN_ALT"),
    FieldMap("return_descend_altitude_m", "RTL_DESCEND_ALT"),
    FieldMap("return_loiter_time_s", "RTL_LAND_DELAY"),
    FieldMap("manual_pitch_down_max_rad", "FW_MAN_P_MAX", _DEG),
    FieldMap("acro_roll_rate_rad_s", "FW_ACRO_X_MAX", _DEG),
    FieldMap("acro_pitch_rate_rad_s", "FW_ACRO_Y_MAX", _DEG),
    FieldMap("acro_yaw_rate_rad_s", "FW_ACRO_Z_MAX", _DEG),
    FieldMap("position_lost_bank_rad", "FW_GPSF_R", _DEG),
    FieldMap("position_lost_wait_s", "FW_GPSF_LT"),
)

NAVIGATION: Final = (
    *px4_mapping.NAVIGATION,
    FieldMap("airspeed_gate", "EKF2_TAS_GATE"),
    FieldMap("sideslip_gate", "EKF2_BETA_GATE"),
    FieldMap("airspeed_scale", "ASPD_SCALE_1"),
    FieldMap("airspeed_check_innovation_m_s", "ASPD_FS_INNOV"),
    FieldMap("airspeed_check_integral_m", "ASPD_FS_INTEG"),
    FieldMap("airspeed_stop_delay_s", "ASPD_FS_T_STOP"),
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
    checks_accuracy = store.get("COM_POS_FS_EPH") > 0.0
    terminates = integer(store, "CBRK_FLIGHTTERM") != _TERMINATION_OFF
    return replace(
        px4_mapping.commander_parameters(store),
        position_accuracy_max_m=store.limited("COM_POS_FS_EPH") if checks_accuracy else math.inf,
        position_accuracy_low_m=store.limited("COM_POS_LOW_EPH"),
        position_accuracy_low_action=_LOW_ACCURACY.get(
            integer(store, "COM_POS_LOW_ACT"), FailsafeAction.WARN
        ),
        attitude_roll_max_rad=store.limited("FD_FAIL_R") * _DEG,
        attitude_pitch_max_rad=store.limited("FD_FAIL_P") * _DEG,
        attitude_time_s=store.limited("FD_FAIL_R_TTRI"),
        attitude_action=FailsafeAction.TERMINATE if terminates else FailsafeAction.WARN,
    )


def controller_parameters(
    store: ParameterStore, envelope: FlightEnvelope | None = None
) -> FixedWingParameters:
    """FW_*, NPFG_*, TRIM_*; fields without a parameter, and limits, from the envelope."""
    tuned = tuned_controller(envelope)
    values: dict[str, Any] = field_values(store, CONTROLLER)
    values["climb_max_m_s"] = max(_LEAST_CLIMB_M_S, values["climb_max_m_s"])
    values["heading_p_1_s"] = 4.0 * math.pi * store.limited("NPFG_DAMPING") / store.limited("NPFG_PERIOD")
    values["airspeed_scaling"] = bool(integer(store, "FW_ARSP_SCALE_EN"))
    values["powered"] = tuned.powered and integer(store, "CA_ROTOR_COUNT") > 0
    return replace(tuned, **controller_values(values, tuned))


def flight_parameters(
    store: ParameterStore, envelope: FlightEnvelope | None = None
) -> FixedWingFlightParameters:
    """FW_*, NPFG_*, RWTO_*, NAV_*, MIS_*, RTL_*; the rest, and limits, from the envelope."""
    tuned, controller = tuned_flight(envelope), tuned_controller(envelope)
    values: dict[str, Any] = field_values(store, FLIGHT)
    least_m_s = values["airspeed_min_m_s"]
    if store.get("FW_TKO_AIRSPD") <= 0.0:
        values["takeoff_airspeed_m_s"] = least_m_s
    if store.get("RWTO_ROT_AIRSPD") <= 0.0:
        values["rotation_airspeed_m_s"] = _ROTATION_SHARE * values["takeoff_airspeed_m_s"]
    if store.get("FW_LND_AIRSPD") <= 0.0:
        values["landing_airspeed_m_s"] = least_m_s
    half_span_m = 0.5 * max(0.1, store.get("FW_WING_SPAN"))
    height_m = min(half_span_m, store.limited("FW_WING_HEIGHT"))
    values["ground_bank_max_rad"] = clamp(math.asin(height_m / half_span_m), 0.03, 0.35)
    values["guidance_period_lower_bound"] = bool(integer(store, "NPFG_LB_PERIOD"))
    values["guidance_period_upper_bound"] = bool(integer(store, "NPFG_UB_PERIOD"))
    values["turn_in"] = TurnInRule.SWITCH_DISTANCE
    values["launch"] = _launch(store)
    values["rangefinder_landing"] = integer(store, "FW_LND_USETER") > 0
    values["return_destination"], values["rally"] = px4_mapping.return_rules(store)
    values["return_climbs"] = True
    values["return_cone_half_angle_rad"] = 0.0  # RTL_CONE_ANG is the multicopter's
    return replace(tuned, **flight_values(values, tuned, controller))


def navigation_parameters(store: ParameterStore) -> NavigationParameters:
    """EKF2_*, ASPD_*: as for the multicopter, and wind, airspeed and sideslip."""
    starts_again = store.get("ASPD_FS_T_START") >= 0.0
    return build(
        NavigationParameters,
        store,
        NAVIGATION,
        gps_required_satellites=int(store.limited("EKF2_REQ_NSATS")),
        use_gps=px4_mapping.gps_is_fused(store),
        fixed_wing=True,
        use_airspeed=store.get("EKF2_ARSP_THR") > 0.0
        and integer(store, "ASPD_PRIMARY") > 0
        and integer(store, "FW_USE_AIRSPD") > 0,
        airspeed_threshold_m_s=store.limited("EKF2_ARSP_THR"),
        use_sideslip=integer(store, "EKF2_FUSE_BETA") > 0,
        airspeed_checks=bool(integer(store, "ASPD_DO_CHECKS") & _DATA_CHECKS),
        airspeed_start_delay_s=store.limited("ASPD_FS_T_START") if starts_again else _NEVER_S,
        **px4_noise(store),
        **scaled_values(NavigationParameters(), store, NAVIGATION_RATIOS),
    )


def _launch(store: ParameterStore) -> LaunchKind:
    """A runway take-off unless a launch is to be detected (RWTO_TKOFF, FW_LAUN_DETCN_ON)."""
    if integer(store, "RWTO_TKOFF") or not integer(store, "FW_LAUN_DETCN_ON"):
        return LaunchKind.RUNWAY
    return LaunchKind.CATAPULT
