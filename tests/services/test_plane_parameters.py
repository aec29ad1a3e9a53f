"""Parameters of aircraft: tables against the recorded ones, and what they mean for the vehicle."""

import json
import math
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.firmware.ardupilot.plane import mapping as ardupilot_plane_mapping
from autopilot_bridge.firmware.ardupilot.plane.parameters import ARDUPILOT_PLANE_PARAMETERS
from autopilot_bridge.firmware.px4.plane import mapping as px4_plane_mapping
from autopilot_bridge.firmware.px4.plane.parameters import PX4_PLANE_PARAMETERS
from autopilot_bridge.flight.fixed_wing.parameters import (  # type: ignore[attr-defined]
    FixedWingFlightParameters,
    LaunchKind,
    ReturnDestination,
    TurnInRule,
)
from autopilot_bridge.parameters import ParameterDefinition, ParameterStore
from tests.services.aircraft import SMALL_AIRCRAFT

DATA = Path(__file__).parents[3] / "shared" / "data"
TABLES: dict[str, tuple[ParameterDefinition, ...]] = {
    "px4": PX4_PLANE_PARAMETERS,
    "ardupilot": ARDUPILOT_PLANE_PARAMETERS,
}
MAPPINGS: dict[str, Any] = {"px4": px4_plane_mapping, "ardupilot": ardupilot_plane_mapping}
NOT_DEFAULTS = {"SYSID_THISMAV", "BARO1_GND_PRESS", "STAT_BOOTCNT", "STAT_RUNTIME"}
STREAM_RATES = "SR0_"  # a client had changed them before they were read

FLAVOURS = pytest.mark.parametrize("flavour", ["px4", "ardupilot"])


def store_of(flavour: str, **values: float) -> ParameterStore:
    """The aircraft's airframe, and changes as a ground station makes them (without range checks)."""
    store = ParameterStore(TABLES[flavour], MAPPINGS[flavour].airframe_overrides(SMALL_AIRCRAFT))
    for name, value in values.items():
        store.set(name, value, check_range=False)
    return store


def controller_of(flavour: str, **values: float) -> FixedWingParameters:
    return MAPPINGS[flavour].controller_parameters(store_of(flavour, **values), SMALL_AIRCRAFT)


def flight_of(flavour: str, **values: float) -> FixedWingFlightParameters:
    return MAPPINGS[flavour].flight_parameters(store_of(flavour, **values), SMALL_AIRCRAFT)


@pytest.mark.parametrize(
    ("flavour", "file"), [("px4", "px4_params_plane.json"), ("ardupilot", "ardupilot_params_plane.json")]
)
def test_defaults_are_those_read_from_the_firmware(flavour: str, file: str) -> None:
    path = DATA / file
    if not path.exists():
        pytest.skip(f"{path.name} with the recorded parameters is not here")
    recorded = json.loads(path.read_text(encoding="utf-8"))
    for definition in TABLES[flavour]:
        name = definition.name
        assert name in recorded
        if name in NOT_DEFAULTS or (name.startswith(STREAM_RATES) and name != "SR0_PARAMS"):
            continue
        assert definition.default == pytest.approx(recorded[name], rel=1e-5, abs=1e-8), name
        if flavour == "px4":
            assert definition.is_integer is isinstance(recorded[name], int), name


@FLAVOURS
def test_defaults_lie_in_their_ranges(flavour: str) -> None:
    names = [definition.name for definition in TABLES[flavour]]
    assert len(set(names)) == len(names) > 400
    for definition in TABLES[flavour]:
        definition.check_range(definition.default)


def test_px4_lists_by_name() -> None:
    names = [definition.name for definition in PX4_PLANE_PARAMETERS]
    assert names == sorted(names)
    assert not any(name.startswith(("MC_", "MPC_")) for name in names)


@FLAVOURS
def test_mapped_fields_and_parameters_exist(flavour: str) -> None:
    mapping = MAPPINGS[flavour]
    names = {definition.name for definition in TABLES[flavour]}
    for table, cls in (
        (mapping.CONTROLLER, FixedWingParameters),
        (mapping.FLIGHT, FixedWingFlightParameters),
    ):
        known = {field.name for field in fields(cls)}
        assert {entry.field for entry in table} <= known
        assert {entry.name for entry in table} <= names
        assert len({entry.field for entry in table}) == len(table)


@FLAVOURS
def test_under_the_airframe_the_control_laws_fit_the_aircraft(flavour: str) -> None:
    tuned, mapped = FixedWingParameters.for_envelope(SMALL_AIRCRAFT), controller_of(flavour)
    for field in fields(tuned):
        name = field.name
        if name in ("climb_rate_target_m_s", "sink_rate_target_m_s", "throttle_slew_1_s", "airspeed_min_m_s"):
            continue  # shared with the flight tasks, or whole numbers in ArduPlane
        if name == "wheel_time_constant_s":
            continue
        assert getattr(mapped, name) == pytest.approx(getattr(tuned, name), rel=0.011, abs=1e-6), name
    assert mapped.airspeed_min_m_s == pytest.approx(tuned.airspeed_min_m_s, abs=1.0)


