"""Ctrl-C and kill in flight: the vehicle is left safe, the log whole, the exit code says so."""

import itertools
import os
import signal
from pathlib import Path

import pytest

from tests.clients.sitl_process import free_port, running_sitl
from tests.slow import slow
from tests.system.logs import counts, mavutil_counts, modes, records
from tests.system.runs import SHORT, Run, started, wait_until

INTERRUPTED = 130
LONG = (*SHORT, "--periods", "20")
IN_FLIGHT_BYTES = {"px4": 1_000_000, "ardupilot": 1_000_000}


def fly_into(run: Run, mode: str) -> None:
    """Wait until the log shows the vehicle in a mode."""
    wait_until(lambda: run.ended or (run.log.exists() and mode in modes(run.log)))
    assert not run.ended, run.process.communicate()


def check_interrupted(run: Run, text: str, on_failure: str = "return") -> None:
    lines = [line for line in text.splitlines() if line.startswith("flightstack: ")]  # not the phases
    summary = run.summary
    left = {block["system_id"]: block["left"] for block in summary["vehicles"]}
    for entry in left.values():
        assert entry["commanded"][-1] == {"action": on_failure, "answer": "done"}
    assert lines == [
        f"flightstack: interrupted; the log is in {run.folder}",
        *(f"flightstack: vehicle {system_id}: {entry['text']}" for system_id, entry in left.items()),
    ]
    assert summary["outcome"] == "interrupted"
    assert counts(run.log) == summary["message_counts"]
    records(run.log)


@pytest.mark.parametrize(
    ("flavour", "on_failure", "via"),
    [slow("px4", "return", "waypoints"), ("px4", "hold", "setpoints"), ("ardupilot", "land", "waypoints")],
)
@pytest.mark.sampled(1)
def test_ctrl_c_in_an_embedded_flight(flavour: str, on_failure: str, via: str, tmp_path: Path) -> None:
    """The vehicle is commanded, and answers, before the run ends."""
    flight = ("--autopilot", flavour, "--via", via, "--on-failure", on_failure, "--speedup", "40")
    with started(tmp_path / "run", *LONG, *flight) as run:
        if via == "waypoints":
            fly_into(run, "mission")
        else:
            run.wait_for_log(1_200_000)
        run.process.send_signal(signal.SIGINT)
        check_interrupted(run, run.finish(INTERRUPTED), on_failure)
    assert modes(run.log)[-1] == on_failure


@pytest.mark.slow
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_ctrl_c_on_a_vehicle_elsewhere(flavour: str, tmp_path: Path) -> None:
    """It returns by itself and lands, without the mission."""
    port = free_port()
    watcher = free_port()
    links = [f"udpin:127.0.0.1:{port}", f"udpin:127.0.0.1:{watcher}"]
    with running_sitl(flavour, links, speedup=20.0):
        flight = ("--connect", f"udpout:127.0.0.1:{port}")
        with started(tmp_path / "run", *LONG, *flight) as run:
            fly_into(run, "mission")
            run.process.send_signal(signal.SIGINT)
            check_interrupted(run, run.finish(INTERRUPTED))
        assert modes(run.log)[-1] == "return"
        watch_landing(watcher)


def watch_landing(port: int) -> None:
    """Another client on another link sees the vehicle disarm."""
    from pymavlink import mavutil

    client = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", dialect="all")

    def disarmed() -> bool:
        client.mav.heartbeat_send(6, 8, 0, 0, 4)
        heartbeat = client.recv_match(type="HEARTBEAT", blocking=True, timeout=0.2)
        return heartbeat is not None and not heartbeat.base_mode & 128

    wait_until(disarmed, 60.0)
    client.close()


def test_a_second_ctrl_c_ends_at_once(tmp_path: Path) -> None:
    """The vehicle does not answer any more: a second Ctrl-C does not wait for it."""
    port = free_port()
    # slow enough that the log is flushed (once a second) before the attempts to make it safe end
    with running_sitl("px4", [f"udpin:127.0.0.1:{port}"], speedup=2.0) as sitl:
        with started(tmp_path / "run", *LONG, "--connect", f"udpout:127.0.0.1:{port}") as run:
            fly_into(run, "mission")
            sitl.process.send_signal(signal.SIGSTOP)
            try:
                size = run.log.stat().st_size
                run.process.send_signal(signal.SIGINT)
                wait_until(lambda: run.ended or run.log.stat().st_size > size)  # it tries to be safe
                assert not run.ended
                run.process.send_signal(signal.SIGINT)
                text = run.finish(INTERRUPTED)
            finally:
                sitl.process.send_signal(signal.SIGCONT)
        assert "interrupted" in text
        records(run.log)


def test_a_killed_flight_leaves_a_readable_log(tmp_path: Path) -> None:
    """kill -9, and a machine that loses the end of the file as well: all complete records are there."""
    with started(tmp_path / "run", *LONG, "--speedup", "40") as run:
        run.wait_for_log(600_000)
        run.process.kill()
        run.process.communicate()
    assert not (run.folder / "summary.json").exists()
    whole = records(run.log)  # the writer hands over whole records only
    assert whole[-1][0] - whole[0][0] > 5_000_000
    assert counts(run.log).total() == len(whole)
    written = run.log.stat().st_size
    for torn_bytes in (1, 7, 9, 100):
        os.truncate(run.log, written - torn_bytes)
        ends = itertools.accumulate(8 + len(frame.raw) for _, frame in whole)
        assert counts(run.log).total() == sum(end <= written - torn_bytes for end in ends), torn_bytes
    assert mavutil_counts(run.log) == counts(run.log)
