"""Rates and requests of messages: results, texts, and what is answered (MAV_CMD 511, 510, 512)."""

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.message_interval import IntervalPolicy, MessageIntervalService
from tests.services.command_rig import Channel

ATTITUDE, HEARTBEAT, VFR_HUD, SECRET, HOME = (
    mavlink.MAVLINK_MSG_ID_ATTITUDE,
    mavlink.MAVLINK_MSG_ID_HEARTBEAT,
    mavlink.MAVLINK_MSG_ID_VFR_HUD,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION,
)
UNKNOWN = 9_999
NOW_US = 5_000_000
POLICY = IntervalPolicy(
    unknown_set=Result.FAILED,
    unknown_get=Result.DENIED,
    unknown_request=Result.UNSUPPORTED,
    fixed=frozenset({HEARTBEAT}),
    not_requestable=frozenset({SECRET}),
    refuse_empty=True,
    refuse_running=frozenset({HEARTBEAT}),
    max_rate_hz=200.0,
    groups={10: (ATTITUDE,), 11: (VFR_HUD, HEARTBEAT)},
    unknown_text="no message {}",
    too_fast_text="{} is too fast",
)


class Table:
    """The streams of a channel."""

    def __init__(self) -> None:
        self.intervals_us: dict[int, int] = {}
        self.set: list[tuple[int, int, int]] = []
        self.defaults: list[tuple[int, int, int]] = []

    def set_interval(self, message_id: int, interval_us: int, time_us: int) -> None:
        self.set.append((message_id, interval_us, time_us))

    def set_default(self, message_id: int, interval_us: int, time_us: int) -> None:
        self.defaults.append((message_id, interval_us, time_us))

    def default_interval_us(self, message_id: int) -> int:
        return 250_000


class Cache:
    """Builds every known message but the one that has nothing to say."""

    def __contains__(self, message_id: int) -> bool:
        return message_id in (ATTITUDE, HEARTBEAT, VFR_HUD, SECRET)

    def payload(self, message_id: int, time_us: int) -> bytes | None:
        return None if message_id == VFR_HUD else f"{message_id} at {time_us}".encode()


class Line(Channel):
    def __init__(self) -> None:
        super().__init__()
        self.payloads: list[tuple[int, bytes]] = []

    def send_payload(self, message_id: int, payload: bytes) -> None:
        self.payloads.append((message_id, payload))


class Rig:
    def __init__(self, policy: IntervalPolicy = POLICY) -> None:
        self.line, self.table = Line(), Table()
        self.source = Source(self.line, 255, 190)
        self.texts: list[str] = []
        self.sent_on_demand: list[tuple[Any, float]] = []
        self.service = MessageIntervalService(
            policy,
            {self.line.name: self.table},  # type: ignore[dict-item]
            Cache(),  # type: ignore[arg-type]
            lambda severity, text: self.texts.append(text),
        )
        self.service.requested[HOME] = lambda channel, parameter: self.sent_on_demand.append(
            (channel, parameter)
        )
        self.service.tick(NOW_US)


@pytest.mark.parametrize(
    ("message_id", "interval_us", "result", "set_to", "texts"),
    [
        (ATTITUDE, 20_000.0, Result.ACCEPTED, 20_000, []),
        (ATTITUDE, 5_000.0, Result.ACCEPTED, 5_000, []),
        (ATTITUDE, 4_999.0, Result.DENIED, None, [f"{ATTITUDE} is too fast"]),
        (ATTITUDE, 1.0, Result.DENIED, None, [f"{ATTITUDE} is too fast"]),
        (ATTITUDE, 0.0, Result.ACCEPTED, 250_000, []),
        (ATTITUDE, -1.0, Result.ACCEPTED, -1, []),
        (ATTITUDE, -5.0, Result.ACCEPTED, -1, []),
        (ATTITUDE, 1e30, Result.ACCEPTED, 10**12, []),
        (ATTITUDE, math.nan, Result.DENIED, None, []),
        (ATTITUDE, math.inf, Result.DENIED, None, []),
        (HEARTBEAT, 20_000.0, Result.FAILED, None, []),
        (UNKNOWN, 20_000.0, Result.FAILED, None, [f"no message {UNKNOWN}"]),
        (SECRET, 20_000.0, Result.FAILED, None, [f"no message {SECRET}"]),
    ],
)
def test_intervals(
    message_id: int, interval_us: float, result: Result, set_to: int | None, texts: list[str]
) -> None:
    rig = Rig()
    assert rig.service.set_interval(rig.source, message_id, interval_us) is result
    assert rig.table.set == ([] if set_to is None else [(message_id, set_to, NOW_US)])
    assert rig.texts == texts
    silent = Rig(
        IntervalPolicy(unknown_set=Result.FAILED, unknown_get=Result.DENIED, unknown_request=Result.FAILED)
    )
    silent.service.set_interval(silent.source, message_id, interval_us)
    assert silent.texts == []


