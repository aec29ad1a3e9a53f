"""The radio: the mode switch, the arming gesture, and overrides that expire."""

import math
from types import SimpleNamespace
from typing import Any

import pytest

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.flight.context import ManualInput
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.inputs.transmitter import ArmingGesture, ModeSwitch, Radio
from flightsim.airframe import AirframeKind
from tests.services.command_rig import MANUAL

COPTER, PLANE = AirframeKind.MULTICOPTER, AirframeKind.FIXED_WING


class Pilot:
    """The part of the commander that switches and gestures use."""

    def __init__(self) -> None:
        self.modes: list[FlightMode] = []
        self.calls: list[str] = []
        self.armed, self.landed, self.mode = False, True, FlightMode.STABILIZED
        self.context = SimpleNamespace(sticks=ManualInput())

    def set_mode(self, mode: FlightMode) -> None:
        self.modes.append(mode)

    def arm(self, *, by_rudder: bool = False) -> None:
        self.calls.append("arm")

    def disarm(self) -> None:
        self.calls.append("disarm")


class Switch:
    """A mode switch on channel 5 whose first position is in effect at boot."""

    def __init__(self, flavour: str, first_us: int = 1000, **parameters: float) -> None:
        described = get_flavour(flavour, COPTER)
        channel = {"RC_MAP_FLTMODE": 5} if flavour == "px4" else {"FLTMODE_CH": 5}
        store = ParameterStore(described.parameter_definitions(), {**channel, **parameters})
        self.pilot, self.radio = Pilot(), Radio()
        self.radio.override(4, first_us, 0)
        rules = MANUAL[flavour, COPTER].mode_switch
        self.switch = ModeSwitch(self.pilot, store, self.radio, rules)  # type: ignore[arg-type]

    def turn(self, pulse_us: int, held_us: int = 200_000, start_us: int = 1_000_000) -> list[FlightMode]:
        """Every mode chosen after the switch was in this position for a time."""
        self.radio.override(4, pulse_us, start_us)
        self.switch.tick(start_us)
        self.switch.tick(start_us + held_us)
        return self.pilot.modes


SIX = (FlightMode.MISSION, FlightMode.HOLD, FlightMode.RETURN, FlightMode.ACRO, FlightMode.LAND)
PX4_SLOTS = {f"COM_FLTMODE{k}": number for k, number in enumerate((2, 3, 4, 5, 6, 11), 1)}
ARDUPILOT_SLOTS = {f"FLTMODE{k}": number for k, number in enumerate((4, 3, 5, 6, 1, 9), 1)}


@pytest.mark.parametrize(
    ("flavour", "slots", "limits_us"),
    [
        ("px4", PX4_SLOTS, (1167, 1333, 1500, 1667, 1833)),
        ("ardupilot", ARDUPILOT_SLOTS, (1231, 1361, 1491, 1621, 1750)),
    ],
)
def test_the_six_positions_of_the_mode_switch(
    flavour: str, slots: dict[str, float], limits_us: tuple[int, ...]
) -> None:
    """A limit belongs to the position above it."""
    first = FlightMode.POSITION if flavour == "px4" else FlightMode.GUIDED
    modes = (first, *SIX)
    for k, limit_us in enumerate(limits_us):
        assert Switch(flavour, 2100 if k < 2 else 1000, **slots).turn(limit_us - 1) == [modes[k]]
        assert Switch(flavour, 2100 if k < 2 else 1000, **slots).turn(limit_us) == [modes[k + 1]]


