"""TIMESYNC and PING."""

from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.timesync import TimeSyncService, ardupilot_time_sync, px4_time_sync


class Recorder:
    name = "link"

    def __init__(self) -> None:
        self.sent: list[Any] = []

    def send(self, message: Any, /) -> None:
        self.sent.append(message)


class Links:
    def __init__(self) -> None:
        self.channels = (Recorder(), Recorder())


@pytest.mark.parametrize("make", [px4_time_sync, ardupilot_time_sync])
def test_a_request_is_answered_with_both_clocks_on_its_channel(make: Any) -> None:
    links = Links()
    service = make(links)
    asking, other = links.channels
    assert service.handle(mavlink.MAVLink_timesync_message(0, 123456789), Source(asking, 255, 190), 5_000_000)
    (answer,) = asking.sent
    assert (answer.tc1, answer.ts1) == (5_000_000_000, 123456789)
    assert other.sent == []


def test_answers_are_not_answered() -> None:
    links = Links()
    service = px4_time_sync(links)
    for tc1 in (1, -1, -(2**63), 2**63 - 1):
        assert service.handle(
            mavlink.MAVLink_timesync_message(tc1, 0), Source(links.channels[0], 255, 190), 1
        )
    assert links.channels[0].sent == []


def test_ping() -> None:
    links = Links()
    channel = links.channels[0]
    ping = mavlink.MAVLink_ping_message(2**64 - 1, 77, 0, 0)
    assert ardupilot_time_sync(links).handle(ping, Source(channel, 255, 190), 1)
    assert channel.sent == []
    assert px4_time_sync(links).handle(ping, Source(channel, 255, 190), 1)
    (answer,) = channel.sent
    assert (answer.time_usec, answer.seq) == (2**64 - 1, 77)
    assert (answer.target_system, answer.target_component) == (255, 190)
    assert px4_time_sync(links).handle(answer, Source(channel, 255, 190), 1)
    assert len(channel.sent) == 1


def test_ardupilot_asks_every_ten_seconds_on_every_channel() -> None:
    links = Links()
    service = ardupilot_time_sync(links)
    asked = []
    for time_us in range(0, 35_000_000, 20_000):
        service.tick(time_us)
        asked += [(time_us, message.tc1, message.ts1) for message in links.channels[1].sent]
        links.channels[1].sent.clear()
    assert asked == [(t, 0, t * 1000) for t in (10_000_000, 20_000_000, 30_000_000)]
    assert len(links.channels[0].sent) == 3
    service.tick(500_000_000)
    service.tick(500_020_000)
    assert len(links.channels[0].sent) == 4


def test_px4_leaves_its_requests_to_the_streams() -> None:
    links = Links()
    px4_time_sync(links).tick(60_000_000)
    assert links.channels[0].sent == []
    request = TimeSyncService.request_message(3)
    assert (request.tc1, request.ts1) == (0, 3000)


def test_impossible_interval() -> None:
    with pytest.raises(ValueError, match="request_interval_us 0 is not positive"):
        TimeSyncService(Links(), answers_ping=True, request_interval_us=0)


def test_other_messages_are_not_taken() -> None:
    heartbeat = mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 3, 3)
    assert not px4_time_sync(Links()).handle(heartbeat, Source(Recorder(), 255, 190), 0)