@FLAVOURS
def test_under_the_airframe_the_landing_fits_the_aircraft(flavour: str) -> None:
    tuned, mapped = FixedWingFlightParameters.for_envelope(SMALL_AIRCRAFT), flight_of(flavour)
    for name in (
        "airspeed_trim_m_s",
        "bank_max_rad",
        "takeoff_pitch_min_rad",
        "rotation_airspeed_m_s",
        "flare_height_m",
        "flare_time_s",
        "flare_sink_m_s",
        "ground_bank_max_rad",
        "guidance_period_s",
    ):
        assert getattr(mapped, name) == pytest.approx(getattr(tuned, name), rel=1e-3), name
    assert mapped.landing_airspeed_m_s == pytest.approx(tuned.landing_airspeed_m_s, abs=0.5)
    assert mapped.loiter_radius_m == pytest.approx(tuned.loiter_radius_m, abs=0.5)


def test_px4_habits() -> None:
    flight = flight_of("px4")
    assert (flight.return_altitude_m, flight.return_loiter_time_s) == (100.0, -1.0)
    assert flight.return_destination is ReturnDestination.LANDING_OR_RALLY
    assert flight_of("px4", RTL_TYPE=0).return_destination is ReturnDestination.HOME
    assert flight.turn_in is TurnInRule.SWITCH_DISTANCE
    assert (flight.takeoff_altitude_m, flight.acceptance_radius_m) == (25.0, 10.0)
    assert flight.launch is LaunchKind.RUNWAY
    assert flight_of("px4", RWTO_TKOFF=0, FW_LAUN_DETCN_ON=1).launch is not LaunchKind.RUNWAY
    assert flight_of("px4", FW_LND_AIRSPD=-1.0).landing_airspeed_m_s == pytest.approx(17.6)
    assert flight_of("px4", FW_TKO_AIRSPD=20.0, RWTO_ROT_AIRSPD=-1.0).rotation_airspeed_m_s == pytest.approx(
        18.0
    )
    assert flight_of("px4", FW_GPSF_R=20.0).position_lost_bank_rad == pytest.approx(math.radians(20.0))


def test_arduplane_habits() -> None:
    flight = flight_of("ardupilot")
    assert (flight.return_altitude_m, flight.return_climbs) == (100.0, False)
    as_high_as_now = flight_of("ardupilot", RTL_ALTITUDE=-1.0)
    assert (as_high_as_now.return_climbs, as_high_as_now.return_descend_altitude_m) == (True, math.inf)
    assert flight.return_destination is ReturnDestination.HOME
    assert (
        flight_of("ardupilot", RTL_AUTOLAND=1).return_destination
        is ReturnDestination.HOME_THEN_LANDING_SEQUENCE
    )
    assert flight_of("ardupilot", RTL_AUTOLAND=2).return_destination is ReturnDestination.LANDING_SEQUENCE
    assert flight.return_loiter_radius_m == flight.loiter_radius_m == 125.0
    assert flight_of("ardupilot", RTL_RADIUS=-200).return_loiter_radius_m == -200.0
    assert flight_of("ardupilot", WP_LOITER_RAD=-150).loiter_radius_m == -150.0
    assert (flight.takeoff_altitude_m, flight.acceptance_radius_m) == (50.0, 50.0)
    assert flight.turn_in is TurnInRule.TURN_ANGLE
    assert math.isinf(flight.acceptance_altitude_m)
    assert flight.launch_delay_s == pytest.approx(0.2)
    assert flight_of("ardupilot", TKOFF_THR_MINACC=12.0).launch is not LaunchKind.RUNWAY
    assert flight_of("ardupilot", TECS_LAND_ARSPD=-1.0).landing_airspeed_m_s == pytest.approx(21.5)
    assert controller_of("ardupilot", TECS_PITCH_MAX=12).pitch_max_rad == pytest.approx(math.radians(12.0))
    assert controller_of("ardupilot", TECS_TIME_CONST=2.0).airspeed_time_constant_s == pytest.approx(
        controller_of("ardupilot").airspeed_time_constant_s
        * 2.0
        / controller_of("ardupilot").height_time_constant_s
    )


@FLAVOURS
def test_a_gliders_motor_is_not_flown(flavour: str) -> None:
    name = "CA_ROTOR_COUNT" if flavour == "px4" else "SERVO3_FUNCTION"
    assert controller_of(flavour).powered
    assert not controller_of(flavour, **{name: 0}).powered


def test_failsafes_of_px4() -> None:
    parameters = px4_plane_mapping.commander_parameters(store_of("px4"))
    assert parameters.position_accuracy_max_m == 50.0
    assert parameters.position_accuracy_low_action is FailsafeAction.RETURN
    assert parameters.attitude_action is FailsafeAction.WARN
    changed = store_of("px4", COM_POS_FS_EPH=-1.0, CBRK_FLIGHTTERM=0, FD_FAIL_R=45)
    parameters = px4_plane_mapping.commander_parameters(changed)
    assert math.isinf(parameters.position_accuracy_max_m)
    assert parameters.attitude_action is FailsafeAction.TERMINATE
    assert parameters.attitude_roll_max_rad == pytest.approx(math.radians(45.0))


