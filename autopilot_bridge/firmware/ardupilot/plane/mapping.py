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
from autopilot_bridge.firmware.ardupilot.parameter_checks import plane_faults
from autopilot_bridge.firmware.ardupilot.plane.parameters import ARDUPILOT_PLANE_PARAMETERS
from autopilot_bridge.firmware.external_mapping import GpsSource, ardupilot_gps_source
from autopilot_bridge.firmware.mapping import build, clamp, field_values, integer, load_tables, scaled_values
from autopilot_bridge.firmware.navigation_noise import ardupilot_noise
from autopilot_bridge.firmware.plane_limits import (
    controller_values,
    flight_values,
    only_in,
    tuned_controller,
    tuned_flight,
)
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters, LaunchKind, TurnInRule
from autopilot_bridge.flight.parameters import ReturnDestination
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.parameters import ParameterStore
from flightsim.flight_envelope import FlightEnvelope

_TABLES: Final = load_tables("ardupilot.plane")
_DEG: Final = math.radians(1.0)
_PERCENT: Final = 0.01
_NEVER_S: Final = 1e6
_LEAST_CLIMB_M_S: Final = 0.1  # of the control laws
_GREATEST_ROLL_TIME_S: Final = 3.0  # of the path guidance
_GREATEST_IDLE: Final = 0.4  # throttle of a landing
_THROTTLE_FUNCTION: Final = 70  # of SERVOn_FUNCTION

_AUTOMATIC: Final = frozenset({FlightMode.MISSION, FlightMode.GUIDED, FlightMode.HOLD, FlightMode.AVOID})
_SAFE: Final = frozenset({FlightMode.RETURN, FlightMode.TAKEOFF})
_SHORT: Final = _TABLES.actions["FS_SHORT_ACTN"]
_LONG: Final = _TABLES.actions["FS_LONG_ACTN"]
_BATTERY: Final = _TABLES.actions["BATT_FS_LOW_ACT"]  # BATT_FS_LOW_ACT, BATT_FS_CRT_ACT
_FENCE: Final = _TABLES.actions["FENCE_ACTION"]

CONTROLLER: Final = _TABLES.fields["controller"]

_TOGETHER: Final = (
    ("airspeed_time_constant_s", "height_time_constant_s"),
    ("throttle_integral_1_s", "pitch_integral_1_s"),
)
"""Fields that ArduPlane sets with the parameter of another one: they change in proportion to it."""

CONTROLLER_SCALED: Final = _TABLES.ratios["controller"]
AIRFRAME_FLIGHT: Final = _TABLES.fields["airframe_flight"]
"""What a user tunes an aircraft to, of the flight tasks."""

FLIGHT: Final = (*AIRFRAME_FLIGHT, *_TABLES.fields["flight"])
NAVIGATION: Final = (*ardupilot_mapping.NAVIGATION, *_TABLES.fields["navigation"])
NAVIGATION_RATIOS: Final = (*ardupilot_mapping.NAVIGATION_RATIOS, *_TABLES.ratios["navigation"])
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
        faults=plane_faults(store),
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
    keeps_height = store.get("RTL_ALTITUDE") < 0.0  # -1: it stays at the present height
    values["return_climbs"] = keeps_height
    values["return_descend_altitude_m"] = math.inf if keeps_height else values["return_altitude_m"]
    least_drop_m = store.get("GLIDE_SLOPE_MIN")
    values["glide_slope_min_m"] = least_drop_m if least_drop_m > 0.0 else math.inf
    values["return_loiter_time_s"] = -1.0
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
