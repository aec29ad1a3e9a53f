"""ArduPlane parameters to the typed parameters of commander, flight tasks, control laws and filter.

What a user would tune an aircraft to comes from its flight envelope (`airframe_overrides`); what ArduPlane
has no parameter for is taken from the envelope too. Where a parameter means the same but counts otherwise
than here (steering gains), its relation to the default counts.
"""

import math
from dataclasses import replace
from typing import Any, Final

from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.firmware import mapping
from autopilot_bridge.firmware.ardupilot.copter import mapping as ardupilot_mapping
from autopilot_bridge.firmware.ardupilot.plane.parameters import ARDUPILOT_PLANE_PARAMETERS
from autopilot_bridge.firmware.external_mapping import GpsSource, ardupilot_gps_source
from autopilot_bridge.firmware.mapping import (
    FieldMap,
    RatioMap,
    build,
    clamp,
    field_values,
    integer,
    scaled_values,
)
from autopilot_bridge.firmware.navigation_noise import ardupilot_noise
from autopilot_bridge.firmware.plane_limits import (
    controller_values,
    flight_values,
    only_in,
    tuned_controller,
    tuned_flight,
)
from autopilot_bridge.flight.fixed_wing.parameters import (
    FixedWingFlightParameters,
    LaunchKind,
    TurnInRule,
)
from autopilot_bridge.flight.parameters import ReturnDestination
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.parameters import ParameterStore
from flightsim.flight_envelope import FlightEnvelope

_DEG: Final = math.radians(1.0)
_PERCENT: Final = 0.01
_TENTHS: Final = 0.1
_RATE_GAIN: Final = 4.0 / math.pi  # the firmware's rate loops give the surface as an angle, 45 deg being full
_TURN_ENERGY: Final = 2.2  # per load factor: n^2 - 1 = 2.2 (n - 1), about n = 1.2
_NEVER_S: Final = 1e6
_LEAST_CLIMB_M_S: Final = 0.1  # of the control laws
_GREATEST_ROLL_TIME_S: Final = 3.0  # of the path guidance
_GREATEST_IDLE: Final = 0.4  # throttle of a landing
_THROTTLE_FUNCTION: Final = 70  # of SERVOn_FUNCTION

_AUTOMATIC: Final = frozenset({FlightMode.MISSION, FlightMode.GUIDED, FlightMode.HOLD, FlightMode.AVOID})
_SAFE: Final = frozenset({FlightMode.RETURN, FlightMode.TAKEOFF})
_SHORT: Final = {
    0: FailsafeAction.CIRCLE,
    1: FailsafeAction.CIRCLE,
    2: FailsafeAction.GLIDE,
    3: FailsafeAction.NONE,
    4: FailsafeAction.ALTITUDE,
}  # FS_SHORT_ACTN
_LONG: Final = {
    0: FailsafeAction.RETURN,
    1: FailsafeAction.RETURN,
    2: FailsafeAction.GLIDE,
    3: FailsafeAction.GLIDE,  # no parachute here
    4: FailsafeAction.MISSION,
}  # FS_LONG_ACTN
_BATTERY: Final = {
    0: FailsafeAction.WARN,
    1: FailsafeAction.RETURN,
    2: FailsafeAction.RETURN,
    3: FailsafeAction.TERMINATE,
    4: FailsafeAction.RETURN,
    5: FailsafeAction.GLIDE,
    6: FailsafeAction.HOLD,
}  # BATT_FS_LOW_ACT, BATT_FS_CRT_ACT
_FENCE: Final = {
    0: FailsafeAction.WARN,
    1: FailsafeAction.RETURN,
    6: FailsafeAction.FENCE_POINT,
    7: FailsafeAction.FENCE_POINT,
    8: FailsafeAction.RETURN,
}  # FENCE_ACTION

