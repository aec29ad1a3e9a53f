"""Received messages reach the services by message id."""

from collections import Counter
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.autopilot import Autopilot
from autopilot_bridge.dispatch import command, streams
from autopilot_bridge.firmware import FLAVOUR_NAMES, get_flavour
from autopilot_bridge.mavlink import FrameParser
from autopilot_bridge.services.microservice import Microservice
from flightsim.airframe import AirframeKind
from flightsim.interface import SensorReadings
from tests.services.aircraft import SMALL_AIRCRAFT
from tests.services.command_rig import Channel

HEARTBEAT = mavlink.MAVLINK_MSG_ID_HEARTBEAT


def autopilot_of(flavour: str, kind: AirframeKind = AirframeKind.MULTICOPTER) -> Autopilot:
    return Autopilot(
        get_flavour(flavour, kind),
        system_id=1,
        readings=SensorReadings(),
        physics_rate_hz=250,
        envelope=SMALL_AIRCRAFT if kind is AirframeKind.FIXED_WING else None,
    )


@pytest.mark.parametrize("kind", AirframeKind)
@pytest.mark.parametrize("flavour", FLAVOUR_NAMES)
def test_a_message_belongs_to_one_service(flavour: str, kind: AirframeKind) -> None:
    """HEARTBEAT alone is of interest to several; a second owner of another message would answer it twice."""
    table = autopilot_of(flavour, kind)._receivers
    assert {message_id for message_id, receivers in table.items() if len(receivers) != 1} == {HEARTBEAT}
    owners = [receiver.__self__ for receiver in table[HEARTBEAT]]
    assert [type(owner).__name__ for owner in owners] == [
        "ManualService",
        "PayloadCommands",
        "StatusTextService",
    ]


@pytest.mark.parametrize("kind", AirframeKind)
@pytest.mark.parametrize("flavour", FLAVOUR_NAMES)
def test_a_command_belongs_to_one_service(flavour: str, kind: AirframeKind) -> None:
    autopilot = autopilot_of(flavour, kind)
    owners = Counter(number for service in autopilot._services for number in service.commands)
    assert [number for number, count in owners.items() if count > 1] == [] and len(owners) > 40


class Base(Microservice):
    @command(1, 2)
    def first(self) -> str:
        return "base"

    @streams(1)
    def third(self) -> str:
        return "stream"


class Child(Base):
    def first(self) -> str:
        return "child"

    @command(2, 3)
    def second(self) -> str:
        return "second"


def test_an_overridden_method_keeps_its_numbers_and_a_later_declaration_replaces_it() -> None:
    commands: Any = Child().commands
    assert {number: take() for number, take in commands.items()} == {1: "child", 2: "second", 3: "second"}
    commands = Base().commands
    assert {number: take() for number, take in commands.items()} == {1: "base", 2: "base"}
    assert list(Child().builders) == [1] and not Child().receivers and not Child().on_demand


def test_a_message_that_no_service_handles_is_not_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    autopilot, decoded = autopilot_of("px4"), []
    monkeypatch.setattr("autopilot_bridge.autopilot.autopilot.decode", decoded.append)
    packer = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    data = mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0).pack(packer)
    (frame,) = FrameParser().feed(data)
    autopilot.receive(frame, Channel())  # type: ignore[arg-type]
    assert frame.message_id not in autopilot._receivers and decoded == []
