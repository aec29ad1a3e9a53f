"""Received messages reach the services by message id."""

from collections import Counter
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.autopilot import Autopilot
from autopilot_bridge.dispatch import command, receives, streams
from autopilot_bridge.firmware import FLAVOUR_NAMES, get_flavour
from autopilot_bridge.mavlink import FrameParser
from autopilot_bridge.services.channel import Source
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
    owners = [receiver.__self__ for receiver in table[HEARTBEAT]]  # type: ignore[attr-defined]
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

    @streams(mavlink.MAVLink_heartbeat_message)
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
    assert list(Child().builders) == [HEARTBEAT] and not Child().receivers and not Child().on_demand


def test_a_handler_is_annotated_with_the_classes_that_it_receives() -> None:
    heartbeat, ping = mavlink.MAVLink_heartbeat_message, mavlink.MAVLink_ping_message

    def both(self: Microservice, message: heartbeat | ping, source: Source, time_us: int) -> None: ...  # type: ignore[valid-type]

    def untyped(self: Microservice, message, source: Source, time_us: int) -> None: ...  # type: ignore[no-untyped-def]

    assert receives(ping, heartbeat)(both) is both
    for kinds, handler in [((heartbeat,), both), ((ping,), untyped)]:
        with pytest.raises(TypeError, match=rf"{handler.__name__} receives {kinds[0].__name__}, but"):
            receives(*kinds)(handler)


def test_a_message_that_no_service_handles_is_not_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    autopilot, decoded = autopilot_of("px4"), []
    monkeypatch.setattr("autopilot_bridge.autopilot.autopilot.decode", decoded.append)
    packer = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    data = mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0).pack(packer)
    (frame,) = FrameParser().feed(data)
    autopilot.receive(frame, Channel())  # type: ignore[arg-type]
    assert frame.message_id not in autopilot._receivers and decoded == []
