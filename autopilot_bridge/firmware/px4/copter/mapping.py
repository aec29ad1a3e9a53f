"""PX4 parameters to the typed parameters of commander, flight tasks, control laws and filter."""

from typing import Final

from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.commander.geofence_parameters import FenceParameters
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from autopilot_bridge.firmware.external_mapping import px4_external
from autopilot_bridge.firmware.mapping import build, integer, load_tables, scaled_values
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

_TABLES: Final = load_tables("px4.copter")
_OFFBOARD_LOSS: Final = _TABLES.actions["COM_OBL_RC_ACT"]
_LINK_LOSS: Final = _TABLES.actions["NAV_DLL_ACT"]  # NAV_DLL_ACT, NAV_RCL_ACT
_FENCE: Final = _TABLES.actions["GF_ACTION"]
_RETURNS: Final = {
    0: ReturnDestination.HOME,
    1: ReturnDestination.LANDING_OR_RALLY,
    2: ReturnDestination.ALONG_PLAN,
    3: ReturnDestination.CLOSEST,
    4: ReturnDestination.ALONG_PLAN_SHORTER,
}  # RTL_TYPE
_RALLY_RETURNS: Final = frozenset({0, 1, 3})
_BATTERY_CRITICAL: Final = _TABLES.actions["COM_LOW_BAT_ACT_CRITICAL"]
_BATTERY_EMERGENCY: Final = _TABLES.actions["COM_LOW_BAT_ACT_EMERGENCY"]
_EXCEPTIONS: Final = {
    1: FlightMode.MISSION,
    2: FlightMode.HOLD,
    4: FlightMode.OFFBOARD,
}  # COM_RCL_EXCEPT, COM_DLL_EXCEPT

FLIGHT: Final = _TABLES.fields["flight"]
CONTROLLER: Final = _TABLES.fields["controller"]
NAVIGATION: Final = _TABLES.fields["navigation"]
NAVIGATION_RATIOS: Final = _TABLES.ratios["navigation"]
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
        unwrapped=True,
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
