"""Telemetry logs."""

import os
import random
import signal
import subprocess
import sys

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge.errors import TlogError
from autopilot_bridge.mavlink import FrameEncoder, decode
from autopilot_bridge.tlog import TlogReader, TlogWriter

EPOCH_US = 1_700_000_000_000_000


def records(count):
    encoder = FrameEncoder(1, 1)
    return [
        (
            EPOCH_US + index * 20_000,
            encoder.encode(dialect.MAVLink_attitude_message(index, 0.1 * index, 0, 0, 0, 0, 0)),
        )
        for index in range(count)
    ]


def write(path, items):
    with TlogWriter(path) as log:
        for time_us, raw in items:
            log.write(time_us, raw)


def read(path):
    reader = TlogReader(path)
    return [(time_us, frame.raw) for time_us, frame in reader], reader.counters


def test_golden_record(tmp_path):
    path = tmp_path / "a.tlog"
    write(path, [(EPOCH_US, bytes.fromhex("fd0100000201010200000000ab"))])
    assert path.read_bytes().hex() == "00060a24181e4000fd0100000201010200000000ab"


def test_round_trip(tmp_path):
    path = tmp_path / "a.tlog"
    items = records(3000)
    write(path, items)
    back, counters = read(path)
    assert back == items
    assert (counters.records, counters.bytes_skipped, counters.frames.frames_lost) == (3000, 0, 0)


def test_pymavlink_reads_it(tmp_path):
    path = tmp_path / "a.tlog"
    items = records(200)
    write(path, items)
    log = mavutil.mavlink_connection(str(path), dialect="all")
    for time_us, raw in items:
        message = log.recv_msg()
        assert bytes(message.get_msgbuf()) == raw
        assert message._timestamp == pytest.approx(time_us * 1e-6, abs=1e-6)
    assert log.recv_msg() is None


def test_nothing_is_overwritten(tmp_path):
    path = tmp_path / "a.tlog"
    write(path, records(1))
    before = path.read_bytes()
    with pytest.raises(TlogError, match=r"a\.tlog exists and is not overwritten"):
        TlogWriter(path)
    assert path.read_bytes() == before


def test_problems_name_the_path(tmp_path):
    with pytest.raises(TlogError, match=r"can't create .*missing"):
        TlogWriter(tmp_path / "missing" / "a.tlog")
    with pytest.raises(TlogError, match=r"none\.tlog can't be read"):
        TlogReader(tmp_path / "none.tlog")
    log = TlogWriter(tmp_path / "a.tlog")
    log.close()
    log.close()
    with pytest.raises(TlogError, match="closed"):
        log.flush()


def test_only_whole_records_reach_the_file(tmp_path):
    path = tmp_path / "a.tlog"
    log = TlogWriter(path)
    items = records(120)
    for count, (time_us, raw) in enumerate(items, 1):
        log.write(time_us, raw)
        on_disk, counters = read(path)
        assert on_disk == items[: len(on_disk)] and counters.bytes_skipped == 0
        assert items[count - 1][0] - (on_disk[-1][0] if on_disk else items[0][0]) <= 1_000_000
    log.close()
    assert read(path)[0] == items


def test_a_killed_process_leaves_a_readable_log(tmp_path):
    path = tmp_path / "a.tlog"
    script = f"""
import os, signal
from autopilot_bridge.tlog import TlogWriter
from autopilot_bridge.mavlink import FrameEncoder, dialect
log, encoder = TlogWriter({str(path)!r}), FrameEncoder(1, 1)
for index in range(1000):
    log.write(index * 20000, encoder.encode(dialect.MAVLink_system_time_message(index, index)))
os.kill(os.getpid(), signal.SIGKILL)
"""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(["", *sys.path])}
    result = subprocess.run([sys.executable, "-c", script], env=environment, check=False, timeout=60)
    assert result.returncode == -signal.SIGKILL
    back, counters = read(path)
    assert len(back) >= 1000 - 51 and counters.bytes_skipped == 0
    assert [time_us for time_us, _ in back] == [index * 20000 for index in range(len(back))]


def test_a_torn_end_is_counted(tmp_path):
    path = tmp_path / "a.tlog"
    items = records(10)
    write(path, items)
    whole = path.read_bytes()
    last = 8 + len(items[-1][1])
    for cut in range(1, last):
        torn = tmp_path / f"{cut}.tlog"
        torn.write_bytes(whole[:-cut])
        back, counters = read(torn)
        assert back == items[:-1] and counters.bytes_skipped == last - cut


def test_damage_costs_only_what_it_hits(tmp_path):
    items = records(400)
    path = tmp_path / "a.tlog"
    write(path, items)
    whole = path.read_bytes()
    chance = random.Random(8)
    for index in range(40):
        data = bytearray(whole)
        at = chance.randrange(len(data))
        if index % 2:
            data[at] ^= 1 << chance.randrange(8)
        else:
            data[at:at] = chance.randbytes(chance.randrange(1, 200))
        damaged = tmp_path / f"{index}.tlog"
        damaged.write_bytes(data)
        back, counters = read(damaged)
        kept = sum(len(raw) + 8 for _, raw in back)
        assert kept + counters.bytes_skipped == len(data)
        assert len(set(items) & set(back)) >= len(items) - 3


def test_messages_the_dialect_does_not_know_are_skipped(tmp_path):
    unknown = b"\xfd\x04\0\0\0\1\1" + (99999).to_bytes(3, "little") + b"\xfd\xfe\0\0\x12\x34"
    items = records(4)
    path = tmp_path / "a.tlog"
    write(path, [*items[:2], (EPOCH_US, unknown), *items[2:], (EPOCH_US, unknown)])
    back, counters = read(path)
    assert back == items
    assert counters.frames.unknown_message == 2 and counters.bytes_skipped == 2 * (8 + len(unknown))


def test_random_bytes_are_no_log_but_no_error_either(tmp_path):
    path = tmp_path / "a.tlog"
    path.write_bytes(random.Random(9).randbytes(300_000))
    back, counters = read(path)
    assert counters.bytes_skipped + sum(len(raw) + 8 for _, raw in back) == 300_000


def test_frames_of_a_log_decode(tmp_path):
    path = tmp_path / "a.tlog"
    write(path, records(3))
    assert [decode(frame).time_boot_ms for _, frame in TlogReader(path)] == [0, 1, 2]  # type: ignore[attr-defined]
