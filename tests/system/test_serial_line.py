"""Missions over a serial line that carries no more than a real one, and one that is pulled out in flight."""

import itertools
import time
from pathlib import Path

import pytest

from autopilot_bridge.mavlink import DEFINITIONS, decode, definition
from autopilot_bridge.tlog import TlogReader
from tests.clients.sitl_process import running_sitl
from tests.serial_line import SerialLine, serial_line
from tests.slow import slow
from tests.system.logs import modes, records
from tests.system.runs import SHORT, Run, started, wait_until

BAUD = 57600
SPEEDUP, QUICK = 10.0, 20.0
OFF_S = 1.5
"""Wall seconds without the line: longer than any failsafe waits, shorter than a mission does."""
MISSION_FAILED = 1
POSITION = definition("GLOBAL_POSITION_INT").message_id


def in_flight(run: Run, mode: str, height_m: float = 3.0) -> None:
    """Wait until the vehicle is in a mode and up in the air."""
    wait_until(
        lambda: run.ended or (run.log.exists() and mode in modes(run.log) and highest_m(run.log) > height_m)
    )
    assert not run.ended, run.process.communicate()


def highest_m(log: Path) -> float:
    return max(
        (decode(frame).relative_alt * 1e-3 for _, frame in TlogReader(log) if frame.message_id == POSITION),  # type: ignore[attr-defined]
        default=0.0,
    )


def pull(line: SerialLine) -> None:
    line.unplug()
    time.sleep(OFF_S)  # the plug is out: nothing can tell when it has been so long enough
    line.plug()


def longest_gap_s(log: Path, name: str) -> float:
    """Between two messages of the autopilot, by vehicle time."""
    times_ms = [
        decode(frame).time_boot_ms  # type: ignore[attr-defined]
        for _, frame in TlogReader(log)
        if DEFINITIONS[frame.message_id].name == name and frame.component_id == 1
    ]
    return max(b - a for a, b in itertools.pairwise(times_ms)) * 1e-3


@pytest.mark.parametrize(("flavour", "via"), [slow("px4", "setpoints"), ("ardupilot", "waypoints")])
def test_a_mission_at_57600_baud(flavour: str, via: str, tmp_path: Path) -> None:
    """With the true rate of the line, which at this speedup is so much higher in wall time."""
    with (
        serial_line(tmp_path / "line", round(BAUD * QUICK)) as line,
        running_sitl(flavour, [line.vehicle], speedup=QUICK),
        started(tmp_path / "run", *SHORT, "--via", via, "--connect", line.ground, "--yes") as run,
    ):
        run.finish()
        vehicle_s = run.summary["sim_time_s"]
        assert line.down.carried_bytes < 1.1 * BAUD / 10 * (vehicle_s + 40.0)
        assert line.down.carried_bytes > 0.5 * BAUD / 10 * vehicle_s  # it was narrow
    summary = run.summary
    assert summary["outcome"] == "completed"
    assert summary["path_rms_error_m"] < (0.6 if via == "setpoints" else 2.5)
    assert summary["message_counts"]["ATTITUDE"] > 2.0 * vehicle_s


@pytest.mark.slow
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_pulled_out_and_put_in_again_in_a_mission(flavour: str, tmp_path: Path) -> None:
    """The vehicle flies its waypoints on, both ends find the line again, and the mission ends as planned."""
    with (
        serial_line(tmp_path / "line", round(BAUD * SPEEDUP)) as line,
        running_sitl(flavour, [line.vehicle], speedup=SPEEDUP),
        started(tmp_path / "run", *SHORT, "--periods", "2", "--connect", line.ground, "--yes") as run,
    ):
        in_flight(run, "mission")
        pull(line)
        run.finish()
    assert run.summary["outcome"] == "completed"
    assert longest_gap_s(run.log, "ATTITUDE") > 0.8 * OFF_S * SPEEDUP
    records(run.log)


@pytest.mark.slow
@pytest.mark.parametrize(("flavour", "flying"), [("px4", "offboard"), ("ardupilot", "guided")])
def test_pulled_out_while_setpoints_are_streamed(flavour: str, flying: str, tmp_path: Path) -> None:
    """PX4 does what COM_OBL_RC_ACT says, ArduPilot stops; the mission goes on, or ends and says why."""
    with (
        serial_line(tmp_path / "line", round(BAUD * SPEEDUP)) as line,
        running_sitl(flavour, [line.vehicle], speedup=SPEEDUP),
        started(
            tmp_path / "run",
            *SHORT,
            "--periods",
            "4",
            "--via",
            "setpoints",
            "--connect",
            line.ground,
            "--yes",
        ) as run,
    ):
        in_flight(run, flying)
        run.wait_for_log(run.log.stat().st_size + 100_000)
        pull(line)
        run.process.wait(60.0)
        out = "".join(run.process.communicate())
    summary = run.summary
    records(run.log)
    assert "Traceback" not in out
    if run.process.returncode:
        assert run.process.returncode == MISSION_FAILED
        assert summary["outcome"] == "failed"
        assert "left the guided mode" in summary["reason"], summary["reason"]
        assert modes(run.log)[-1] == "return"
    else:
        assert summary["outcome"] == "completed"
