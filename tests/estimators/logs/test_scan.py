"""The frame scan against a slow exact reference, on damaged logs of every kind."""

import os
import random
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopilot_bridge.tlog import TlogReader
from estimators.logs import LogError, open_log
from estimators.logs.columns import decode_columns
from estimators.logs.crc import checksum
from estimators.logs.dialect import load_dialect
from estimators.logs.tlog import TlogSource
from tests.estimators.logs import reference
from tests.estimators.logs.reference import EPOCH_US, build, record, tlog
from tests.recorded_logs import each_recorded_log

HEARTBEAT, ATTITUDE, UNKNOWN_V1, UNKNOWN_V2 = 0, 30, 15, 0xABCDEF


def source_of(data, path="fuzz"):
    return TlogSource(path, np.frombuffer(data, dtype=np.uint8), load_dialect())


def spans(source):
    starts, ends = source.frame_spans(np.arange(source.count))
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def check_against_reference(data):
    """Frames, bytes by kind and unknown messages are those of the reference; every byte is accounted for."""
    try:
        source = source_of(data)
    except LogError:
        assert not reference.read(data, 8).spans
        assert not reference.read(data, 0).spans
        return None
    expected = reference.read(data, source.index.lead)
    assert spans(source) == expected.spans
    assert source.bytes_by_kind == expected.bytes_by_kind
    assert sum(source.bytes_by_kind.values()) == len(data)
    assert sum(item.count for item in source.unknown) == len(expected.unknown)
    assert sum(item.frame_bytes for item in source.unknown) == sum(end - at for at, end in expected.unknown)
    assert sum(len(stream.order) for stream in source.streams) == source.count
    assert np.array_equal(
        np.sort(np.concatenate([stream.order for stream in source.streams])), np.arange(source.count)
    )
    return source


@st.composite
def frames(draw):
    version = draw(st.sampled_from([1, 2, 2]))
    message_id = draw(st.sampled_from([HEARTBEAT, ATTITUDE, 253, 131 if version == 1 else 330]))
    return build(
        message_id,
        draw(st.binary(min_size=1, max_size=30)),
        system=draw(st.sampled_from([1, 2, 255])),
        component=draw(st.sampled_from([1, 190])),
        sequence=draw(st.integers(0, 255)),
        version=version,
        signed=version == 2 and draw(st.booleans()),
    )


@st.composite
def invalid_frames(draw):
    kind = draw(st.sampled_from(["crc", "flags", "unknown_v1", "unknown_v2", "flip", "cut"]))
    payload = draw(st.binary(max_size=20))
    if kind == "crc":
        return build(ATTITUDE, payload, crc_extra=1)
    if kind == "flags":
        flags = draw(st.one_of(st.sampled_from([2, 3, 4, 0x80]), st.integers(2, 255)))
        return build(ATTITUDE, payload, flags=flags) + draw(st.sampled_from([b"", bytes(13)]))
    if kind == "unknown_v1":
        return build(UNKNOWN_V1, payload, version=1)
    if kind == "unknown_v2":
        return build(UNKNOWN_V2, payload, signed=draw(st.booleans()))
    raw = draw(frames())
    at = draw(st.integers(0, len(raw) - 1))
    if kind == "cut":
        return raw[:at]
    return raw[:at] + bytes([raw[at] ^ draw(st.integers(1, 255))]) + raw[at + 1 :]


stamps = st.one_of(
    st.integers(EPOCH_US, EPOCH_US + 10**9).map(lambda value: value.to_bytes(8, "big")),
    st.binary(min_size=8, max_size=8),
    st.just(b"\xfd\xfe\xfd\x00\x00\xfe\x01\x00"),
)
junk = st.one_of(
    st.binary(max_size=40), st.lists(st.sampled_from([0xFD, 0xFE, 0, 1, 9, 30]), max_size=60).map(bytes)
)
with_stamp = st.tuples(stamps, st.one_of(frames(), frames(), frames(), invalid_frames())).map(b"".join)
pieces = st.lists(
    st.one_of(with_stamp, with_stamp, with_stamp, frames(), invalid_frames(), junk), max_size=12
)


