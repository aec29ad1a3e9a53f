"""Flights whose process is asked to end: the vehicle is made safe, and what there is of the run is whole."""

import json
import signal
from pathlib import Path

import pytest

from missions.flown.records import FlightRecords
from tests.system.runs import SHORT, started, wait_until
from tests.terminal import at_terminal

LONG = (*SHORT, "--periods", "50", "--speedup", "5")
"""It lasts longer than the tests wait."""
RETURNED = [{"action": "return", "answer": "done"}]


def flies(log: Path) -> bool:
    """Whether a log says that its vehicle has left the ground."""
    if not log.exists():
        return False
    heights_mm = FlightRecords.from_tlog(log).table("GLOBAL_POSITION_INT", 1)["relative_alt"]
    return bool(len(heights_mm) and heights_mm[-1] > 3000)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
@pytest.mark.sampled(1)
def test_a_signal_leaves_the_vehicle_safe_and_the_run_whole(
    number: signal.Signals, code: int, tmp_path: Path
) -> None:
    with started(tmp_path / "run", *LONG) as run:
        wait_until(lambda: flies(run.log))
        run.process.send_signal(number)
        said = run.finish(code)
        assert said.count("\nflightstack: ") == 2  # after the phases
        assert "interrupted; the log is in" in said
        assert "vehicle 1: was commanded to return and does; it is in Return at" in said
        assert run.summary["outcome"] == "interrupted"
        assert run.summary["vehicles"][0]["left"]["commanded"] == RETURNED


@pytest.mark.slow
def test_a_terminal_that_is_closed_does_so_too(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    log = folder / "flight.tlog"
    with at_terminal("-m", "missions", "fly", *LONG, "--out", str(folder)) as terminal:
        wait_until(lambda: flies(log))
        terminal.close()
        assert terminal.wait_for_end() == 128 + signal.SIGHUP
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["outcome"] == "interrupted"
    assert summary["vehicles"][0]["left"]["commanded"] == RETURNED