CONTROLLER: Final = (
    FieldMap("airspeed_stall_m_s", "AIRSPEED_STALL"),
    FieldMap("airspeed_min_m_s", "AIRSPEED_MIN"),
    FieldMap("airspeed_trim_m_s", "AIRSPEED_CRUISE"),
    FieldMap("airspeed_max_m_s", "AIRSPEED_MAX"),
    FieldMap("scaling_airspeed_m_s", "SCALING_SPEED"),
    FieldMap("ground_speed_min_m_s", "MIN_GROUNDSPEED"),
    FieldMap("roll_limit_rad", "ROLL_LIMIT_DEG", _DEG),
    FieldMap("trim_throttle", "TRIM_THROTTLE", _PERCENT),
    FieldMap("throttle_min", "THR_MIN", _PERCENT),
    FieldMap("throttle_max", "THR_MAX", _PERCENT),
    FieldMap("throttle_slew_1_s", "THR_SLEWRATE", _PERCENT),
    FieldMap("pitch_min_rad", "PTCH_LIM_MIN_DEG", _DEG),
    FieldMap("pitch_max_rad", "PTCH_LIM_MAX_DEG", _DEG),
    FieldMap("trim_pitch_rad", "PTCH_TRIM_DEG", _DEG),
    FieldMap("climb_max_m_s", "TECS_CLMB_MAX"),
    FieldMap("sink_min_m_s", "TECS_SINK_MIN"),
    FieldMap("sink_max_m_s", "TECS_SINK_MAX"),
    FieldMap("height_time_constant_s", "TECS_TIME_CONST"),
    FieldMap("pitch_damping", "TECS_PTCH_DAMP"),
    FieldMap("pitch_integral_1_s", "TECS_INTEG_GAIN"),
    FieldMap("throttle_damping", "TECS_THR_DAMP"),
    FieldMap("speed_weight", "TECS_SPDWEIGHT"),
    FieldMap("vertical_acceleration_max_m_s2", "TECS_VERT_ACC"),
    FieldMap("turn_energy_rate_m2_s3", "TECS_RLL2THR", _TURN_ENERGY),
    FieldMap("roll_time_constant_s", "RLL2SRV_TCONST"),
    FieldMap("pitch_time_constant_s", "PTCH2SRV_TCONST"),
    FieldMap("roll_rate_max_rad_s", "RLL2SRV_RMAX", _DEG),
    FieldMap("pitch_rate_max_up_rad_s", "PTCH2SRV_RMAX_UP", _DEG),
    FieldMap("pitch_rate_max_down_rad_s", "PTCH2SRV_RMAX_DN", _DEG),
    FieldMap("rate_roll_p", "RLL_RATE_P", _RATE_GAIN),
    FieldMap("rate_roll_i", "RLL_RATE_I", _RATE_GAIN),
    FieldMap("rate_roll_d", "RLL_RATE_D", _RATE_GAIN),
    FieldMap("rate_roll_ff", "RLL_RATE_FF", _RATE_GAIN),
    FieldMap("rate_roll_integral_max", "RLL_RATE_IMAX", _RATE_GAIN),
    FieldMap("rate_pitch_p", "PTCH_RATE_P", _RATE_GAIN),
    FieldMap("rate_pitch_i", "PTCH_RATE_I", _RATE_GAIN),
    FieldMap("rate_pitch_d", "PTCH_RATE_D", _RATE_GAIN),
    FieldMap("rate_pitch_ff", "PTCH_RATE_FF", _RATE_GAIN),
    FieldMap("rate_pitch_integral_max", "PTCH_RATE_IMAX", _RATE_GAIN),
    FieldMap("rate_yaw_p", "YAW2SRV_DAMP"),
    FieldMap("rate_yaw_i", "YAW2SRV_INT"),
    FieldMap("sideslip_gain_rad_s_per_m_s2", "YAW2SRV_SLIP"),
    FieldMap("rate_derivative_cutoff_hz", "RLL_RATE_FLTD"),
    FieldMap("roll_to_rudder_ff", "KFF_RDDRMIX"),
    FieldMap("wheel_time_constant_s", "STEER2SRV_TCONST"),
)