@given(pieces, st.integers(0, 40))
@settings(max_examples=150)
def test_fuzzed_logs(parts, torn):
    data = b"".join(parts)
    check_against_reference(data[: max(0, len(data) - torn)])


@pytest.mark.slow
@given(pieces, st.integers(0, 40))
@settings(max_examples=5000, deadline=None)
def test_many_fuzzed_logs(parts, torn):
    data = b"".join(parts)
    check_against_reference(data[: max(0, len(data) - torn)])


@pytest.mark.parametrize("seed", range(40))
def test_no_frame_of_a_spliced_log_is_missed(seed):
    """Whole records with junk between them that can't be the beginning of a frame: each is found."""
    choose = random.Random(seed)
    content, expected = b"", []
    for item in mixed_frames(choose.randrange(3, 30), seed):
        content += bytes(choose.randrange(0x80) for _ in range(choose.choice([0, 1, 7, 9, 40, 300])))
        content += EPOCH_US.to_bytes(8, "big")
        expected.append((len(content), len(content) + len(item)))
        content += item
    assert spans(source_of(content)) == expected


def test_checksum_of_any_length():
    data = np.frombuffer(random.Random(1).randbytes(300), dtype=np.uint8)
    for start in (0, 1, 7):
        for stop in range(start, 300, 7):
            extra = (start * 31 + stop) & 0xFF
            expected = reference.checksum(data[start:stop].tobytes() + bytes([extra]))
            assert checksum(data, start, stop, extra) == expected


def mixed_frames(count, seed=1):
    choose = random.Random(seed)
    items = []
    for index in range(count):
        version = choose.choice([1, 2])
        items.append(
            build(
                choose.choice([HEARTBEAT, ATTITUDE, 330, 253]) if version == 2 else ATTITUDE,
                choose.randbytes(choose.randrange(1, 60)),
                system=choose.choice([1, 2]),
                component=choose.choice([1, 191]),
                sequence=index & 0xFF,
                version=version,
                signed=version == 2 and choose.random() < 0.3,
            )
        )
    return items


def test_two_vehicles_and_both_versions():
    items = mixed_frames(500)
    source = check_against_reference(tlog(items))
    assert source.count == 500
    assert source.remarks["frames_v1"] == sum(item[0] == 0xFE for item in items)
    assert source.remarks["frames_signed"] == sum(item[0] == 0xFD and item[2] for item in items)
    assert source.format == "tlog"


def test_reversed_and_doubled_logs():
    items = mixed_frames(100)
    assert check_against_reference(tlog(items[::-1])).count == 100
    assert check_against_reference(tlog(items) + tlog(items)).count == 200
    check_against_reference(tlog(items)[::-1])


def test_log_cut_at_every_byte():
    data = tlog(mixed_frames(3))
    for size in range(len(data)):
        source = check_against_reference(data[:size])
        if source is not None and size:
            kinds = source.bytes_by_kind
            assert kinds["junk"] == kinds["bad_crc"] == 0


def test_begun_in_the_middle_of_a_record():
    data = tlog(mixed_frames(4))
    for start in range(100):
        check_against_reference(data[start:])


def test_time_stamp_that_looks_like_a_frame_hides_none():
    """A whole valid frame inside a time stamp: what is behind the stamp is the record."""
    fake = build(HEARTBEAT, b"", version=1)
    assert len(fake) == 8
    items = mixed_frames(4)
    data = tlog(items[:2]) + fake + items[2] + record(items[3])
    assert [data[at:end] for at, end in spans(source_of(data))] == items


@pytest.mark.parametrize("flags", [2, 3, 4, 0x81])
@pytest.mark.parametrize("tail", [b"", bytes(13)])
def test_flags_that_no_reader_may_ignore(flags, tail):
    """The checksum is right, but what the frame means isn't known."""
    items = mixed_frames(2)
    foreign = build(ATTITUDE, b"\x01\x02\x03", flags=flags) + tail
    source = check_against_reference(tlog([items[0], foreign, items[1]]))
    assert source.count == 2
    if len(tail) == (13 if flags & 1 else 0):
        assert source.drops["unsupported_flags"] == 1
        assert source.bytes_by_kind["unsupported_flags"] == len(foreign)


