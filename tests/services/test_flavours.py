"""Flavours: mode numbers, base_mode, identity and parameter mappings against docs/firmware."""

import math

import pytest

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from autopilot_bridge.firmware import FLAVOUR_NAMES, get_flavour
from autopilot_bridge.firmware.ardupilot.copter import modes as ardupilot_modes
from autopilot_bridge.firmware.flavour import ModeDisplay
from autopilot_bridge.firmware.px4.copter import modes as px4_modes
from autopilot_bridge.parameters import ParameterStore
from flightsim.airframe import AirframeKind

M = FlightMode

PX4_MODES = [
    (M.MANUAL, 0x00010000, 0x51),
    (M.ALTITUDE, 0x00020000, 0x51),
    (M.POSITION, 0x00030000, 0x51),
    (M.ORBIT, 0x01030000, 0x11),
    (M.POSITION_SLOW, 0x02030000, 0x51),
    (M.ACRO, 0x00050000, 0x41),
    (M.OFFBOARD, 0x00060000, 0x01),
    (M.STABILIZED, 0x00070000, 0x51),
    (M.TAKEOFF, 0x02040000, 0x1D),
    (M.HOLD, 0x03040000, 0x1D),
    (M.MISSION, 0x04040000, 0x1D),
    (M.RETURN, 0x05040000, 0x1D),
    (M.LAND, 0x06040000, 0x1D),
    (M.FOLLOW, 0x08040000, 0x11),
    (M.PRECISION_LAND, 0x09040000, 0x1D),
]


def display(mode: FlightMode, **changes: bool) -> ModeDisplay:
    fields = {
        "armed": False,
        "booted": True,
        "landed": True,
        "attitude_setpoints": False,
        "thrust_setpoints": False,
    }
    return ModeDisplay(mode=mode, **{**fields, **changes})


@pytest.mark.parametrize(("mode", "custom", "base"), PX4_MODES)
def test_px4_heartbeat_fields(mode: FlightMode, custom: int, base: int) -> None:
    flavour = get_flavour("px4")
    assert flavour.modes.custom[mode] == custom
    assert flavour.modes.base_mode(display(mode)) == base
    assert flavour.modes.base_mode(display(mode, armed=True)) == base | 0x80


def test_px4_offboard_shows_what_is_streamed() -> None:
    base = get_flavour("px4").modes.base_mode
    assert base(display(M.OFFBOARD, armed=True, attitude_setpoints=True)) == 0x91
    assert base(display(M.OFFBOARD, armed=True)) == 0x81
    assert base(display(M.OFFBOARD, attitude_setpoints=True)) == 0x11


@pytest.mark.parametrize(("mode", "custom", "_base"), [row for row in PX4_MODES if row[0] is not M.ORBIT])
def test_px4_modes_can_be_commanded_by_their_numbers(mode: FlightMode, custom: int, _base: int) -> None:
    assert px4_modes.commanded_mode(custom >> 16 & 0xFF, custom >> 24) is mode


@pytest.mark.parametrize("main", [0, 8, 9, 10, 11, 99])
def test_px4_unknown_main_modes(main: int) -> None:
    assert px4_modes.commanded_mode(main, 0) is None


ARDUPILOT_MODES = [
    (0, M.STABILIZED, 81),
    (1, M.ACRO, 81),
    (2, M.ALTITUDE, 81),
    (3, M.MISSION, 89),
    (4, M.GUIDED, 89),
    (5, M.HOLD, 89),
    (6, M.RETURN, 81),
    (7, M.CIRCLE, 89),
    (9, M.LAND, 89),
    (11, M.DRIFT, 81),
    (16, M.POSHOLD, 89),
    (17, M.BRAKE, 89),
    (20, M.GUIDED_NOGPS, 89),
]


@pytest.mark.parametrize(("number", "mode", "base"), ARDUPILOT_MODES)
def test_ardupilot_heartbeat_fields(number: int, mode: FlightMode, base: int) -> None:
    flavour = get_flavour("ardupilot")
    assert flavour.modes.custom[mode] == number
    assert ardupilot_modes.commanded_mode(number) is mode
    assert flavour.modes.base_mode(display(mode)) == base