_TOGETHER: Final = (
    ("airspeed_time_constant_s", "height_time_constant_s"),
    ("throttle_integral_1_s", "pitch_integral_1_s"),
)
"""Fields that ArduPlane sets with the parameter of another one: they change in proportion to it."""

CONTROLLER_SCALED: Final = (
    RatioMap(("wheel_p",), "STEER2SRV_P"),
    RatioMap(("wheel_i",), "STEER2SRV_I"),
    RatioMap(("wheel_integral_max",), "STEER2SRV_IMAX"),
    RatioMap(("wheel_rate_max_rad_s",), "GROUND_STEER_DPS"),
)

AIRFRAME_FLIGHT: Final = (
    FieldMap("airspeed_min_m_s", "AIRSPEED_MIN"),
    FieldMap("airspeed_trim_m_s", "AIRSPEED_CRUISE"),
    FieldMap("airspeed_max_m_s", "AIRSPEED_MAX"),
    FieldMap("bank_max_rad", "ROLL_LIMIT_DEG", _DEG),
    FieldMap("pitch_max_rad", "PTCH_LIM_MAX_DEG", _DEG),
    FieldMap("pitch_min_rad", "PTCH_LIM_MIN_DEG", _DEG),
    FieldMap("trim_throttle", "TRIM_THROTTLE", _PERCENT),
    FieldMap("guidance_period_s", "NAVL1_PERIOD"),
    FieldMap("guidance_damping", "NAVL1_DAMPING"),
    FieldMap("loiter_radius_m", "WP_LOITER_RAD"),
    FieldMap("takeoff_pitch_min_rad", "TKOFF_LVL_PITCH", _DEG),
    FieldMap("takeoff_clearance_m", "TKOFF_LVL_ALT"),
    FieldMap("ground_bank_max_rad", "LEVEL_ROLL_LIMIT", _DEG),
    FieldMap("takeoff_roll_pitch_rad", "TKOFF_GND_PITCH", _DEG),
    FieldMap("rotation_airspeed_m_s", "TKOFF_ROTATE_SPD"),
    FieldMap("flaps_takeoff", "TKOFF_FLAP_PCNT", _PERCENT),
    FieldMap("flare_height_m", "LAND_FLARE_ALT"),
    FieldMap("flare_time_s", "LAND_FLARE_SEC"),
    FieldMap("flare_sink_m_s", "TECS_LAND_SINK"),
    FieldMap("flare_pitch_min_rad", "LAND_PITCH_DEG", _DEG),
    FieldMap("flare_pitch_max_rad", "TECS_LAND_PMAX", _DEG),
    FieldMap("flaps_landing", "LAND_FLAP_PERCNT", _PERCENT),
    FieldMap("landing_airspeed_m_s", "TECS_LAND_ARSPD"),
)
"""What a user tunes an aircraft to, of the flight tasks."""

FLIGHT: Final = (
    *AIRFRAME_FLIGHT,
    FieldMap("climb_max_m_s", "TECS_CLMB_MAX"),
    FieldMap("sink_max_m_s", "TECS_SINK_MAX"),
    FieldMap("trim_pitch_rad", "PTCH_TRIM_DEG", _DEG),
    FieldMap("throttle_idle", "THR_MIN", _PERCENT),
    FieldMap("roll_time_constant_s", "RLL2SRV_TCONST"),
    FieldMap("acceptance_radius_m", "WP_RADIUS"),
    FieldMap("takeoff_altitude_m", "TKOFF_ALT"),
    FieldMap("launch_acceleration_m_s2", "TKOFF_THR_MINACC"),
    FieldMap("launch_speed_min_m_s", "TKOFF_THR_MINSPD"),
    FieldMap("launch_delay_s", "TKOFF_THR_DELAY", _TENTHS),
    FieldMap("return_climb_min_m", "RTL_CLIMB_MIN"),
    FieldMap("manual_bank_max_rad", "ROLL_LIMIT_DEG", _DEG),
    FieldMap("manual_pitch_max_rad", "PTCH_LIM_MAX_DEG", _DEG),
    FieldMap("manual_pitch_down_max_rad", "PTCH_LIM_MIN_DEG", -_DEG),
    FieldMap("acro_roll_rate_rad_s", "ACRO_ROLL_RATE", _DEG),
    FieldMap("acro_pitch_rate_rad_s", "ACRO_PITCH_RATE", _DEG),
    FieldMap("manual_expo", "MAN_EXPO_ROLL", _PERCENT),
)