def test_capture_without_time_stamps():
    items = mixed_frames(50)
    source = check_against_reference(b"".join(items))
    assert (source.format, source.count, source.index.lead) == ("raw MAVLink", 50, 0)
    assert not source.log_time_us(np.arange(50)).any()
    assert check_against_reference(items[0]).format == "raw MAVLink"
    assert check_against_reference(record(items[0])).format == "tlog"


@pytest.mark.parametrize("stamped", [True, False])
def test_time_stamps_are_reported_where_most_messages_are_unknown(stamped):
    items = []
    for index in range(40):
        unknown = build(UNKNOWN_V2, bytes([1 + index % 200] * (index % 50 + 1)))
        items += [unknown] * (index % 4) + [build(HEARTBEAT, bytes(range(1, 10)))]
    source = check_against_reference(tlog(items) if stamped else b"".join(items))
    assert source.index.lead == (8 if stamped else 0)
    assert source.drops["unknown_messages"] == len(items) - 40
    assert source.bytes_by_kind["junk"] == 0


def test_log_that_begins_with_much_junk():
    noise = random.Random(2).randbytes(400_000)
    items = mixed_frames(30)
    source = source_of(noise + tlog(items))
    assert source.index.lead == 8
    assert [source.frame(position) for position in range(source.count)][-30:] == items


