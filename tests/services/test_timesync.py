"""TIMESYNC and PING."""

from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.inputs.timesync import TimeSyncService
from tests.services.dispatch import deliver


class Recorder:
    name = "link"

    def __init__(self) -> None:
        self.sent: list[Any] = []

    def send(self, message: Any, /) -> None:
        self.sent.append(message)


PX4 = TimeSyncService(answers_ping=True)
ARDUPILOT = TimeSyncService(answers_ping=False)


@pytest.mark.parametrize("service", [PX4, ARDUPILOT])
def test_a_request_is_answered_with_both_clocks(service: TimeSyncService) -> None:
    asking = Recorder()
    assert deliver(
        mavlink.MAVLink_timesync_message(0, 123456789), Source(asking, 255, 190), 5_000_000, service
    )
    (answer,) = asking.sent
    assert (answer.tc1, answer.ts1) == (5_000_000_000, 123456789)


def test_answers_are_not_answered() -> None:
    channel = Recorder()
    for tc1 in (1, -1, -(2**63), 2**63 - 1):
        assert deliver(mavlink.MAVLink_timesync_message(tc1, 0), Source(channel, 255, 190), 1, PX4)
    assert channel.sent == []


def test_ping() -> None:
    channel = Recorder()
    ping = mavlink.MAVLink_ping_message(2**64 - 1, 77, 0, 0)
    assert deliver(ping, Source(channel, 255, 190), 1, ARDUPILOT)
    assert channel.sent == []
    assert deliver(ping, Source(channel, 255, 190), 1, PX4)
    (answer,) = channel.sent
    assert (answer.time_usec, answer.seq) == (2**64 - 1, 77)
    assert (answer.target_system, answer.target_component) == (255, 190)
    assert deliver(answer, Source(channel, 255, 190), 1, PX4)
    assert len(channel.sent) == 1


def test_other_messages_are_not_taken() -> None:
    heartbeat = mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 3, 3)
    assert not deliver(heartbeat, Source(Recorder(), 255, 190), 0, PX4)
