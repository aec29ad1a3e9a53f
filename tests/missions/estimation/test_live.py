"""An estimator as a process on a UDP link: what it hears, tells, logs; silence, garbage, interruptions."""

import contextlib
import itertools
import json
import math
import random
import re
import signal
import socket
import threading
from pathlib import Path

import numpy as np
import pytest

from autopilot_bridge.errors import TlogError
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode, dialect
from autopilot_bridge.tlog import TlogWriter
from estimators.logs import open_log
from estimators.names import ESTIMATORS
from flightsim.foundation.vectors import from_euler
from missions.cli.main import run_command_line
from tests.clients.forked_process import flightstack
from tests.clients.sitl_process import free_port
from tests.slow import slow

LONG = "40"
"""Duration, s: a machine that stands still for a second takes ten of them away from whoever plays so fast."""
LEVEL = str(Path(__file__).parents[2] / "estimators" / "level.py")


def attitude(ms):
    return dialect.MAVLink_attitude_message(ms, math.sin(ms / 3000), 0.1, 0, 0, 0, 0)


def imu(ms):
    return dialect.MAVLink_highres_imu_message(ms * 1000, 0, 0, -9.81, *(0.0,) * 10, 0)


def untimed(ms):
    return dialect.MAVLink_vfr_hud_message(0, 0, 0, 0, math.sin(ms / 3000), 0)


def team():
    """What two drones say for ever, that fly along a meridian and see a target 30 m east of its middle."""
    home, height_m, east_m, omega = (473977400, 85455900, 500000), 20.0, 30.0, 0.1
    for ms in itertools.count(1000, 100):
        for system, side in ((1, 1.0), (2, -1.0)):
            north_m = side * 50.0 * math.cos(omega * ms / 1000)
            speed_m_s = -side * 50.0 * omega * math.sin(omega * ms / 1000)
            nose = 0.0 if speed_m_s > 0.0 else math.pi
            level_m = math.hypot(north_m, east_m)
            pitch, yaw = -math.atan2(height_m, level_m), math.atan2(east_m, -north_m) - nose
            gps = 3, home[0] + round(north_m / 0.01112), home[1], 520000, 1, 1, round(100 * abs(speed_m_s))
            for component, message in (
                (1, dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3)),
                (1, dialect.MAVLink_home_position_message(*home, 0, 0, 0, (1, 0, 0, 0), 0, 0, 0)),
                (1, dialect.MAVLink_gps_raw_int_message(1000 * ms, *gps, round(nose / math.pi * 18000), 9)),
                (
                    154,
                    dialect.MAVLink_gimbal_device_attitude_status_message(
                        0, 0, ms, 32, from_euler(0.0, pitch, yaw), 0, 0, 0, 0
                    ),
                ),
                (
                    100,
                    dialect.MAVLink_landing_target_message(
                        1000 * ms, 7, 12, 0, 0, math.hypot(level_m, height_m), 0.02, 0.02
                    ),
                ),
            ):
                yield system, component, message


class ScriptedVehicle(threading.Thread):
    """Says HEARTBEAT and ATTITUDE to a UDP port, up to ten times as fast as real time, and hears the answers.

    Args:
        period_ms: between messages, until a client asks for more.
    """

    def __init__(
        self,
        port,
        *,
        seconds=math.inf,
        system=1,
        willing=True,
        garbage=False,
        repeat=False,
        says=attitude,
        period_ms=500,
    ):
        super().__init__(daemon=True)
        self.received = []
        self.done = threading.Event()
        self._port, self._seconds, self._system = port, seconds, system
        self._willing, self._garbage, self._repeat, self._says = willing, garbage, repeat, says
        self._period_ms = period_ms

    def run(self):
        chance = random.Random(1)
        encoder, parser = FrameEncoder(self._system, 1), FrameParser()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            link.setblocking(False)
            ms = 1000
            while not self.done.is_set() and ms < 1000 + 1000 * self._seconds:
                data = b""
                if ms % 1000 == 0:
                    data += encoder.encode(dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3))
                if ms % self._period_ms == 0:
                    frame = encoder.encode(self._says(ms))
                    data += frame + (frame if self._repeat and chance.random() < 0.2 else b"")
                if self._garbage:
                    data += chance.randbytes(chance.randrange(40))
                with contextlib.suppress(OSError):
                    link.sendto(data, ("127.0.0.1", self._port))
                with contextlib.suppress(OSError):
                    while True:
                        for frame in parser.feed(link.recv(65536)):
                            self._hear(decode(frame))
                ms += 10
                self.done.wait(0.001)

    def _hear(self, message):
        self.received.append(message)
        if (
            message.get_type() == "COMMAND_LONG"
            and message.param1 == type(self._says(0)).id
            and self._willing
        ):
            self._period_ms = max(10, round(message.param2 / 1e4) * 10)