def test_more_streams_than_the_first_table_holds():
    items = [
        build(HEARTBEAT, bytes(9), system=1 + index % 250, component=1 + index // 250)
        for index in range(5000)
    ]
    source = source_of(tlog(items + items))
    assert len(source.streams) == 5000
    assert {(s.system_id, s.component_id, len(s.order)) for s in source.streams} == {
        (item[5], item[6], 2) for item in items
    }


def test_messages_longer_than_their_definition_and_shorter():
    long = build(HEARTBEAT, bytes(range(1, 30)))
    short = build(ATTITUDE, b"\x01")
    source = source_of(tlog([long, short]))
    (first, second) = source.streams
    heartbeat, attitude = source.columns(first, slice(None)), source.columns(second, slice(None))
    assert heartbeat["custom_mode"][0] == int.from_bytes(bytes([1, 2, 3, 4]), "little")
    assert heartbeat["mavlink_version"][0] == 9
    assert (attitude["time_boot_ms"][0], attitude["yawspeed"][0]) == (1, 0.0)


def test_positions_in_files_too_large_for_32_bits():
    """Such files have wider offsets; the columns are the same."""
    source = source_of(tlog(mixed_frames(300)))
    starts = source.index.starts
    assert starts.dtype == np.uint32
    for stream in source.streams:
        definition = stream.description.definition
        narrow = decode_columns(source.data, starts[stream.order], definition)
        wide = decode_columns(source.data, starts[stream.order].astype(np.int64), definition)
        assert [narrow[name].tobytes() for name in narrow] == [wide[name].tobytes() for name in wide]


def test_time_stamps_of_every_kind():
    items = mixed_frames(20)
    times = [EPOCH_US + 1000 * index for index in range(20)]
    data = b"".join(record(item, time) for item, time in zip(items, times, strict=True))
    source = source_of(data)
    assert source.log_time_us(np.arange(20)).tolist() == times
    assert source.remarks["timestamps"] == "milliseconds"
    swapped = b"".join(time.to_bytes(8, "little") + item for item, time in zip(items, times, strict=True))
    assert source_of(swapped).log_time_us(np.arange(20)).tolist() == times
    exact = source_of(b"".join(record(item, time + 1) for item, time in zip(items, times, strict=True)))
    assert exact.remarks["timestamps"] == "microseconds"


def test_frame_without_time_stamp_has_that_of_the_one_before():
    items = mixed_frames(6)
    data = tlog(items[:3]) + items[3] + items[4] + record(items[5], EPOCH_US + 90_000)
    source = source_of(data)
    expected = [EPOCH_US, EPOCH_US + 20_000, *[EPOCH_US + 40_000] * 3, EPOCH_US + 90_000]
    assert source.log_time_us(np.arange(6)).tolist() == expected
    assert source.log_time_us(np.array([4])).tolist() == [EPOCH_US + 40_000]
    assert source.remarks["frames_without_timestamp"] == 2


def test_loss_is_counted_as_the_parser_counts_it(tmp_path):
    numbers = [250, 251, 253, 252, 254, 255, 0, 4, 4, 5, 200, 201]
    path = tmp_path / "a.tlog"
    path.write_bytes(tlog([build(HEARTBEAT, bytes(9), sequence=number) for number in numbers]))
    (loss,) = open_log(path).source.losses
    reader = TlogReader(path)
    assert len(list(reader)) == loss.frames == len(numbers)
    counted = reader.counters.frames.sources[1, 1]
    assert (loss.lost, loss.late) == (counted.lost - counted.late, counted.late)
    assert loss.late == 2


def test_unknown_messages_are_kept_and_not_lost():
    unknown = build(UNKNOWN_V2, b"abc", sequence=1, system=1, component=1)
    items = [build(HEARTBEAT, bytes(9), sequence=0), unknown, build(HEARTBEAT, bytes(9), sequence=2)]
    source = source_of(tlog(items))
    (found,) = source.unknown
    assert (found.message_id, found.count, found.frame_bytes) == (UNKNOWN_V2, 1, len(unknown))
    assert source.unknown_frames(UNKNOWN_V2) == [unknown]
    assert source.losses[0].lost == 0


@pytest.mark.parametrize("part", [400_000, pytest.param(None, marks=pytest.mark.slow)])
@each_recorded_log
def test_recorded_logs_as_the_one_by_one_reader_has_them(tmp_path, path, part):
    if part is not None:
        cut = tmp_path / path.name
        cut.write_bytes(path.read_bytes()[-part:])  # begun and ended in the middle of a record
        path = cut
    source = open_log(path).source
    reader = TlogReader(path)
    read = [(time, frame.raw) for time, frame in reader]
    times = source.log_time_us(np.arange(source.count)).tolist()
    assert [(time, source.frame(n)) for n, time in enumerate(times[:2000])] == read[:2000]  # type: ignore[attr-defined]
    starts, ends = source.frame_spans(np.arange(source.count))  # type: ignore[attr-defined]
    assert (ends - starts).tolist() == [len(raw) for _, raw in read]
    assert times == [time for time, _ in read]
    kinds = source.bytes_by_kind
    assert sum(kinds.values()) == path.stat().st_size
    assert kinds["frames"] + 8 * source.count + reader.counters.bytes_skipped == path.stat().st_size
    for loss in source.losses:
        assert reader.counters.frames.sources[loss.system_id, loss.component_id].frames == loss.frames


WRITER = """
import sys
from autopilot_bridge.tlog import TlogWriter
from autopilot_bridge.mavlink import FrameEncoder, dialect
log, encoder = TlogWriter(sys.argv[1]), FrameEncoder(1, 1)
time_us = 0
while True:
    time_us += 4000
    log.write(1_700_000_000_000_000 + time_us, encoder.encode(
        dialect.MAVLink_attitude_message(time_us // 1000, 0.1, 0, 0, 0, 0, 0)))
    if time_us == 8_000_000:
        print("there", flush=True)
"""


def test_log_of_a_killed_writer_is_read_to_its_last_record(tmp_path):
    path = tmp_path / "killed.tlog"
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, env=os.environ
    ) as writer:
        writer.stdout.readline()
        writer.kill()
    log = open_log(path)
    kinds = log.source.bytes_by_kind
    assert kinds["frames"] + kinds["timestamps"] + kinds["torn_tail"] == path.stat().st_size
    assert kinds["torn_tail"] < 64
    assert log.table("ATTITUDE").time_us[-1] >= 7_000_000
    assert np.all(np.diff(log.table("ATTITUDE")["time_boot_ms"].astype(np.int64)) == 4)