def test_ardupilot_base_mode_in_flight() -> None:
    base = get_flavour("ardupilot").modes.base_mode
    assert base(display(M.STABILIZED, armed=True)) == 209
    assert base(display(M.GUIDED, armed=True)) == 217
    assert base(display(M.GUIDED, armed=True, thrust_setpoints=True)) == 209
    assert base(display(M.RETURN, armed=True)) == 217
    assert base(display(M.STABILIZED, booted=False)) == 89


@pytest.mark.parametrize("number", [8, 10, 12, 13, 14, 15, 22, 25, 26, 27, 28, 29, 99])
def test_ardupilot_numbers_that_are_refused(number: int) -> None:
    assert ardupilot_modes.commanded_mode(number) is None


@pytest.mark.parametrize("kind", AirframeKind)
@pytest.mark.parametrize("name", FLAVOUR_NAMES)
def test_every_mode_the_commander_can_end_in_is_shown(name: str, kind: AirframeKind) -> None:
    flavour = get_flavour(name, kind)
    policy = flavour.policy
    ends = {FlightMode.TERMINATION, policy.boot_mode, policy.fallback_land, policy.reposition_mode}
    for mode in policy.ground_modes | policy.flown_modes | ends - {None}:
        assert mode in flavour.modes.custom
        assert mode in flavour.modes.names


@pytest.mark.parametrize("name", FLAVOUR_NAMES)
def test_a_flavour_is_complete(name: str) -> None:
    flavour = get_flavour(name)
    policy = flavour.policy
    assert policy.boot_mode in policy.ground_modes
    assert policy.armable_modes <= policy.ground_modes
    assert policy.reposition_mode in policy.flown_modes
    for mode in policy.ground_modes | policy.flown_modes | {policy.fallback_land}:
        assert mode in flavour.modes.custom and mode in flavour.modes.names
    assert flavour.command_address(7).system_id == 7


def test_unknown_flavours_are_named() -> None:
    with pytest.raises(ValueError, match=r"'betaflight'.*px4, ardupilot"):
        get_flavour("betaflight")


def test_identities() -> None:
    px4, ardupilot = get_flavour("px4").identity, get_flavour("ardupilot").identity
    assert (px4.capabilities, px4.flight_sw_version) == (59647, 0x011001FF)
    assert (ardupilot.capabilities, ardupilot.flight_custom_version) == (0xFBEF, b"3fc7011a")


@pytest.mark.parametrize("name", FLAVOUR_NAMES)
def test_under_the_airframe_the_control_laws_are_tuned(name: str) -> None:
    flavour = get_flavour(name)
    store = ParameterStore(flavour.parameter_definitions(), flavour.airframe)
    tuned, mapped = MulticopterParameters(), flavour.controller_parameters(store)
    for field in (
        "pos_xy_p_1_s",
        "vel_xy_p_1_s",
        "vel_xy_i_1_s2",
        "hover_thrust",
        "roll_p_1_s",
        "rate_roll_p",
    ):
        assert getattr(mapped, field) == pytest.approx(getattr(tuned, field), rel=1e-5)


def test_parameters_are_converted_to_si() -> None:
    flavour = get_flavour("ardupilot")
    store = ParameterStore(
        flavour.parameter_definitions(), {"WPNAV_SPEED": 800.0, "RTL_ALT": 2500.0, "ANGLE_MAX": 4500.0}
    )
    flight = flavour.flight_parameters(store)
    assert flight.cruise_speed_m_s == pytest.approx(8.0)
    assert flight.return_speed_m_s == pytest.approx(8.0)
    assert flight.return_altitude_m == pytest.approx(25.0)
    assert flavour.controller_parameters(store).tilt_max_rad == pytest.approx(math.radians(45.0))


def test_failsafe_parameters_of_px4() -> None:
    flavour = get_flavour("px4")
    store = ParameterStore(flavour.parameter_definitions(), {"COM_OF_LOSS_T": 3.0, "COM_RCL_EXCEPT": 4})
    parameters = flavour.commander_parameters(store)
    assert parameters.offboard_loss_s == 3.0
    assert parameters.manual_loss_exempt == frozenset({M.OFFBOARD})
