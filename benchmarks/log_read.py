"""Reading telemetry logs: index and full decode of a large one, beside pymavlink's mavutil on a slice of it.

The large log is made of real ones, repeated (or, where there are none, of made-up frames), in a temporary
folder. Compiled code is warmed up before; the file is in the page cache, as the copy that shows the limit is.

python -m benchmarks.log_read [--megabytes 200] [LOG ...]
"""

import argparse
import json
import math
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from autopilot_bridge.mavlink import DEFINITIONS, FrameEncoder
from autopilot_bridge.tlog import TlogWriter
from estimators.logs import open_log, report_of

RECORDED = Path(__file__).parents[2] / "shared" / "tlogs"
COPIES = 5
EPOCH_US = 1_700_000_000_000_000
TELEMETRY = ("ATTITUDE", "HIGHRES_IMU", "GLOBAL_POSITION_INT", "VFR_HUD", "RAW_IMU", "GPS_RAW_INT")
BASELINE = "pymavlink"


def made_up_log(path: Path) -> None:
    """A log of a minute of telemetry with random values."""
    choose, encoder = random.Random(1), FrameEncoder(1, 1)
    by_name = {item.name: item for item in DEFINITIONS.values()}
    with TlogWriter(path) as log:
        for tick in range(60 * 50):
            for name in TELEMETRY:
                found = by_name[name]
                payload = (tick * 20).to_bytes(4, "little") + choose.randbytes(found.size - 4)
                log.write(EPOCH_US + tick * 20_000, encoder.encode_payload(found.message_id, payload))


def make_large(path: Path, logs: list[Path], megabytes: float) -> None:
    """Repeat whole logs until the file is large enough."""
    pieces = [log.read_bytes() for log in logs]
    size, number = 0, 0
    with path.open("wb") as file:
        while size < megabytes * 1e6:
            size += file.write(pieces[number % len(pieces)])
            number += 1


def timed(action: Callable[[], Any]) -> tuple[Any, float, float]:
    """Result, wall seconds and processor seconds."""
    wall, processor = time.perf_counter(), time.process_time()
    result = action()
    return result, time.perf_counter() - wall, time.process_time() - processor


def peak_bytes() -> int:
    """Largest memory of the process so far, mapped pages of files included."""
    status = Path("/proc/self/status")
    if status.exists():  # getrusage would give the largest of the process that started this one as well
        return int(re.search(r"VmHWM:\s+(\d+) kB", status.read_text())[1]) * 1024  # type: ignore[index]
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def decode_all(log: Any) -> list[Any]:
    """Every column of every stream, and vehicle times; all are kept."""
    log.source.time_us  # noqa: B018  # computed on first use
    return [log.stream_table(stream) for stream in log.source.streams]


def measure_ours(path: Path, warm: Path) -> dict[str, float]:
    """Index, decode everything, walk over the messages. Runs in a process of its own, for its peak memory."""
    small = open_log(warm)
    decode_all(small)
    report_of(small)
    del small
    before = peak_bytes()
    log, index_s, index_cpu_s = timed(lambda: open_log(path))
    tables, decode_s, decode_cpu_s = timed(lambda: decode_all(log))
    peak = peak_bytes() - before
    values = sum(column.size for table in tables for column in table.columns.values())
    del tables
    count, messages_s, messages_cpu_s = timed(lambda: sum(1 for _ in log.messages(TELEMETRY)))
    accounted = sum(log.source.bytes_by_kind.values())
    return {
        "bytes": log.size_bytes,
        "accounted": accounted,
        "messages": len(log),
        "values": values,
        "index_s": index_s,
        "index_cpu_s": index_cpu_s,
        "decode_s": decode_s,
        "decode_cpu_s": decode_cpu_s,
        "peak": peak,
        "iterated": count,
        "iterated_s": messages_s,
        "iterated_cpu_s": messages_cpu_s,
    }


def measure_theirs(path: Path) -> dict[str, float]:
    """The same work with pymavlink: every message of a log decoded."""
    os.environ["MAVLINK20"] = "1"
    from pymavlink import mavutil

    def read() -> int:
        link = mavutil.mavlink_connection(str(path), dialect="all")
        count = 0
        while (message := link.recv_msg()) is not None:
            count += message.get_type() != "BAD_DATA"
        return count

    count, wall_s, processor_s = timed(read)
    return {"messages": count, "s": wall_s, "cpu_s": processor_s}