def test_a_channel_without_streams_has_no_intervals() -> None:
    rig = Rig()
    other = Source(Channel("other"), 255, 190)
    assert rig.service.set_interval(other, ATTITUDE, 20_000.0) is Result.DENIED


@pytest.mark.parametrize(
    ("message_id", "interval_us", "result", "answer"),
    [
        (ATTITUDE, 20_000, Result.ACCEPTED, 20_000),
        (ATTITUDE, None, Result.ACCEPTED, -1),
        (ATTITUDE, 10**12, Result.ACCEPTED, 0x7FFFFFFF),
        (UNKNOWN, 20_000, Result.DENIED, 0),
        (0xFFFF, None, Result.DENIED, 0),
        (0x10000, None, Result.DENIED, None),
        (-1, None, Result.DENIED, None),
    ],
)
def test_the_interval_is_answered(
    message_id: int, interval_us: int | None, result: Result, answer: int | None
) -> None:
    rig = Rig()
    if interval_us is not None:
        rig.table.intervals_us[message_id] = interval_us
    assert rig.service.get_interval(rig.source, message_id) is result
    found = [(sent.message_id, sent.interval_us) for sent in rig.line.sent]
    assert found == ([] if answer is None else [(message_id, answer)])


@pytest.mark.parametrize(
    ("message_id", "interval_us", "result"),
    [
        (ATTITUDE, None, Result.ACCEPTED),
        (ATTITUDE, 10_000, Result.ACCEPTED),
        (HEARTBEAT, 1_000_000, Result.DENIED),  # the stream has sent its newest sample
        (VFR_HUD, None, Result.DENIED),  # it has no values now
        (UNKNOWN, None, Result.UNSUPPORTED),
        (SECRET, None, Result.UNSUPPORTED),
        (HOME, 1, Result.ACCEPTED),
    ],
)
def test_requests(message_id: int, interval_us: int | None, result: Result) -> None:
    rig = Rig()
    if interval_us is not None:
        rig.table.intervals_us[message_id] = interval_us
    assert rig.service.request(rig.source, message_id) is result


def test_requested_messages_follow_at_the_next_tick_each_once() -> None:
    rig = Rig()
    for message_id, parameter in ((HOME, 2.0), (VFR_HUD, 0.0), (ATTITUDE, 0.0), (HOME, 3.0), (ATTITUDE, 0.0)):
        rig.service.request(rig.source, message_id, parameter)
    assert rig.line.payloads == []
    rig.service.tick(NOW_US + 20_000)
    assert rig.sent_on_demand == [(rig.line, 2.0), (rig.line, 3.0)]
    assert rig.line.payloads == [(ATTITUDE, f"{ATTITUDE} at {NOW_US + 20_000}".encode())]
    rig.service.tick(NOW_US + 40_000)
    assert len(rig.line.payloads) == 1


@pytest.mark.parametrize(
    ("stream", "rate_hz", "start", "changed"),
    [
        (10, 4, 1, {ATTITUDE: 250_000}),
        (11, 50, 1, {VFR_HUD: 20_000, HEARTBEAT: 20_000}),
        (0, 10, 1, {ATTITUDE: 100_000, VFR_HUD: 100_000, HEARTBEAT: 100_000}),
        (10, 4, 0, {ATTITUDE: -1}),
        (10, 0, 1, {ATTITUDE: -1}),
        (12, 4, 1, {}),
    ],
)
def test_data_streams_are_groups(stream: int, rate_hz: int, start: int, changed: dict[int, int]) -> None:
    rig = Rig()
    message = mavlink.MAVLink_request_data_stream_message(1, 1, stream, rate_hz, start)
    receive = rig.service.receivers[mavlink.MAVLINK_MSG_ID_REQUEST_DATA_STREAM]
    receive(message, rig.source, NOW_US + 7)
    assert {message_id: interval for message_id, interval, _ in rig.table.defaults} == changed
    assert {time_us for _, _, time_us in rig.table.defaults} <= {NOW_US + 7}
