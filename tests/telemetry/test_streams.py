"""Streams keep their rates exactly, pack once per step and never burst."""

from collections import Counter
from collections.abc import Sequence

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.telemetry.streams import GRID_US, PayloadCache, StreamTable

STEP_US = 4000
ATTITUDE = mavlink.MAVLINK_MSG_ID_ATTITUDE
HEARTBEAT = mavlink.MAVLINK_MSG_ID_HEARTBEAT


class Sink:
    def __init__(self) -> None:
        self.sent: Counter[int] = Counter()
        self.times: dict[int, list[int]] = {}
        self.now_us = 0

    def send_streams(self, motion: int, payloads: Sequence[tuple[int, bytes]]) -> None:
        for message_id, _ in payloads:
            self.sent[message_id] += 1
            self.times.setdefault(message_id, []).append(self.now_us)


class Source:
    def __init__(self) -> None:
        self.built = 0

    def attitude(self) -> tuple[object, ...]:
        self.built += 1
        return (0, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0)


def run(table: StreamTable, sink: Sink, start_us: int, stop_us: int) -> None:
    for now_us in range(start_us + STEP_US, stop_us + 1, STEP_US):
        sink.now_us = now_us
        if table.next_due_us <= now_us:
            table.tick(now_us)


@pytest.mark.parametrize("rate_hz", [100, 50, 30, 8, 5, 1, 0.5, 33.3])
def test_rate_is_exact_on_average(rate_hz: float) -> None:
    sink = Sink()
    cache = PayloadCache({ATTITUDE: Source().attitude})
    table = StreamTable(cache, sink, {ATTITUDE: rate_hz}, physics_step_us=STEP_US)
    run(table, sink, 0, 100_000_000)
    assert sink.sent[ATTITUDE] == pytest.approx(100 * rate_hz, abs=1)
    gaps = {b - a for a, b in zip(sink.times[ATTITUDE], sink.times[ATTITUDE][1:], strict=False)}
    grid_us = GRID_US if rate_hz <= 50 else 0
    assert max(gaps) - min(gaps) <= STEP_US + grid_us


def test_one_build_serves_all_channels() -> None:
    source = Source()
    cache = PayloadCache({ATTITUDE: source.attitude})
    sinks = [Sink(), Sink()]
    tables = [StreamTable(cache, sink, {ATTITUDE: 50}, physics_step_us=STEP_US) for sink in sinks]
    for now_us in range(0, 1_000_001, STEP_US):
        for table in tables:
            table.tick(now_us)
    assert source.built == sinks[0].sent[ATTITUDE] == sinks[1].sent[ATTITUDE] == 50


def test_intervals_can_be_set_stopped_and_restored() -> None:
    sink = Sink()
    table = StreamTable(
        PayloadCache({ATTITUDE: Source().attitude}), sink, {ATTITUDE: 10}, physics_step_us=STEP_US
    )
    table.set_interval(ATTITUDE, -1, 0)
    run(table, sink, 0, 1_000_000)
    assert sink.sent[ATTITUDE] == 0
    assert table.next_due_us == StreamTable.NEVER
    table.set_interval(ATTITUDE, table.default_interval_us(ATTITUDE), 1_000_000)
    run(table, sink, 1_000_000, 2_000_000)
    assert sink.sent[ATTITUDE] == 10
    table.set_interval(ATTITUDE, 1, 2_000_000)  # faster than the physics: once a step
    run(table, sink, 2_000_000, 3_000_000)
    assert sink.sent[ATTITUDE] == 10 + 250


def test_a_pause_is_not_made_up_for() -> None:
    sink = Sink()
    table = StreamTable(
        PayloadCache({ATTITUDE: Source().attitude}), sink, {ATTITUDE: 50}, physics_step_us=STEP_US
    )
    run(table, sink, 0, 1_000_000)
    before = sink.sent[ATTITUDE]
    table.tick(10_000_000)
    assert sink.sent[ATTITUDE] == before + 1


def test_nothing_to_say_sends_nothing_and_keeps_the_time() -> None:
    sink = Sink()
    table = StreamTable(
        PayloadCache({HEARTBEAT: lambda: None}), sink, {HEARTBEAT: 1}, physics_step_us=STEP_US
    )
    run(table, sink, 0, 5_000_000)
    assert not sink.sent
    assert table.next_due_us == 6_000_000


def test_streams_of_one_rhythm_can_part() -> None:
    sink = Sink()
    ids = (HEARTBEAT, ATTITUDE)
    table = StreamTable(
        PayloadCache({i: lambda: b"\1" for i in ids}), sink, dict.fromkeys(ids, 10), physics_step_us=STEP_US
    )
    run(table, sink, 0, 1_000_000)
    table.set_interval(HEARTBEAT, -1, 1_000_000)
    run(table, sink, 1_000_000, 2_000_000)
    assert sink.sent == {HEARTBEAT: 10, ATTITUDE: 20}
    table.set_interval(HEARTBEAT, 100_000, 2_000_000)
    table.delay(ATTITUDE, 2_950_000)
    run(table, sink, 2_000_000, 3_000_000)
    assert sink.sent == {HEARTBEAT: 20, ATTITUDE: 21}


def test_what_is_due_together_goes_out_by_time_and_number() -> None:
    order: list[int] = []
    ids = (HEARTBEAT, mavlink.MAVLINK_MSG_ID_SYS_STATUS, mavlink.MAVLINK_MSG_ID_VFR_HUD, ATTITUDE)

    class Listing(Sink):
        def send_streams(self, motion: int, payloads: Sequence[tuple[int, bytes]]) -> None:
            order.extend(message_id for message_id, _ in payloads)

    rates_hz = dict(zip(ids, (10, 20, 10, 20), strict=True))
    cache = PayloadCache({i: lambda: b"\1" for i in ids})
    table = StreamTable(cache, Listing(), rates_hz, physics_step_us=STEP_US)
    table.delay(ATTITUDE, 90_000)
    table.tick(60_000)
    table.tick(100_000)
    twenty, ten = (mavlink.MAVLINK_MSG_ID_SYS_STATUS,), (HEARTBEAT, mavlink.MAVLINK_MSG_ID_VFR_HUD)
    assert order == [*twenty, ATTITUDE, *sorted(twenty + ten)]


def test_motion_messages_go_as_bits() -> None:
    bits: list[int] = []

    class Motion(Sink):
        def send_streams(self, motion: int, payloads: Sequence[tuple[int, bytes]]) -> None:
            bits.append(motion)

    rates_hz = {ATTITUDE: 100, HEARTBEAT: 50}
    cache = PayloadCache({i: lambda: b"\1" for i in rates_hz})
    table = StreamTable(
        cache, Motion(), rates_hz, physics_step_us=STEP_US, motion_bits={ATTITUDE: 1, HEARTBEAT: 2}
    )
    table.tick(12_000)
    table.tick(20_000)
    table.set_interval(HEARTBEAT, -1, 20_000)
    table.tick(40_000)
    assert bits == [1, 3, 1]