def copy_rate(path: Path) -> float:
    """Bytes per second of a copy from memory to memory."""
    data = np.fromfile(path, dtype=np.uint8)
    target = np.zeros_like(data)
    return len(data) / min(timed(lambda: np.copyto(target, data))[1] for _ in range(COPIES))


def in_a_process(*arguments: str) -> dict[str, float]:
    """Run one of the measurements on its own."""
    run = subprocess.run(
        [sys.executable, "-m", "benchmarks.log_read", *arguments], capture_output=True, check=True, text=True
    )
    return json.loads(run.stdout)


def table(ours: dict[str, float], theirs: dict[str, float], copy: float) -> Iterator[str]:
    """The result."""
    size, count = ours["bytes"], ours["messages"]
    yield f"{size / 1e6:.0f} MB, {count:.0f} messages, {ours['values']:.0f} values"
    yield f"{'':<26} {'wall s':>8} {'CPU s':>8} {'MB/s':>8} {'messages/s':>12}"
    both = ours["index_s"] + ours["decode_s"], ours["index_cpu_s"] + ours["decode_cpu_s"]
    for name, wall, processor in (
        ("index", ours["index_s"], ours["index_cpu_s"]),
        ("decode of all columns", ours["decode_s"], ours["decode_cpu_s"]),
        ("together", *both),
    ):
        yield f"{name:<26} {wall:8.2f} {processor:8.2f} {size / wall / 1e6:8.0f} {count / wall:12.0f}"
    share = theirs["messages"] / count * size
    yield (
        f"{BASELINE + ', slice':<26} {theirs['s']:8.2f} {theirs['cpu_s']:8.2f}"
        f" {share / theirs['s'] / 1e6:8.1f} {theirs['messages'] / theirs['s']:12.0f}"
    )
    faster = count / both[0] / (theirs["messages"] / theirs["s"])
    faster_cpu = count / both[1] / (theirs["messages"] / theirs["cpu_s"])
    yield f"times {BASELINE}'s messages/s: {faster:.0f} (by CPU time {faster_cpu:.0f})"
    yield f"limit, memory copy: {copy / 1e6:.0f} MB/s; together {size / both[0] / copy:.1%} of it"
    yield f"peak memory, all columns kept: {ours['peak'] / size:.2f} times the file (its mapped pages too)"
    yield (
        f"message by message (named tuples of {ours['iterated']:.0f}): "
        f"{ours['iterated_s'] / max(1, ours['iterated']) * 1e6:.2f} us each "
        f"({ours['iterated_cpu_s'] / max(1, ours['iterated']) * 1e6:.2f} us of CPU time)"
    )
    yield f"bytes accounted for: {'all' if ours['accounted'] == size else ours['accounted']}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("logs", nargs="*", type=Path, metavar="LOG")
    parser.add_argument("--megabytes", type=float, default=200.0, help="size of the large log")
    parser.add_argument("--slice", type=float, default=2.0, help="megabytes that pymavlink reads")
    parser.add_argument("--ours", nargs=2, type=Path, metavar=("LOG", "WARM"), help=argparse.SUPPRESS)
    parser.add_argument("--theirs", type=Path, metavar="LOG", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.ours:
        sys.stdout.write(json.dumps(measure_ours(*arguments.ours)))
        return
    if arguments.theirs:
        sys.stdout.write(json.dumps(measure_theirs(arguments.theirs)))
        return
    if not (math.isfinite(arguments.megabytes) and arguments.megabytes > 0):
        parser.error(f"--megabytes {arguments.megabytes} is not a size; give a number above 0, such as 200")
    with tempfile.TemporaryDirectory() as folder:
        logs = arguments.logs or sorted(RECORDED.glob("*.tlog"))
        if not logs:
            logs = [Path(folder) / "made_up.tlog"]
            made_up_log(logs[0])
        large, small = Path(folder) / "large.tlog", Path(folder) / "slice.tlog"
        make_large(large, logs, arguments.megabytes)
        with large.open("rb") as file:
            small.write_bytes(file.read(int(arguments.slice * 1e6)))
        copy = copy_rate(large)
        ours = in_a_process("--ours", str(large), str(logs[0]))
        theirs = in_a_process("--theirs", str(small))
    sys.stdout.write("\n".join(table(ours, theirs, copy)) + "\n")


if __name__ == "__main__":
    main()
