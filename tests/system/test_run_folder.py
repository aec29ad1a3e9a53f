"""What a run leaves: a log that other people's tools read, with both directions and the truth in it, and a
summary that agrees with it. Truth is in the log only: no link ever carries it.
"""

import re
import subprocess
import sys
import sysconfig
from collections import Counter
from pathlib import Path

import pytest

from autopilot_bridge.clock import LoopClock
from autopilot_bridge.mavlink import FrameParser, Packet, definition
from autopilot_bridge.mavlink.components import SIMULATOR_COMPONENT
from autopilot_bridge.sitl import Sitl
from autopilot_bridge.sitl.sitl import TruthListener
from autopilot_bridge.sitl.truth import TruthEncoder
from flightsim import truth as t
from missions.cli.main import run_command_line
from tests.slow import slow
from tests.system.logs import counts, known_name, mavutil_counts, records
from tests.system.runs import SHORT, Run, fly_all

TRUTH = definition("HIL_STATE_QUATERNION").message_id
SUMMARY_KEYS = {
    "mission", "vehicle", "autopilot", "seed", "outcome", "sim_time_s", "wall_time_s", "speedup",
    "distance_m", "path_rms_error_m", "path_max_error_m", "max_attitude_error_deg", "message_counts",
    "versions",
}  # fmt: skip


@pytest.fixture(scope="module", params=[slow("px4"), "ardupilot"])
def run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp(request.param) / "run"
    arguments = [*SHORT, "--autopilot", request.param, "--seed", "3"]
    arguments.remove("--no-picture")
    return fly_all([(folder, arguments)])[0]


def test_summary(run: Run) -> None:
    summary = run.summary
    assert set(summary) >= SUMMARY_KEYS
    assert summary["outcome"] == "completed" and summary["seed"] == 3
    assert (run.folder / "track.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    names = {path.name for path in run.folder.iterdir()}
    assert names == {"flight.scene", "flight.tlog", "summary.json", "track.png"}


def test_log_has_both_directions_and_the_truth(run: Run) -> None:
    recorded = records(run.log)
    senders = Counter((frame.system_id, frame.component_id) for _, frame in recorded)
    assert set(senders) == {(1, 1), (255, 190), (1, SIMULATOR_COMPONENT)}  # autopilot, mission, simulator
    simulated = {frame.message_id for _, frame in recorded if frame.component_id == SIMULATOR_COMPONENT}
    assert simulated == {TRUTH}
    seconds = run.summary["sim_time_s"]
    assert senders[1, SIMULATOR_COMPONENT] == pytest.approx(50.0 * seconds, rel=0.01)
    stamps = [stamp for stamp, _ in recorded]
    assert stamps == sorted(stamps)
    assert (stamps[-1] - stamps[0]) * 1e-6 == pytest.approx(seconds, abs=1.5)


def test_counts_agree_with_every_reader(run: Run) -> None:
    expected = Counter(run.summary["message_counts"])
    assert counts(run.log) == expected
    assert mavutil_counts(run.log) == expected


def test_mavlogdump_reads_it(run: Run) -> None:
    """pymavlink's own tool, as MAVProxy's users have it."""
    tool = Path(sysconfig.get_path("scripts")) / "mavlogdump.py"
    if not tool.exists():
        pytest.skip("pymavlink was installed without its tools")
    command = [sys.executable, str(tool), "--dialect", "all", "--quiet", "--show-types", str(run.log)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100.0, check=True)
    assert {known_name(name) for name in done.stdout.split()} == set(run.summary["message_counts"])
    if run.summary["autopilot"] != "px4":  # how it prints a message does not depend on the sender
        return
    command = [sys.executable, str(tool), "--dialect", "all", "--types", "HIL_STATE_QUATERNION", str(run.log)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100.0, check=True)
    lines = re.findall(r"^20\d\d-.*HIL_STATE_QUATERNION \{time_usec", done.stdout, re.MULTILINE)
    assert len(lines) == run.summary["message_counts"]["HIL_STATE_QUATERNION"]


@pytest.fixture
def received(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, bytes]]:
    """Every frame that any memory link of a run carries, with the system's time."""
    from autopilot_bridge.links import MemoryLink

    carried: list[tuple[int, bytes]] = []
    send, send_packet = MemoryLink.send, MemoryLink.send_packet

    def spy(self: MemoryLink, data: bytes, to: object = None) -> None:
        carried.append((LoopClock().time_us, data))
        send(self, data)

    def spy_on_packets(self: MemoryLink, packet: Packet) -> None:
        carried.extend((LoopClock().time_us, frame.raw) for frame in packet)
        send_packet(self, packet)

    monkeypatch.setattr(MemoryLink, "send", spy)
    monkeypatch.setattr(MemoryLink, "send_packet", spy_on_packets)
    return carried


def test_truth_reaches_no_client(
    received: list[tuple[int, bytes]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No link carries it, and a flight whose truth frames are falsified is the same flight: no client on the
    vehicle's side, the mission included, looks at them.
    """
    arguments = ["fly", *SHORT, "--seed", "4"]
    assert run_command_line([*arguments, "--out", str(tmp_path / "honest")]) == 0
    honest = list(received)
    received.clear()
    on_truth = Sitl.on_truth

    def falsified(self: Sitl, listener: TruthListener) -> None:
        for vehicle in self.vehicles:
            lie = vehicle.vehicle.truth.copy()  # the vehicle never moves from a place elsewhere
            lie[t.LAT_RAD] += 1e-4
            lie[t.ALT_M] += 100.0
            lie[t.VEL_NED_M_S] = 50.0
            vehicle.truth_encoder = TruthEncoder(vehicle.specification.system_id, lie)
        on_truth(self, listener)

    monkeypatch.setattr(Sitl, "on_truth", falsified)
    assert run_command_line([*arguments, "--out", str(tmp_path / "falsified")]) == 0
    assert received == honest
    parser = FrameParser()
    frames = [frame for _, data in honest for frame in parser.feed(data)]
    assert parser.counters.bytes_dropped == 0 and len(frames) > 1000
    assert {(frame.system_id, frame.component_id) for frame in frames} == {(1, 1), (255, 190)}
    assert TRUTH not in {frame.message_id for frame in frames}
    logs = [(tmp_path / name / "flight.tlog").read_bytes() for name in ("honest", "falsified")]
    assert logs[0] != logs[1]  # the falsified truth did go into the log