NAVIGATION: Final = (
    *ardupilot_mapping.NAVIGATION,
    FieldMap("airspeed_gate", "EK3_EAS_I_GATE", 0.01),
    FieldMap("wind_height_scale", "EK3_WIND_PSCALE"),
)

NAVIGATION_RATIOS: Final = (
    *ardupilot_mapping.NAVIGATION_RATIOS,
    RatioMap(("airspeed_noise_m_s",), "EK3_EAS_M_NSE"),
    RatioMap(("wind_walk_m_s_sqrt_s",), "EK3_WIND_P_NSE"),
)
_CHECK_WIND: Final = 1  # bits of ARSPD_OPTIONS
_USE_AGAIN: Final = 2


def airframe_overrides(envelope: FlightEnvelope) -> dict[str, float]:
    """Parameters that a user sets to tune this aircraft, with their values."""
    values = {
        **mapping.airframe_overrides(
            tuned_controller(envelope), only_in(CONTROLLER, AIRFRAME_FLIGHT), ARDUPILOT_PLANE_PARAMETERS
        ),
        **mapping.airframe_overrides(tuned_flight(envelope), AIRFRAME_FLIGHT, ARDUPILOT_PLANE_PARAMETERS),
    }
    # whole numbers: the least airspeed must not fall below what is safe
    values["AIRSPEED_MIN"] = math.ceil(envelope.airspeed_min_m_s - 1e-6)
    values["TECS_PITCH_MAX"] = min(45, round(math.degrees(envelope.pitch_max_rad)))
    values["RNGFND_LANDING"] = 1
    return {**values, **({} if envelope.powered else {"SERVO3_FUNCTION": 0})}


def commander_parameters(store: ParameterStore) -> CommanderParameters:
    """FS_*, FENCE_*, BATT_*, LAND_DISARMDELAY, ARMING_CHECK (ArduPlane 4.6 parameter reference)."""
    short, long = integer(store, "FS_SHORT_ACTN"), integer(store, "FS_LONG_ACTN")
    radio = integer(store, "THR_FAILSAFE") == 1
    gcs = integer(store, "FS_GCS_ENABL")
    long_s = store.limited("FS_LONG_TIMEOUT")
    keeps_short = (_AUTOMATIC if short == 0 else frozenset()) | _SAFE | {FlightMode.CIRCLE}
    keeps_long = (_AUTOMATIC if long == 0 else frozenset()) | _SAFE
    return CommanderParameters(
        **ardupilot_mapping.shared_commander_values(store),
        gcs_loss_s=long_s if gcs else 0.0,
        gcs_loss_action=_LONG.get(long, FailsafeAction.RETURN),
        gcs_loss_exempt=frozenset(set(FlightMode) - {FlightMode.MISSION}) if gcs == 3 else keeps_long,
        manual_loss_s=store.limited("FS_SHORT_TIMEOUT") if radio else 0.0,
        manual_loss_action=_SHORT.get(short, FailsafeAction.CIRCLE),
        manual_loss_exempt=keeps_short,
        manual_long_loss_s=long_s if radio else 0.0,
        manual_long_loss_action=_LONG.get(long, FailsafeAction.RETURN),
        manual_long_loss_exempt=keeps_long,
        battery_low_action=_BATTERY.get(integer(store, "BATT_FS_LOW_ACT"), FailsafeAction.WARN),
        battery_critical_action=_BATTERY.get(integer(store, "BATT_FS_CRT_ACT"), FailsafeAction.WARN),
        position_loss_s=_NEVER_S,  # the aircraft flies on by dead reckoning
        position_loss_action=FailsafeAction.NONE,
        fence=replace(
            ardupilot_mapping.fence_parameters(store, _FENCE, backup_m=100.0),
            return_to_rally=bool(integer(store, "FENCE_RET_RALLY")),
            return_height_m=store.limited("FENCE_RET_ALT"),
        ),
        disarm_preflight_s=0.0,
        disarm_landed_s=store.limited("LAND_DISARMDELAY"),
        follow_enabled=False,
    )


