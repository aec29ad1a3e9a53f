"""Columns against pymavlink, field by field, and messages from columns against those from frames."""

import random
from itertools import zip_longest

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge.mavlink import DEFINITIONS, FrameParser
from autopilot_bridge.tlog import TlogReader
from estimators.logs import open_log
from estimators.logs.columns import record_dtype
from estimators.messages import read_message
from estimators.vehicle_time import VehicleTime
from tests.estimators.logs.reference import build, tlog
from tests.recorded_logs import each_recorded_log

ROWS = 200
"""Messages compared of each stream; the slow test compares all."""


@pytest.fixture(scope="module")
def every_message(tmp_path_factory):
    """A log with every message of the dialect, three of each with random values, some of them truncated."""
    choose = random.Random(4)
    items = []
    for message_id, found in DEFINITIONS.items():
        for size in (found.size, found.size, choose.randrange(1, found.size + 1)):
            payload = choose.randbytes(size).rstrip(b"\0") or b"\1"
            version = 1 if message_id < 256 and choose.random() < 0.3 else 2
            items.append(build(message_id, payload, version=version, sequence=len(items) & 0xFF))
    choose.shuffle(items)
    path = tmp_path_factory.mktemp("logs") / "every.tlog"
    path.write_bytes(tlog(items))
    return path


def values_of_pymavlink(raw):
    message = dialect.MAVLink(None).decode(bytearray(raw))
    return {name: getattr(message, name) for name in message.get_fieldnames()}


def comparable(value):
    """Text of a value, so that not-a-numbers are equal; texts end at their first zero."""
    if isinstance(value, bytes):
        return repr(value.split(b"\0", 1)[0].decode("ascii", "replace"))
    if isinstance(value, str):
        raw = value.split("\0", 1)[0]
        return repr("".join("\ufffd" if ord(c) > 127 else c for c in raw))
    return repr(value)


def compare(path, limit=None):
    """Columns of every stream with what pymavlink decodes from the same frames."""
    log = open_log(path)
    compared = 0
    for stream in log.source.streams:
        table = log.stream_table(stream)
        if (
            values_of_pymavlink(log.source.frame(int(stream.order[0]))).keys()  # type: ignore[attr-defined]
            == {"data"}
            != set(table.fields)
        ):
            continue  # a message newer than pymavlink's dialect
        rows = np.arange(len(table))
        if limit is not None and len(rows) > limit:
            rows = np.unique(np.linspace(0, len(table) - 1, limit).astype(np.int64))
        picked = {name: table[name][rows].tolist() for name in table.fields}
        for index, row in enumerate(rows.tolist()):
            theirs = values_of_pymavlink(log.source.frame(int(stream.order[row])))  # type: ignore[attr-defined]
            assert list(theirs) == list(table.fields)
            for name, value in theirs.items():
                ours = picked[name][index]
                assert comparable(ours) == comparable(value), (stream.name, row, name)
                compared += 1
    assert compared


def test_every_message_of_the_dialect(every_message):
    compare(every_message)


@each_recorded_log
def test_recorded_logs(path):
    compare(path, limit=ROWS)


@pytest.mark.slow
@each_recorded_log
def test_recorded_logs_in_full(path):
    compare(path)


def check_messages(path):
    """The messages of a log are those that its frames give, and their times those that a link would give."""
    clock = VehicleTime()
    pairs = zip_longest(TlogReader(path), open_log(path).messages())
    for (_, frame), (time_us, message) in pairs:
        expected = read_message(frame)
        assert type(message) is type(expected)
        if message != expected:
            assert repr(message) == repr(expected)  # not-a-numbers
        assert clock.stamp(expected) == time_us


def test_messages_of_every_kind_are_those_of_the_frames(every_message):
    check_messages(every_message)


@pytest.mark.parametrize("part", [800_000, pytest.param(None, marks=pytest.mark.slow)])
@each_recorded_log
def test_messages_of_recorded_logs_are_those_of_the_frames(tmp_path, path, part):
    if part is not None:
        cut = tmp_path / path.name
        cut.write_bytes(path.read_bytes()[-part:])  # begun and ended in the middle of a record
        path = cut
    check_messages(path)


@pytest.mark.parametrize("name", ["ATTITUDE", "STATUSTEXT", "ODOMETRY", "SYS_STATUS", "PARAM_VALUE"])
def test_record_dtype_reads_whole_payloads(every_message, name):
    log = open_log(every_message)
    table = log.table(name)
    frames = FrameParser().feed(b"".join(log.source.frame(order) for order in table.order.tolist()))  # type: ignore[attr-defined]
    dtype = record_dtype(table.description.definition)
    records = np.frombuffer(b"".join(frame.payload for frame in frames), dtype=dtype)
    for field in table.fields:
        assert table[field].dtype.kind == dtype[field].base.kind
        assert np.array_equal(
            table[field].view(np.uint8), np.ascontiguousarray(records[field]).view(np.uint8)
        )
