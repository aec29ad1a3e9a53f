"""A handoff in processes of its own, in real time: SITL with video, vision beside its streams, mission."""

import json
import signal
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from autopilot_bridge.mavlink import decode
from autopilot_bridge.mavlink.handoff_messages import read_decision
from autopilot_bridge.tlog import TlogReader
from estimators.library import make_estimator
from estimators.log_replay import replay
from estimators.logs import open_log
from tests.clients.forked_process import flightstack
from tests.clients.sitl_process import free_port, running_sitl

EXAMPLES = Path(__file__).parents[3] / "examples"
DEADLINE_S = 1500.0
SETTINGS = ("decision=0.95", "target_north_m=900", "target_east_m=200")


def vision(port, video, system_id, out, *words):
    return flightstack(
        "vision", f"rtsp://127.0.0.1:{video}/camera{system_id}", "--camera",
        str(EXAMPLES / "handoff_camera.toml"), "--connect", f"udpout:127.0.0.1:{port}", "--detect", "motion",
        "--system-id", str(system_id), "--silence", "30", "--film", "--out", str(out), *words, merged=True,
    )  # fmt: skip


def points_in(path):
    """Number of messages of moving points in a log; 0: it is not there yet."""
    frames = (frame for _, frame in TlogReader(path)) if path.exists() else ()
    return sum(frame.component_id == 28 and frame.definition.name == "TUNNEL" for frame in frames)


def decisions_in(path):
    """The decisions that were sent in a flight."""
    tunnels = (decode(frame) for _, frame in TlogReader(path) if frame.definition.name == "TUNNEL")
    read = (read_decision(m.payload_type, m.payload_length, m.payload) for m in tunnels)  # type: ignore[attr-defined]
    return [decision for decision in read if decision is not None]


def wait_for(found, *processes):
    end_s = time.monotonic() + DEADLINE_S
    while not found():
        assert time.monotonic() < end_s and all(process.poll() is None for process in processes)
        time.sleep(1.0)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_handoff_in_processes_survives_the_end_of_a_vision_process_and_reports_that_of_the_sitl(tmp_path):
    port, video = free_port(), free_port()
    options = ("--world", str(EXAMPLES / "handoff.toml"), "--video", str(video), "--video-rate", "10")
    with running_sitl("px4", [f"udpin:127.0.0.1:{port}"], speedup=1.0, options=options) as sitl:
        first, second = (vision(port, video, k, tmp_path / f"vision{k}") for k in (1, 2))
        connect = f"udpout:127.0.0.1:{port}"
        mission = flightstack(
            "fly", "handoff", "--connect", connect, "--connect", connect, "--system-id", "1", "--system-id",
            "2", "--decision", "0.95", "--confirm-after", "5", "--takeover", "10", "--out",
            str(tmp_path / "fly"), merged=True,
        )  # fmt: skip
        try:
            wait_for(lambda: points_in(tmp_path / "vision1" / "flight.tlog") > 20, mission, first, second)
            first.send_signal(signal.SIGKILL)
            first.wait(60.0)
            # the height of the ground is not known to a process that starts in the air
            first = vision(port, video, 1, tmp_path / "again1", "--ground-altitude", "489")
            assert mission.wait(DEADLINE_S) == 0, mission.communicate(timeout=10.0)
            sitl.process.send_signal(signal.SIGKILL)
            for process in (first, second):
                printed, _ = process.communicate(timeout=120.0)
                assert process.returncode == 1 and "was received on" in printed
        finally:
            for process in (first, second, mission):
                if process.poll() is None:
                    process.kill()
    summary = json.loads((tmp_path / "fly" / "summary.json").read_text())
    assert summary["decided"] and summary["released"] and summary["probability"] >= 0.95
    done = replay(open_log(tmp_path / "fly" / "flight.tlog"), partial(make_estimator, "handoff", SETTINGS))
    (runner,) = done.fleet.runners.values()
    (table,) = runner.tables.values()
    decided = table["decided"] > 0
    # the log has the frames of both links, so scans may come in another order, and tracks get other numbers
    assert decided.any() and table["probability"][decided].max() >= 0.95
    assert len(np.unique(table["track"][decided])) == 1
    # both are the same target: it is at the same place of the aircraft's frame, within a second
    places = np.column_stack((table["target_forward_m"], table["target_right_m"]))
    off_m = [
        np.hypot(*(places[near] - sent.track.place_m).T).min()
        for sent in decisions_in(tmp_path / "fly" / "flight.tlog")
        if sent.decided and (near := decided & (abs(table.time_us - sent.time_us) < 1_000_000)).any()
    ]
    assert len(off_m) > 1 and np.median(off_m) < 10.0