def controller_parameters(
    store: ParameterStore, envelope: FlightEnvelope | None = None
) -> FixedWingParameters:
    """TECS_*, NAVL1_*, RLL*, PTCH*, YAW2SRV_*; fields without a parameter, and limits, from the envelope."""
    tuned = tuned_controller(envelope)
    values: dict[str, Any] = field_values(store, CONTROLLER)
    values["climb_max_m_s"] = max(_LEAST_CLIMB_M_S, values["climb_max_m_s"])
    values.update(scaled_values(tuned, store, CONTROLLER_SCALED))
    for other, named in _TOGETHER:
        values[other] = getattr(tuned, other) * values[named] / getattr(tuned, named)
    if values["airspeed_stall_m_s"] <= 0.0:
        values["airspeed_stall_m_s"] = 0.8 * values["airspeed_min_m_s"]
    for name in ("roll_rate_max_rad_s", "pitch_rate_max_up_rad_s", "pitch_rate_max_down_rad_s"):
        values[name] = values[name] or math.radians(180.0)  # 0: no limit
    values["climb_rate_target_m_s"] = min(tuned.climb_rate_target_m_s, values["climb_max_m_s"])
    values["sink_rate_target_m_s"] = min(tuned.sink_rate_target_m_s, values["sink_max_m_s"])
    for name, limit in _pitch_limits(store).items():
        values[name] = limit
    values["heading_p_1_s"] = 4.0 * math.pi * store.limited("NAVL1_DAMPING") / store.limited("NAVL1_PERIOD")
    values["stall_prevention"] = bool(integer(store, "STALL_PREVENTION"))
    values["powered"] = tuned.powered and integer(store, "SERVO3_FUNCTION") == _THROTTLE_FUNCTION
    return replace(tuned, **controller_values(values, tuned))