@pytest.fixture
def port():
    return free_port()


@pytest.fixture
def vehicle(port):
    """Factory of vehicles that talk to the port."""
    made = []

    def start(**changes):
        made.append(ScriptedVehicle(port, **changes))
        made[-1].start()
        return made[-1]

    yield start
    for thread in made:
        thread.done.set()
        thread.join()


def estimate(tmp_path, port, *arguments, estimator=LEVEL, connect="udpin"):
    return run_command_line(
        [
            "estimate",
            str(estimator),
            "--connect",
            f"{connect}:127.0.0.1:{port}",
            "--out",
            str(tmp_path / "run"),
            *arguments,
        ]
    )


def summary_of(tmp_path):
    return json.loads((tmp_path / "run" / "summary.json").read_text())


def assert_replay_is_the_same(tmp_path):
    log, again = tmp_path / "run" / "flight.tlog", tmp_path / "again"
    assert (
        run_command_line(["replay", str(log), "--estimator", LEVEL, "--out", str(again), "--no-picture"]) == 0
    )
    ours, theirs = np.load(tmp_path / "run" / "estimates.npz"), np.load(again / "estimates.npz")
    for column in ours:
        assert ours[column].tobytes() == theirs[column].tobytes()
    counters = json.loads((again / "summary.json").read_text())["counters"]
    assert counters == summary_of(tmp_path)["counters"]
    return ours


@pytest.mark.parametrize("system", [slow(1), 42])
def test_it_asks_hears_tells_and_its_log_gives_the_same_estimates(tmp_path, port, vehicle, system):
    there = vehicle(system=system, repeat=True)
    assert estimate(tmp_path, port, "--duration", LONG) == 0
    summary = summary_of(tmp_path)
    assert summary["outcome"] == "completed" and not summary["partial"]
    assert summary["system_id"] == system
    assert summary["counters"]["repeated"] > 10
    assert summary["link"]["published"] > 20
    estimates = assert_replay_is_the_same(tmp_path)
    assert len(estimates["time_us"]) == summary["samples"] > 50
    said = {(m.get_type(), m.get_srcSystem(), m.get_srcComponent()) for m in there.received}
    assert ("ATTITUDE", system, 191) in said and ("HEARTBEAT", system, 191) in said
    log = open_log(tmp_path / "run" / "flight.tlog")
    assert not any(loss.lost for loss in log.source.losses)


def connected(port):
    """A TCP connection to who is soon going to listen there."""
    waited = threading.Event()
    for _ in range(1200):
        with contextlib.suppress(OSError):
            return socket.create_connection(("127.0.0.1", port))
        waited.wait(0.05)
    raise AssertionError(f"no listener at {port}")


@pytest.mark.slow
def test_a_base_station_hears_a_team_on_one_link(tmp_path):
    """By TCP, which waits for a machine with other work: on UDP what is not taken in at once is lost."""
    done, port = threading.Event(), free_port(socket.SOCK_STREAM)

    def say():
        encoders = {}
        with connected(port) as link:
            for system, component, message in team():
                encoder = encoders.setdefault((system, component), FrameEncoder(system, component))
                with contextlib.suppress(OSError):
                    link.sendall(encoder.encode(message))
                if done.wait(0.002):  # five times real time
                    return

    there = threading.Thread(target=say, daemon=True)
    there.start()
    settings = ("--set", "omega_y_rad_s=0.1")
    requested = ("--duration", LONG, *settings)
    code = estimate(tmp_path, port, *requested, estimator="target-fusion", connect="tcpin")
    done.set()
    there.join()
    assert code == 0
    (block,) = summary_of(tmp_path)["vehicles"]
    assert block["remarks"]["drones"] == 2.0 and block["remarks"]["detections_fused"] > 100.0
    ours = np.load(tmp_path / "run" / "estimates.npz")
    assert np.abs(ours["east_m"] - 30.0).max() < 2.0 and np.abs(ours["north_m"]).max() < 2.0
    assert set(ours["vehicle"].tolist()) == {1.0, 2.0} and set(ours["target"].tolist()) == {7.0}
    reported = open_log(tmp_path / "run" / "flight.tlog").table(
        "FOLLOW_TARGET", system_id=255, component_id=191
    )
    assert len(reported) > 20
    arguments = ["--estimator", "target-fusion", *settings, "--no-picture", "--out", str(tmp_path / "again")]
    assert run_command_line(["replay", str(tmp_path / "run" / "flight.tlog"), *arguments]) == 0
    theirs = np.load(tmp_path / "again" / "estimates.npz")
    assert all(ours[column].tobytes() == theirs[column].tobytes() for column in ours)


