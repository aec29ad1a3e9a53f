"""Whatever a parameter selects as a failsafe's action, the vehicle has the mode that it leads to."""

import itertools
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import pytest

from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.commander.failsafe import failsafe_mode
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.situation import Situation
from autopilot_bridge.firmware import FLAVOUR_NAMES, get_flavour
from autopilot_bridge.firmware.flavour import Flavour
from autopilot_bridge.parameters import ParameterStore
from flightsim.airframe import AirframeKind

_WITHOUT_MODE = {FailsafeAction.NONE, FailsafeAction.WARN, FailsafeAction.DISARM}


def actions_in(value: Any) -> Iterator[FailsafeAction]:
    """The actions in a parameter object, nested ones too."""
    for field in fields(value):
        entry = getattr(value, field.name)
        if isinstance(entry, FailsafeAction):
            yield entry
        elif hasattr(entry, "__dataclass_fields__"):
            yield from actions_in(entry)


def possible_actions(flavour: Flavour) -> set[FailsafeAction]:
    """The actions that some value of some parameter selects."""
    store = ParameterStore(flavour.parameter_definitions())
    found = set(actions_in(flavour.commander_parameters(store)))
    for definition in store.definitions:
        if not definition.is_integer or definition.name.startswith(("SYSID", "MAV_")):
            continue
        for value in range(-1, 12):
            store.set(definition.name, value, check_range=False)
            found.update(actions_in(flavour.commander_parameters(store)))
        store.set(definition.name, definition.default, check_range=False)
    return found - _WITHOUT_MODE


@pytest.mark.parametrize("kind", AirframeKind)
@pytest.mark.parametrize("name", FLAVOUR_NAMES)
def test_every_failsafe_ends_in_a_mode_of_the_vehicle(name: str, kind: AirframeKind) -> None:
    flavour = get_flavour(name, kind)
    actions = possible_actions(flavour)
    assert FailsafeAction.RETURN in actions
    for action, position, home, sticks, mode in itertools.product(
        actions, (False, True), (False, True), (False, True), flavour.policy.flown_modes
    ):
        situation = Situation(mode=mode, position=position, home_set=home, armed=True, airborne=True)
        flown = failsafe_mode(action, situation, flavour.policy, sticks_valid=sticks)
        assert flown in flavour.modes.custom and flown in flavour.modes.names, (action, situation)


def test_a_return_without_a_home() -> None:
    lost = Situation(position=True, home_set=False)
    for name, kind, mode in (
        ("px4", AirframeKind.MULTICOPTER, FlightMode.LAND),
        ("px4", AirframeKind.FIXED_WING, FlightMode.LAND),
        ("ardupilot", AirframeKind.MULTICOPTER, FlightMode.LAND),
        ("ardupilot", AirframeKind.FIXED_WING, FlightMode.RETURN),
    ):
        policy = get_flavour(name, kind).policy
        assert failsafe_mode(FailsafeAction.RETURN, lost, policy, sticks_valid=False) is mode


def test_arduplane_short_failsafe_to_fbwb() -> None:
    """FS_SHORT_ACTN 4."""
    policy = get_flavour("ardupilot", AirframeKind.FIXED_WING).policy
    there = Situation(position=True, home_set=True)
    assert failsafe_mode(FailsafeAction.ALTITUDE, there, policy, sticks_valid=True) is FlightMode.FBWB