def flight_parameters(
    store: ParameterStore, envelope: FlightEnvelope | None = None
) -> FixedWingFlightParameters:
    """TECS_*, NAVL1_*, TKOFF_*, LAND_*, RTL_*, WP_*; the rest, and limits, from the envelope."""
    tuned, controller = tuned_flight(envelope), tuned_controller(envelope)
    values: dict[str, Any] = field_values(store, FLIGHT)
    least_m_s, trim_m_s = values["airspeed_min_m_s"], values["airspeed_trim_m_s"]
    values["roll_time_constant_s"] = min(_GREATEST_ROLL_TIME_S, values["roll_time_constant_s"])
    values["throttle_idle"] = min(_GREATEST_IDLE, values["throttle_idle"])
    values.update(_pitch_limits(store))
    values["climb_rate_m_s"] = tuned.climb_rate_m_s
    values["sink_rate_m_s"] = tuned.sink_rate_m_s
    values["takeoff_airspeed_m_s"] = trim_m_s
    if values["rotation_airspeed_m_s"] <= 0.0:  # as soon as it flies
        values["rotation_airspeed_m_s"] = tuned.rotation_airspeed_m_s
    if values["landing_airspeed_m_s"] <= 0.0:
        values["landing_airspeed_m_s"] = 0.5 * (least_m_s + trim_m_s)
    values["takeoff_bank_max_rad"] = max(values["ground_bank_max_rad"], tuned.takeoff_bank_max_rad)
    throttle = store.get("TKOFF_THR_MAX") or store.get("THR_MAX")
    values["takeoff_throttle_max"] = clamp(throttle * _PERCENT, 0.3, 1.0)
    slew = store.get("TKOFF_THR_SLEW") or store.get("THR_SLEWRATE")
    values["takeoff_throttle_ramp_s"] = clamp(100.0 / slew, 0.0, 15.0) if slew > 0.0 else 0.0
    values["landing_abort_climb_m"] = tuned.landing_abort_climb_m
    values["return_altitude_m"] = store.limited("RTL_ALTITUDE")
    values["return_climbs"] = store.get("RTL_ALTITUDE") < 0.0  # -1: stays at the present height
    values["return_descend_altitude_m"] = values["return_altitude_m"]
    least_drop_m = store.get("GLIDE_SLOPE_MIN")
    values["glide_slope_min_m"] = least_drop_m if least_drop_m > 0.0 else math.inf
    values["return_loiter_time_s"] = -1.0
    values["return_cone_half_angle_rad"] = 0.0
    radius_m = store.limited("RTL_RADIUS")
    values["return_loiter_radius_m"] = radius_m or values["loiter_radius_m"]
    values["return_destination"] = _DESTINATIONS.get(integer(store, "RTL_AUTOLAND"), ReturnDestination.HOME)
    values["rally"] = ardupilot_mapping.rally_rule(store, within_fence=False)
    values["acceptance_altitude_m"] = math.inf
    values["turn_in"] = TurnInRule.TURN_ANGLE
    values["launch"] = LaunchKind.CATAPULT if store.get("TKOFF_THR_MINACC") > 0.0 else LaunchKind.RUNWAY
    yaw = store.limited("ACRO_YAW_RATE") * _DEG
    values["acro_yaw_rate_rad_s"] = yaw or tuned.acro_yaw_rate_rad_s
    values["rangefinder_landing"] = integer(store, "RNGFND_LANDING") > 0
    values["position_lost_wait_s"] = math.inf
    return replace(tuned, **flight_values(values, tuned, controller))


def navigation_parameters(store: ParameterStore) -> NavigationParameters:
    """EK3_*, ARSPD_*: as for the copter, and wind and airspeed."""
    options = integer(store, "ARSPD_OPTIONS")
    calibration = store.limited("ARSPD_RATIO") / 2.0
    return build(
        NavigationParameters,
        store,
        NAVIGATION,
        use_gps=ardupilot_mapping.gps_is_fused(store),
        gps_may_repeat=ardupilot_gps_source(store) is GpsSource.MESSAGES,
        fixed_wing=True,
        use_airspeed=integer(store, "ARSPD_TYPE") > 0 and integer(store, "ARSPD_USE") > 0,
        airspeed_scale=math.sqrt(calibration),
        airspeed_checks=bool(options & _CHECK_WIND),
        airspeed_start_delay_s=5.0 if options & _USE_AGAIN else _NEVER_S,
        **ardupilot_noise(store),
        **scaled_values(NavigationParameters(), store, NAVIGATION_RATIOS),
    )


_DESTINATIONS: Final = {
    1: ReturnDestination.HOME_THEN_LANDING_SEQUENCE,
    2: ReturnDestination.LANDING_SEQUENCE,
    4: ReturnDestination.LANDING_SEQUENCE,
}  # RTL_AUTOLAND


def _pitch_limits(store: ParameterStore) -> dict[str, float]:
    """Of automatic flight: TECS_PITCH_MAX and _MIN, within PTCH_LIM_*; 0: those."""
    high = store.limited("PTCH_LIM_MAX_DEG") * _DEG
    low = store.limited("PTCH_LIM_MIN_DEG") * _DEG
    energy_high = store.get("TECS_PITCH_MAX") * _DEG
    energy_low = store.get("TECS_PITCH_MIN") * _DEG
    return {
        "pitch_max_rad": clamp(energy_high, 0.05, high) if energy_high > 0.0 else high,
        "pitch_min_rad": clamp(energy_low, low, -0.05) if energy_low < 0.0 else low,
    }
