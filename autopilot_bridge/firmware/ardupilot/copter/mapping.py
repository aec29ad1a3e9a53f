"""ArduCopter parameters to the typed parameters of commander, flight tasks, control laws and filter."""

import math
from collections.abc import Mapping
from typing import Any, Final

from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.commander.geofence_parameters import ALL_FENCES, AutoEnable, FenceParameters, FenceType
from autopilot_bridge.commander.modes import STICK_MODES, FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from autopilot_bridge.firmware.ardupilot.parameter_checks import copter_faults
from autopilot_bridge.firmware.external_mapping import GpsSource, ardupilot_external, ardupilot_gps_source
from autopilot_bridge.firmware.mapping import build, clamp, integer, load_tables, scaled_values
from autopilot_bridge.firmware.navigation_noise import ardupilot_noise
from autopilot_bridge.firmware.surroundings_mapping import (
    ardupilot_avoidance,
    ardupilot_follow,
    ardupilot_precision,
)
from autopilot_bridge.flight.parameters import FlightParameters, RallyRule, YawBehaviour
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.parameters import ParameterStore

_TABLES: Final = load_tables("ardupilot.copter")
_CM: Final = 0.01
_CENTIDEGREE: Final = math.radians(0.01)
_DEG: Final = math.radians(1.0)
_NEVER_S: Final = 1e9

# A return over the remembered path is not flown here: where the firmware would fall back to RTL or LAND
# without one, so do these tables.
_GCS: Final = _TABLES.actions["FS_GCS_ENABLE"]
_RADIO: Final = _TABLES.actions["FS_THR_ENABLE"]
_BATTERY: Final = _TABLES.actions["BATT_FS_LOW_ACT"]  # BATT_FS_LOW_ACT, BATT_FS_CRT_ACT
_EKF: Final = _TABLES.actions["FS_EKF_ACTION"]
_FENCE: Final = _TABLES.actions["FENCE_ACTION"]
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

FLIGHT: Final = _TABLES.fields["flight"]
CONTROLLER: Final = _TABLES.fields["controller"]
NAVIGATION: Final = _TABLES.fields["navigation"]
NAVIGATION_RATIOS: Final = _TABLES.ratios["navigation"]
_SOURCE_GPS: Final = 3  # of EK3_SRC1_POSXY


def shared_commander_values(store: ParameterStore) -> dict[str, Any]:
    """BATT_*, RC_OVERRIDE_TIME, ARMING_CHECK: fields of `CommanderParameters` that copter and plane share."""
    capacity_mah = max(1.0, store.get("BATT_CAPACITY"))
    monitored = integer(store, "BATT_MONITOR") != 0
    return {
        "offboard_loss_s": _NEVER_S,
        "offboard_loss_action": FailsafeAction.NONE,
        "stick_timeout_s": store.limited("RC_OVERRIDE_TIME"),
        "action_delay_s": 0.0,
        "battery_low_remaining": min(1.0, store.limited("BATT_LOW_MAH") / capacity_mah),
        "battery_critical_remaining": min(1.0, store.limited("BATT_CRT_MAH") / capacity_mah),
        "battery_emergency_remaining": 0.0,
        "battery_low_v": store.limited("BATT_LOW_VOLT") if monitored else 0.0,
        "battery_critical_v": store.limited("BATT_CRT_VOLT") if monitored else 0.0,
        "battery_timer_s": store.limited("BATT_LOW_TIMER"),
        "battery_emergency_action": FailsafeAction.WARN,
        "stick_override": False,
        "stick_override_offboard": False,
        "stick_override_threshold": 1.0,
        "check_arming": integer(store, "ARMING_CHECK") != 0,
    }


