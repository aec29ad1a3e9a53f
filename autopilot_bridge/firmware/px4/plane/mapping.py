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
from autopilot_bridge.firmware.mapping import build, clamp, field_values, integer, load_tables, scaled_values
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
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters, LaunchKind, TurnInRule
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.parameters import ParameterStore
from flightsim.flight_envelope import FlightEnvelope

_TABLES: Final = load_tables("px4.plane")
_DEG: Final = math.radians(1.0)
_TERMINATION_OFF: Final = 121212  # CBRK_FLIGHTTERM
_DATA_CHECKS: Final = 1 | 2 | 4  # ASPD_DO_CHECKS: missing, stuck, innovation
_NEVER_S: Final = 1e6
_LEAST_CLIMB_M_S: Final = 0.1  # of the control laws
_ROTATION_SHARE: Final = 0.9  # RWTO_ROT_AIRSPD -1: of the climb-out's airspeed

_LOW_ACCURACY: Final = _TABLES.actions["COM_POS_LOW_ACT"]

CONTROLLER: Final = _TABLES.fields["controller"]
AIRFRAME_FLIGHT: Final = _TABLES.fields["airframe_flight"]
"""What an airframe file sets of the flight tasks."""

FLIGHT: Final = (*AIRFRAME_FLIGHT, *_TABLES.fields["flight"])
NAVIGATION: Final = (*px4_mapping.NAVIGATION, *_TABLES.fields["navigation"])
NAVIGATION_RATIOS: Final = (*px4_mapping.NAVIGATION_RATIOS, *_TABLES.ratios["navigation"])
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