@pytest.mark.slow
def test_it_can_be_silent(tmp_path, port, vehicle):
    there = vehicle(willing=False)
    assert estimate(tmp_path, port, "--duration", "6", "--no-request", "--no-publish") == 1
    assert {m.get_type() for m in there.received} == {"HEARTBEAT"}


class FullAtTheEnd(TlogWriter):
    """A log on a disk that has no room for what is left to write when it is closed."""

    def close(self):
        self._buffer.clear()
        super().close()
        raise TlogError(f"can't write {self.path}: No space left on device; check the disk")


def test_a_log_whose_last_part_is_refused_is_reported(tmp_path, port, vehicle, capfd, monkeypatch):
    monkeypatch.setattr("missions.estimation.live.TlogWriter", FullAtTheEnd)
    vehicle()
    assert estimate(tmp_path, port, "--duration", "3", "--no-picture") == 1
    assert "No space left on device" in capfd.readouterr().err
    summary = summary_of(tmp_path)
    assert summary["outcome"] == "failed" and "No space left on device" in summary["reason"]


def test_what_the_link_lacks_is_reported_and_nothing_is_published(tmp_path, port, vehicle, capfd):
    there = vehicle(willing=False)
    assert estimate(tmp_path, port, "--duration", LONG) == 1
    error = capfd.readouterr().err
    assert re.search(r"ATTITUDE at \d\.?\d* Hz; needs 10 Hz or more for attitude", error)
    assert "are partial" in error
    assert summary_of(tmp_path)["partial"]
    assert [m for m in there.received if m.get_type() == "COMMAND_LONG"]
    assert not [m for m in there.received if m.get_type() == "ATTITUDE"]


@pytest.mark.parametrize(("says", "seconds", "period_ms"), [(imu, LONG, 500), (untimed, "1.5", 10)])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_its_duration_ends_on_a_vehicle_that_says_little(tmp_path, port, vehicle, says, seconds, period_ms):
    """Nothing but what was requested, as ArduPilot does; or nothing that tells a time: wall time counts.

    Of that a busy machine leaves little: enough has to come without being requested.
    """
    vehicle(says=says, period_ms=period_ms)
    own, name = tmp_path / "own.py", says(0).get_type()
    text = Path(LEVEL).read_text().replace('"ATTITUDE"', f'"{name}"')
    own.write_text(text.replace("message.roll", "1.0").replace("message.pitch", "0.0"))
    assert estimate(tmp_path, port, "--duration", seconds, "--no-picture", estimator=own) == 0
    recorded = open_log(tmp_path / "run" / "flight.tlog")
    assert {key.name for key in recorded.keys if key.component_id == 1} == {"HEARTBEAT", name}
    if says is imu:
        times = recorded.table(name).time_us
        assert 5.0 < (times[-1] - times[0]) * 1e-6 < 1.5 * float(LONG)


def test_garbage_on_the_link_is_counted_and_harms_nothing(tmp_path, port, vehicle):
    vehicle(garbage=True)
    assert estimate(tmp_path, port, "--duration", "20") == 0
    assert summary_of(tmp_path)["link"]["bytes_junk"] > 1000
    assert_replay_is_the_same(tmp_path)