def commander_parameters(store: ParameterStore) -> CommanderParameters:
    """FS_*, FENCE_*, BATT_*, DISARM_DELAY, ARMING_CHECK (ArduCopter 4.6 parameter reference)."""
    options = integer(store, "FS_OPTIONS")
    gcs, radio = integer(store, "FS_GCS_ENABLE"), integer(store, "FS_THR_ENABLE")
    return CommanderParameters(
        **shared_commander_values(store),
        gcs_loss_s=store.limited("FS_GCS_TIMEOUT") if gcs else 0.0,
        gcs_loss_action=_GCS.get(gcs, FailsafeAction.RETURN),
        gcs_loss_exempt=_exempt(
            options,
            {
                _CONTINUE_AUTO_ON_GCS: (FlightMode.MISSION,),
                _CONTINUE_LANDING: (FlightMode.LAND,),
                _CONTINUE_PILOT_ON_GCS: (*STICK_MODES, FlightMode.HOLD),
            },
        ),
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
        battery_low_action=_BATTERY.get(integer(store, "BATT_FS_LOW_ACT"), FailsafeAction.WARN),
        battery_critical_action=_BATTERY.get(integer(store, "BATT_FS_CRT_ACT"), FailsafeAction.WARN),
        position_loss_s=POSITION_LOSS_S,
        position_loss_action=_EKF.get(integer(store, "FS_EKF_ACTION"), FailsafeAction.LAND),
        fence=fence_parameters(store, _FENCE, give_up_m=_GIVE_UP_M),
        disarm_preflight_s=store.limited("DISARM_DELAY"),
        disarm_landed_s=1.0,
        crash_check=integer(store, "FS_CRASH_CHECK") != 0,
        follow_enabled=integer(store, "FOLL_ENABLE") != 0,
        faults=copter_faults(store),
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
    types = FenceType(integer(store, "FENCE_TYPE") & int(ALL_FENCES))
    options = integer(store, "FENCE_OPTIONS")
    auto = integer(store, "FENCE_AUTOENABLE")
    limit = store.limited("FENCE_ALT_MAX")
    return FenceParameters(
        enabled=bool(integer(store, "FENCE_ENABLE")),
        action=actions.get(integer(store, "FENCE_ACTION"), FailsafeAction.WARN),
        radius_m=store.limited("FENCE_RADIUS") if FenceType.CIRCLE in types else 0.0,
        height_max_m=limit if FenceType.HEIGHT_MAX in types else 0.0,
        floor=FenceType.HEIGHT_MIN in types,
        height_min_m=store.limited("FENCE_ALT_MIN"),
        shapes=FenceType.SHAPES in types,
        margin_m=store.limited("FENCE_MARGIN"),
        inclusions_join=bool(options & _UNION),
        locks_mode=bool(options & _LOCKS_MODE),
        auto_enable=AutoEnable(auto) if auto in tuple(AutoEnable) else AutoEnable.OFF,
        give_up_m=give_up_m,
        backup_radius_m=backup_m,
        backup_height_m=20.0,
        counts_breaches=True,
    )


def rally_rule(store: ParameterStore, *, within_fence: bool) -> RallyRule:
    """RALLY_*."""
    limit_km = store.limited("RALLY_LIMIT_KM")
    return RallyRule(
        home_competes=bool(integer(store, "RALLY_INCL_HOME")),
        limit_m=1e3 * limit_km if limit_km > 0.0 else math.inf,
        within_fence=within_fence,
        altitude_is_ground=False,
    )


def flight_parameters(store: ParameterStore) -> FlightParameters:
    """WPNAV_*, RTL_*, LAND_*, LOIT_*, PILOT_*, CIRCLE_*, GUID_TIMEOUT."""
    fixed: dict[str, object] = {"use_waypoint_yaw": False, "return_loiters_high": True, "return_stops": True}
    climb_m_s = store.limited("PILOT_SPEED_UP") * _CM
    descend_m_s = store.limited("PILOT_SPEED_DN") * _CM
    fixed["manual_descend_speed_m_s"] = descend_m_s or climb_m_s  # 0: as fast as up
    cruise_m_s = store.limited("WPNAV_SPEED") * _CM
    return_m_s = store.limited("RTL_SPEED") * _CM
    fixed["return_speed_m_s"] = return_m_s or cruise_m_s  # 0: WPNAV_SPEED
    fast_landing_m_s = store.limited("LAND_SPEED_HIGH") * _CM
    if fast_landing_m_s:
        fixed["land_descend_speed_m_s"] = fast_landing_m_s
    slope = store.limited("RTL_CONE_SLOPE")
    fixed["return_cone_half_angle_rad"] = math.atan(1.0 / slope) if slope else 0.0
    fixed["return_min_distance_m"] = math.inf
    behaviour = {1: YawBehaviour.TOWARDS_TARGET, 2: YawBehaviour.TOWARDS_TARGET, 3: YawBehaviour.ALONG_TRACK}
    fixed["yaw_behaviour"] = behaviour.get(integer(store, "WP_YAW_BEHAVIOR"), YawBehaviour.KEEP)
    radius_m = store.limited("CIRCLE_RADIUS") * _CM
    rate_rad_s = clamp(abs(store.get("CIRCLE_RATE")) * _DEG, 0.01, 1.6)
    fixed["orbit_speed_m_s"] = clamp(radius_m * rate_rad_s, 0.1, 20.0)
    if store.get("WPNAV_ACCEL_C") > 0.0:
        fixed["corner_acceleration_m_s2"] = store.limited("WPNAV_ACCEL_C") * _CM
    fence = fence_parameters(store, _FENCE)
    if fence.enabled and fence.height_max_m > 0.0:
        fixed["return_height_max_m"] = max(1.0, fence.height_max_m - fence.margin_m)
    fixed["return_stays_at_m"] = store.limited("RTL_ALT_FINAL") * _CM
    fixed["rally"] = rally_rule(store, within_fence=True)
    fixed["nose_follows_roi"] = not integer(store, "MNT1_TYPE")
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
        speed_xy_max_m_s=max(12.0, store.limited("WPNAV_SPEED") * _CM),
        speed_up_max_m_s=max(3.0, store.limited("WPNAV_SPEED_UP") * _CM),
        speed_down_max_m_s=max(1.5, store.limited("WPNAV_SPEED_DN") * _CM),
        tilt_max_rad=store.limited("ANGLE_MAX") * _CENTIDEGREE,
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
    return integer(store, "EK3_SRC1_POSXY") == _SOURCE_GPS


def _exempt(options: int, table: Mapping[int, tuple[FlightMode, ...]]) -> frozenset[FlightMode]:
    return frozenset(mode for bit, modes in table.items() if options & bit for mode in modes)