@pytest.mark.parametrize(
    ("number", "mode"),
    [
        (0, FlightMode.MANUAL),
        (1, FlightMode.ALTITUDE),
        (2, FlightMode.POSITION),
        (3, FlightMode.MISSION),
        (4, FlightMode.HOLD),
        (5, FlightMode.RETURN),
        (6, FlightMode.ACRO),
        (7, FlightMode.OFFBOARD),
        (8, FlightMode.STABILIZED),
        (9, None),
        (10, FlightMode.TAKEOFF),
        (11, FlightMode.LAND),
        (12, FlightMode.FOLLOW),
        (13, FlightMode.PRECISION_LAND),
        (14, None),
        (-1, None),
    ],
)
def test_px4s_numbers_of_modes_on_the_switch(number: int, mode: FlightMode | None) -> None:
    assert Switch("px4", COM_FLTMODE6=number).turn(2000) == ([] if mode is None else [mode])


def test_the_switch_settles_for_a_fifth_of_a_second_and_acts_once() -> None:
    assert Switch("px4", **PX4_SLOTS).turn(2000, 199_999) == []
    switch = Switch("px4", **PX4_SLOTS)
    assert switch.turn(2000) == [FlightMode.LAND]
    switch.switch.tick(9_000_000)
    assert switch.pilot.modes == [FlightMode.LAND]
    assert switch.turn(1000, start_us=10_000_000)[1:] == [FlightMode.POSITION]


def test_the_position_at_boot_chooses_no_mode() -> None:
    assert Switch("px4", first_us=2000, **PX4_SLOTS).turn(2000) == []


@pytest.mark.parametrize(
    ("pulse_us", "valid"), [(900, False), (901, True), (2199, True), (2200, False), (0, False)]
)
def test_an_impossible_pulse_is_no_position(pulse_us: int, valid: bool) -> None:
    first_us = 1500 if pulse_us < 1500 else 1000
    assert bool(Switch("px4", first_us, **PX4_SLOTS).turn(pulse_us)) == valid


@pytest.mark.parametrize(("channel", "there"), [(0, False), (1, True), (18, True)])
def test_the_channel_of_the_switch_counts_from_1(channel: int, there: bool) -> None:
    switch = Switch("px4", RC_MAP_FLTMODE=channel, **PX4_SLOTS)
    for other in range(18):
        switch.radio.override(other, 1000, 0)
    switch.radio.override((channel or 18) - 1, 2000, 0)
    switch.switch.tick(1_000_000)
    switch.switch.tick(1_200_000)
    assert switch.pilot.modes == ([FlightMode.LAND] if there else [])


# the arming gesture


def gesture(flavour: str, kind: AirframeKind = COPTER, **parameters: float) -> tuple[Any, Pilot]:
    described = get_flavour(flavour, kind)
    store = ParameterStore(described.parameter_definitions(), parameters)
    pilot = Pilot()
    return ArmingGesture(pilot, store, MANUAL[flavour, kind].gesture), pilot  # type: ignore[arg-type]


def hold(made: tuple[Any, Pilot], seconds: float, **sticks: Any) -> list[str]:
    """What the pilot has done after holding the sticks, and releasing them."""
    detector, pilot = made
    values = {"throttle": -1.0, "yaw": 1.0, "valid": True, **sticks}
    pilot.context.sticks = ManualInput(**values)
    detector.tick(5_000_000)
    detector.tick(5_000_000 + round(seconds * 1e6))
    detector.tick(5_000_000 + round(seconds * 1e6) + 1)
    pilot.context.sticks = ManualInput(throttle=-1.0, valid=True)
    detector.tick(90_000_000)
    return pilot.calls


@pytest.mark.parametrize(
    ("flavour", "kind", "held_s"),
    [("px4", COPTER, 1.0), ("ardupilot", COPTER, 2.0), ("ardupilot", PLANE, 3.0)],
)
def test_how_long_the_sticks_are_held(flavour: str, kind: AirframeKind, held_s: float) -> None:
    assert hold(gesture(flavour, kind), held_s - 2e-6) == []
    assert hold(gesture(flavour, kind), held_s) == ["arm"]
    made = gesture(flavour, kind, **({"ARMING_RUDDER": 2} if flavour == "ardupilot" else {}))
    made[1].armed = True
    assert hold(made, held_s, yaw=1.0) == []
    assert hold(made, held_s, yaw=-1.0) == ["disarm"]