def test_failsafes_of_arduplane() -> None:
    commander_parameters = ardupilot_plane_mapping.commander_parameters
    parameters = commander_parameters(store_of("ardupilot"))
    assert (parameters.manual_loss_s, parameters.manual_loss_action) == (1.5, FailsafeAction.CIRCLE)
    assert (parameters.manual_long_loss_s, parameters.manual_long_loss_action) == (5.0, FailsafeAction.RETURN)
    assert parameters.gcs_loss_s == 0.0
    assert {FlightMode.MISSION, FlightMode.GUIDED, FlightMode.HOLD} <= parameters.manual_long_loss_exempt
    assert parameters.position_loss_action is FailsafeAction.NONE
    assert parameters.disarm_landed_s == 20.0
    changed = commander_parameters(store_of("ardupilot", FS_GCS_ENABL=1, FS_LONG_ACTN=2, FS_SHORT_ACTN=3))
    assert (changed.gcs_loss_s, changed.gcs_loss_action) == (5.0, FailsafeAction.GLIDE)
    assert FlightMode.MISSION not in changed.gcs_loss_exempt
    assert changed.manual_loss_action is FailsafeAction.NONE
    assert commander_parameters(store_of("ardupilot", THR_FAILSAFE=0)).manual_loss_s == 0.0


@FLAVOURS
def test_navigation_of_an_aircraft(flavour: str) -> None:
    navigation = MAPPINGS[flavour].navigation_parameters
    assert navigation(store_of(flavour)).fixed_wing
    assert navigation(store_of(flavour)).use_airspeed
    off = {"px4": "EKF2_ARSP_THR", "ardupilot": "ARSPD_USE"}[flavour]
    assert not navigation(store_of(flavour, **{off: 0})).use_airspeed
    noise = {"px4": "EKF2_EAS_NOISE", "ardupilot": "EK3_EAS_M_NSE"}[flavour]
    default = next(d.default for d in TABLES[flavour] if d.name == noise)
    louder = navigation(store_of(flavour, **{noise: 2.0 * default}))
    assert louder.airspeed_noise_m_s == pytest.approx(2.0 * navigation(store_of(flavour)).airspeed_noise_m_s)


def flyable(controller: FixedWingParameters, flight: FixedWingFlightParameters) -> None:
    stall = SMALL_AIRCRAFT.stall_speed_m_s
    for parameters in (controller, flight):
        assert parameters.airspeed_min_m_s >= 1.04 * stall
        assert parameters.airspeed_min_m_s <= parameters.airspeed_trim_m_s <= parameters.airspeed_max_m_s
        assert parameters.airspeed_trim_m_s <= SMALL_AIRCRAFT.airspeed_max_m_s + 1e-9
    assert flight.landing_airspeed_m_s >= 1.04 * stall
    assert flight.rotation_airspeed_m_s <= flight.takeoff_airspeed_m_s
    assert controller.throttle_max >= SMALL_AIRCRAFT.trim_throttle + 0.1
    assert controller.throttle_min <= 0.6 * SMALL_AIRCRAFT.trim_throttle
    assert controller.roll_limit_rad >= 0.19
    assert controller.pitch_min_rad < 0.0 < controller.pitch_max_rad
    turn = flight.airspeed_trim_m_s**2 / (9.80665 * math.tan(flight.bank_max_rad))
    assert abs(flight.loiter_radius_m) >= turn - 1e-6


VALUES = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False, width=32),
    st.floats(min_value=-1e3, max_value=1e3, width=32),
    st.sampled_from([0.0, -1.0, 1.0, 100.0]),
)


@FLAVOURS
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_nothing_a_ground_station_sets_makes_it_unflyable(flavour: str, data: st.DataObject) -> None:
    mapping = MAPPINGS[flavour]
    names = sorted({entry.name for entry in (*mapping.CONTROLLER, *mapping.FLIGHT, *mapping.NAVIGATION)})
    store = store_of(flavour)
    for name in data.draw(st.lists(st.sampled_from(names), min_size=1, max_size=30, unique=True)):
        definition = store.find(name)
        assert definition is not None
        value = data.draw(VALUES)
        if definition.is_integer:
            value = max(-127, min(126, int(value)))
        store.set(name, value, check_range=False)
    controller = mapping.controller_parameters(store, SMALL_AIRCRAFT)
    flight = mapping.flight_parameters(store, SMALL_AIRCRAFT)
    mapping.navigation_parameters(store)
    mapping.commander_parameters(store)
    flyable(controller, flight)
    tuned = FixedWingParameters.for_envelope(SMALL_AIRCRAFT)
    assert 0.09 <= controller.rate_roll_p / tuned.rate_roll_p <= 3.01
    assert 0.59 <= controller.roll_time_constant_s / tuned.roll_time_constant_s <= 4.01
