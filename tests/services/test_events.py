"""PX4's events: numbers, arguments, requests for what was lost, and the report of checks."""

import json
import lzma
import struct
from typing import Any

import pytest

from autopilot_bridge.commander import events
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason, Result
from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.firmware.event_kinds import EventKind, definitions
from autopilot_bridge.firmware.px4 import events as px4_events
from autopilot_bridge.firmware.px4 import texts as px4_texts
from autopilot_bridge.firmware.px4.component_metadata import GENERAL, ComponentMetadataService
from autopilot_bridge.firmware.px4.event_service import KEPT, EventService
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import Command
from autopilot_bridge.services.files.ftp_protocol import crc32
from tests.services.command_rig import ServiceRig
from tests.services.dispatch import deliver
from tests.services.ftp_rig import Link

SUMMARY = struct.Struct("<BQQII")


class Rig(ServiceRig):
    """A commander whose events are sent."""

    def __init__(self) -> None:
        super().__init__("px4")
        self.link = Link()
        self.channels = [self.link]  # type: ignore[list-item]
        self.service = EventService(self.commander, self, self.flavour.texts.notices)

    def sent(self) -> list[Any]:
        found, self.link.sent = self.link.sent, []
        return found

    def request(self, first: int, last: int) -> list[Any]:
        assert deliver(
            dialect.MAVLink_request_event_message(1, 1, first, last),
            Source(self.link, 255, 190),
            0,
            self.service,
        )
        return self.sent()


def test_numbers_are_the_hash_of_the_name() -> None:
    kind = EventKind(name="a", message="")
    assert kind.event_id == 1 << 24 | 0xE40C292C & 0xFFFFFF  # FNV-1a of "a", as published with it
    assert len({each.event_id for each in px4_events.KINDS}) == len(px4_events.KINDS)
    assert all(len(each.message) <= 120 and each.message for each in px4_events.KINDS)


def test_every_fixed_text_is_an_event() -> None:
    for notice in px4_texts.FIXED:
        event = events.Armed(time_us=0)
        (occurrence,) = px4_events.occurrences(event, (notice,))
        assert occurrence.kind.message == notice.text


def test_sequence_wraps_and_lost_events_can_be_requested() -> None:
    rig = Rig()
    for _ in range(KEPT + 6):
        rig.service.follow(events.TakeoffDetected(time_us=0))
    sent = rig.sent()
    numbers = [message.sequence for message in sent]
    assert 65535 in numbers and numbers[numbers.index(65535) + 1] == 0
    assert rig.service.builders[dialect.MAVLink_current_event_sequence_message.id]() == (numbers[-1], 0)
    again = rig.request(numbers[-3], numbers[-1])
    assert again == sent[-3:]
    (error,) = rig.request(numbers[0], numbers[0])
    assert (error.sequence, error.sequence_oldest_available) == (numbers[0], numbers[6])
    assert len(rig.request(5, 4)) == KEPT  # all that there could be, and no more


def test_an_event_has_its_time_and_its_level_for_both_logs() -> None:
    rig = Rig()
    rig.service.tick(12_345_000)
    rig.sent()
    rig.service.follow(events.TakeoffDetected(time_us=0))
    (message,) = rig.sent()
    level = next(kind.level for kind in px4_events.KINDS if kind.event_id == message.id)
    assert level > 0
    assert message.log_levels == 16 * level + level
    assert message.event_time_boot_ms == 12_345


def test_refused_arming_brings_the_reasons() -> None:
    rig = Rig()
    rig.commander.situation.ready = False
    rig.service.follow(events.ArmingDenied(time_us=0, mode=FlightMode.HOLD, reasons=(Reason.BOOTING,)))
    ids = [message.id for message in rig.sent() if isinstance(message, dialect.MAVLink_event_message)]
    assert ids[0] == px4_events.KINDS[1].event_id  # the text's
    assert ids[1] == px4_events.ARMING_SUMMARY.event_id
    assert px4_events.CHECKS[Reason.BOOTING].event_id in ids[2:-1]
    assert ids[-1] == px4_events.HEALTH_SUMMARY.event_id


def test_report_comes_to_a_station_that_is_received_and_to_who_asks() -> None:
    rig = Rig()
    rig.service.tick(10_000_000)
    first = rig.sent()
    rig.commander.situation.gcs_age_s = 0.5
    rig.service.tick(20_000_000)
    assert [message.arguments for message in rig.sent()] == [message.arguments for message in first]
    rig.service.tick(30_000_000)
    assert rig.sent() == []
    requested = Command(dialect.MAV_CMD_RUN_PREARM_CHECKS, *(0.0,) * 7, None)
    assert rig.service.commands[requested.id](requested, Source(rig.link, 255, 190)) is Result.ACCEPTED
    reported = [message.id for message in rig.sent()]
    assert not rig.commander.arming_reasons and px4_events.HEALTH_SUMMARY.event_id in reported


def test_report_comes_once_until_it_changes() -> None:
    rig = Rig()
    rig.service.tick(10_000_000)
    first = rig.sent()
    rig.service.tick(20_000_000)
    assert rig.sent() == []
    rig.commander.situation.terminated = True
    rig.service.tick(30_000_000)
    second = rig.sent()
    _, errors, _, can_arm, _ = SUMMARY.unpack_from(second[0].arguments)
    assert first and can_arm == 0
    assert errors >> px4_events.COMPONENT_OF[Reason.TERMINATED] & 1


@pytest.mark.parametrize("kind", px4_events.KINDS, ids=lambda kind: kind.name)
def test_definitions_have_every_kind_with_its_types(kind: EventKind) -> None:
    content: Any = definitions(px4_events.NAMESPACE, px4_events.KINDS, px4_events.MODE_GROUPS)
    component = content["components"]["1"]
    entry = component["event_groups"][kind.group]["events"][str(kind.sub_id)]
    assert (entry["name"], entry["message"]) == (kind.name, kind.message)
    basic = {"uint8_t", "int8_t", "uint16_t", "uint32_t", "int32_t", "uint64_t", "float"}
    for argument in entry.get("arguments", ()):
        assert argument["type"] in basic or component["enums"][argument["type"]]["type"] in basic


def test_metadata_files_point_at_each_other() -> None:
    flavour = get_flavour("px4")
    service = ComponentMetadataService(flavour.parameter_definitions(), lambda: 0)
    files = service.files
    general = json.loads(lzma.decompress(files[GENERAL]))
    assert {entry["type"] for entry in general["metadataTypes"]} == {1, 4, 5}
    for entry in general["metadataTypes"]:
        name = entry["uri"].rpartition("/")[2]
        assert entry["uri"] == f"mftp://etc/extras/{name}"
        assert entry["fileCrc"] == crc32(files[name])
    parameters = json.loads(lzma.decompress(files["parameters.json.xz"]))["parameters"]
    assert len(parameters) == len(flavour.parameter_definitions())
    entry = next(entry for entry in parameters if entry["name"] == "MPC_XY_CRUISE")
    assert (entry["type"], entry["units"], entry["default"]) == ("Float", "m/s", 5.0)
