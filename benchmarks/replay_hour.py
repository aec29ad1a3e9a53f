"""An hour of flight at 50 Hz through the attitude filter, reading included, beside pymavlink's reading alone.

The log is made: IMU, attitude, speed, position and heartbeats of an aircraft that circles. Compiled code is
warmed up before; the file is in the page cache. pymavlink reads a slice of the same file in the same run.

python -m benchmarks.replay_hour [--minutes 60] [--rate 50] [--estimator attitude]
"""

import argparse
import math
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from autopilot_bridge.mavlink import FrameEncoder, dialect
from autopilot_bridge.tlog import TlogWriter
from estimators.library import make_estimator
from estimators.log_replay import Replay, replay
from estimators.logs import open_log

EPOCH_US = 1_700_000_000_000_000
G = 9.80665
SPEED_M_S = 20.0
ALTITUDE_M = 100.0
TAKEOFF_S = 10.0
SLICE_BYTES = 2_000_000


def messages(k: int, rate_hz: int) -> Iterator[Any]:
    """What the aircraft says in one period of the IMU: it stands, then circles with a bank that changes."""
    time_s = k / rate_hz
    ms, us = round(time_s * 1e3), round(time_s * 1e6)
    flying = time_s > TAKEOFF_S
    phase = time_s * 2 * math.pi / 60.0
    bank = 0.4 * math.sin(phase) if flying else 0.0
    bank_rate = 0.4 * 2 * math.pi / 60.0 * math.cos(phase) if flying else 0.0
    turn = G * math.tan(bank) / SPEED_M_S
    yield dialect.MAVLink_highres_imu_message(
        us, 0.0, 0.0, -G / math.cos(bank),
        bank_rate, turn * math.sin(bank), turn * math.cos(bank),
        *(0.2, 0.0, 0.4, 1000.0, 2.0, ALTITUDE_M, 20.0), 0x3F,
    )  # fmt: skip
    yield dialect.MAVLink_attitude_message(ms, bank, 0.0, 0.0, bank_rate, 0.0, turn)
    if k % 5 == 0:
        airspeed = SPEED_M_S if flying else 0.0
        yield dialect.MAVLink_vfr_hud_message(airspeed, airspeed, 0, 50, ALTITUDE_M, 0.0)
        yield dialect.MAVLink_global_position_int_message(
            ms, 473977420, 85455940, 588_000, round(ALTITUDE_M * 1e3), round(airspeed * 100), 0, 0, 0
        )
    if k % rate_hz == 0:
        armed = dialect.MAV_MODE_FLAG_SAFETY_ARMED if flying else 0
        yield dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_FIXED_WING, 12, 1 | armed, 4 << 16, 4, 3)
        landed = dialect.MAV_LANDED_STATE_IN_AIR if flying else dialect.MAV_LANDED_STATE_ON_GROUND
        yield dialect.MAVLink_extended_sys_state_message(0, landed)


def make_log(path: Path, minutes: float, rate_hz: int) -> int:
    """Write the log; returns how many messages it has."""
    encoder = FrameEncoder(1, 1)
    with TlogWriter(path) as log:
        for k in range(1, round(minutes * 60.0 * rate_hz)):
            for message in messages(k, rate_hz):
                log.write(EPOCH_US + k * 1_000_000 // rate_hz, encoder.encode(message))
        return log.records


def timed(action: Callable[[], Any]) -> tuple[Any, float, float]:
    """Result, wall seconds and processor seconds."""
    wall, processor = time.perf_counter(), time.process_time()
    result = action()
    return result, time.perf_counter() - wall, time.process_time() - processor


def pymavlink_messages(path: Path) -> int:
    """Read all messages of a log with pymavlink."""
    os.environ["MAVLINK20"] = "1"
    from pymavlink import mavutil

    link = mavutil.mavlink_connection(str(path), dialect="all")
    count = 0
    while link.recv_msg() is not None:
        count += 1
    return count


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=60.0, help="of flight")
    parser.add_argument("--rate", type=int, default=50, help="of the IMU, Hz")
    parser.add_argument("--estimator", default="attitude")
    given = parser.parse_args()
    if not (0.5 <= given.minutes <= 10_000.0 and 10 <= given.rate <= 1000):
        parser.error("give --minutes of 0.5 to 10000 and a --rate of 10 to 1000")
    with tempfile.TemporaryDirectory() as folder:
        log, warm, part = (Path(folder) / name for name in ("hour.tlog", "warm.tlog", "slice.tlog"))
        make_log(warm, 0.5, given.rate)
        count = make_log(log, given.minutes, given.rate)
        with log.open("rb") as file:
            part.write_bytes(file.read(SLICE_BYTES))

        def run(path: Path) -> Replay:
            return replay(open_log(path), lambda: make_estimator(given.estimator))

        run(warm)
        found, wall_s, cpu_s = timed(lambda: run(log))
        theirs, their_wall_s, their_cpu_s = timed(lambda: pymavlink_messages(part))
        size = log.stat().st_size
    outcomes = [runner.outcomes for runner in found.fleet.runners.values()]
    received = sum(sum(counter.values()) for counter in outcomes)
    made = sum(len(t) for runner in found.fleet.runners.values() for t in runner.tables.values())
    if found.partial or not made:
        sys.exit(f"the replay failed: {found.failure or found.lacking or 'no estimate was made'}")
    hour = 60.0 / given.minutes
    write = sys.stdout.write
    write(
        f"{given.minutes:g} minutes at {given.rate} Hz: {size / 1e6:.1f} MB, {count} messages, "
        f"{received} of them received, {made} estimates\n"
        f"{'':<34} {'wall s':>8} {'CPU s':>8} {'us/message':>11} {'of CPU':>8}\n"
        f"{'read and estimate (of those received)':<34} {wall_s:8.2f} {cpu_s:8.2f}"
        f" {wall_s / received * 1e6:11.2f} {cpu_s / received * 1e6:8.2f}\n"
        f"{'pymavlink, reading of a slice only':<34} {their_wall_s:8.2f} {their_cpu_s:8.2f}"
        f" {their_wall_s / theirs * 1e6:11.2f} {their_cpu_s / theirs * 1e6:8.2f}\n"
        f"an hour takes {wall_s * hour:.2f} s ({cpu_s * hour:.2f} s of CPU time); "
        f"pymavlink's reading of it alone would take {their_wall_s / theirs * count * hour:.1f} s "
        f"({their_cpu_s / theirs * count * hour:.1f} s)\n"
    )


if __name__ == "__main__":
    main()