def test_px4s_time_is_a_parameter() -> None:
    assert hold(gesture("px4", COM_RC_ARM_HYST=500), 0.5) == ["arm"]
    assert hold(gesture("px4", COM_RC_ARM_HYST=500), 0.499) == []


@pytest.mark.parametrize(
    ("flavour", "sticks", "arms"),
    [
        ("px4", {"throttle": -0.8}, True),
        ("px4", {"throttle": -0.79}, False),
        ("px4", {"yaw": 0.9}, False),
        ("px4", {"yaw": 0.91}, True),
        ("px4", {"roll": 0.1, "pitch": -0.1}, True),
        ("px4", {"roll": 0.11}, False),
        ("px4", {"pitch": -0.11}, False),
        ("px4", {"valid": False}, False),
        ("px4", {"simulated": True}, False),
        ("ardupilot", {"throttle": -0.95}, True),
        ("ardupilot", {"throttle": -0.94}, False),
        ("ardupilot", {"yaw": 0.89}, False),
        ("ardupilot", {"yaw": 0.9}, True),
        ("ardupilot", {"roll": 1.0}, True),  # the other stick does not matter
    ],
)
def test_the_positions_of_the_sticks(flavour: str, sticks: dict[str, Any], arms: bool) -> None:
    assert hold(gesture(flavour), 5.0, **sticks) == (["arm"] if arms else [])
    made = gesture(flavour)
    made[1].armed = True
    mirrored = {**sticks, "yaw": -sticks.get("yaw", 1.0)}
    assert hold(made, 5.0, **mirrored) == (["disarm"] if arms else [])


@pytest.mark.parametrize(
    ("flavour", "name", "value", "calls"),
    [
        ("px4", "MAN_ARM_GESTURE", 0, []),
        ("px4", "MAN_ARM_GESTURE", 1, ["arm", "disarm"]),
        ("ardupilot", "ARMING_RUDDER", 0, []),
        ("ardupilot", "ARMING_RUDDER", 1, ["arm"]),
        ("ardupilot", "ARMING_RUDDER", 2, ["arm", "disarm"]),
    ],
)
def test_the_parameter_allows_arming_and_disarming(
    flavour: str, name: str, value: int, calls: list[str]
) -> None:
    made = gesture(flavour, **{name: value})
    hold(made, 5.0)
    made[1].armed = True
    assert hold(made, 5.0, yaw=-1.0) == calls


def test_px4_arms_by_the_sticks_in_modes_flown_by_the_sticks() -> None:
    for flavour, calls in (("px4", []), ("ardupilot", ["arm"])):
        made = gesture(flavour)
        made[1].mode = FlightMode.HOLD
        assert hold(made, 5.0) == calls


def test_nothing_disarms_in_the_air() -> None:
    made = gesture("px4")
    made[1].armed, made[1].landed = True, False
    assert hold(made, 5.0, yaw=-1.0) == []


# overrides


def test_an_override_expires_when_it_is_older_than_the_timeout() -> None:
    radio = Radio((1500, 1400))
    radio.override(0, 1900, 1_000_000)
    radio.override(1, 1800, 2_000_000)
    radio.expire(9_000_000, -1.0)  # never
    radio.expire(4_000_000, 3.0)
    assert radio.pulses_us[:3] == [1900, 1800, 0] and radio.overridden
    radio.expire(4_000_001, 3.0)
    assert radio.pulses_us[:2] == [1500, 1800] and radio.is_overridden((0, 1))
    radio.release(1)
    assert radio.pulses_us == [1500, 1400] + [0] * 16
    assert not radio.overridden and not radio.is_overridden((0, 1))


def test_a_pulse_as_a_stick() -> None:
    radio = Radio((1250,))
    assert (radio.stick(0), radio.stick(1)) == (-0.5, 0.0)
    radio.override(0, 2000, 0)
    assert radio.stick(0) == 1.0 and not math.isnan(radio.stick(17))