def test_a_link_that_goes_silent_keeps_what_came(tmp_path, port, vehicle, capfd):
    vehicle(seconds=15)
    assert estimate(tmp_path, port, "--duration", "500", "--silence", "1") == 1
    assert "has been silent for 1 s; what came before is kept" in capfd.readouterr().err
    summary = summary_of(tmp_path)
    assert summary["partial"] and summary["outcome"] == "failed"
    assert summary["samples"] > 100
    assert_replay_is_the_same(tmp_path)


def test_a_vehicle_that_is_not_there(tmp_path, port, vehicle, capfd):
    vehicle(system=7)
    assert estimate(tmp_path, port, "--system-id", "3", "--silence", "0.7") == 1
    error = capfd.readouterr().err
    assert f"no vehicle 3 was received on udpin:127.0.0.1:{port} within 0.7 s (received: vehicle 7)" in error


@pytest.mark.parametrize(
    ("arguments", "reported"),
    [
        (["level", "--connect", "udpin:127.0.0.1:1"], f"there are {', '.join(ESTIMATORS)}"),
        ([LEVEL, "--connect", "carrier pigeon"], "carrier pigeon"),
        ([LEVEL, "--connect", "flight.tlog"], "that is a log; use flightstack replay"),
        (
            [LEVEL, "--connect", "udpin:127.0.0.1:1", "--component-id", "1"],
            "--component-id 1 is not in 191..194",
        ),
        (
            [LEVEL, "--connect", "udpin:127.0.0.1:1", "--duration", "0"],
            "--duration 0 is not possible; ask for more than 0",
        ),
        ([LEVEL], "Missing option '--connect'"),
    ],
)
def test_wrong_use(tmp_path, monkeypatch, capfd, arguments, reported):
    monkeypatch.chdir(tmp_path)
    assert run_command_line(["estimate", *arguments]) == 2
    assert reported in capfd.readouterr().err
    assert not list(tmp_path.iterdir())


def start_process(tmp_path, port, *arguments):
    """The same as a process; waits until its log has something in it."""
    link = ("--connect", f"udpin:127.0.0.1:{port}")
    out = ("--out", str(tmp_path / "run"), "--no-picture")
    process = flightstack("estimate", LEVEL, *link, *out, *arguments)
    log = tmp_path / "run" / "flight.tlog"
    waited = threading.Event()
    for _ in range(3000):
        if log.exists() and log.stat().st_size > 20_000:
            return process, log
        assert process.poll() is None, process.communicate()
        waited.wait(0.05)
    process.kill()
    raise AssertionError(f"nothing was logged: {process.communicate()}")


@pytest.mark.parametrize(
    ("number", "arguments", "code"),
    [slow(signal.SIGINT, (), 0), (signal.SIGTERM, ("--duration", "9999"), 130)],
)
def test_a_signal_ends_it_in_good_order(tmp_path, port, vehicle, number, arguments, code):
    vehicle()
    process, _ = start_process(tmp_path, port, *arguments)
    process.send_signal(number)
    out, error = process.communicate(timeout=120)
    assert process.returncode == code, error
    assert "Traceback" not in error
    assert summary_of(tmp_path)["partial"] is (code == 130)
    assert "estimates; run:" in out
    assert_replay_is_the_same(tmp_path)


def test_a_killed_process_leaves_a_log_that_can_be_replayed(tmp_path, port, vehicle):
    vehicle()
    process, log = start_process(tmp_path, port)
    process.kill()
    process.communicate()
    again = tmp_path / "again"
    assert run_command_line(["replay", str(log), "--estimator", LEVEL, "--out", str(again)]) == 0
    assert json.loads((again / "summary.json").read_text())["samples"] > 100
    assert open_log(log).source.bytes_by_kind  # and not a byte of it is torn


def test_a_process_that_stood_still_counts_that_as_no_silence(tmp_path, port, capfd, monkeypatch):
    now_s, waits = 100.0, []

    async def wait_for(awaited, timeout):
        nonlocal now_s
        awaited.close()
        waits.append(timeout)
        now_s += timeout + (3.0 if len(waits) == 2 else 0.0)  # the machine is paused once
        raise TimeoutError

    monkeypatch.setattr("missions.estimation.live.wall_time_s", lambda: now_s)
    monkeypatch.setattr("missions.estimation.live.asyncio.wait_for", wait_for)
    assert estimate(tmp_path, port, "--silence", "1") == 1
    assert "no vehicle was received" in capfd.readouterr().err
    assert sum(waits) == pytest.approx(1.25)
