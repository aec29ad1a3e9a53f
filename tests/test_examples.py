"""The files in `examples/` run as a user runs them, and the commands in their first lines parse."""

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

from estimators.logs import open_log
from tests.clients.forked_process import flightstack_done
from tests.documented_commands import commands_in, parse

ROOT: Final = Path(__file__).parents[1]
EXAMPLES: Final = ROOT / "examples"
WORLD: Final = EXAMPLES / "windy_world.toml"
MISSION, ESTIMATOR, AIRCRAFT, ANALYSIS = (
    EXAMPLES / name for name in ("own_mission.py", "own_estimator.py", "own_aircraft.toml", "log_analysis.py")
)


@pytest.mark.parametrize(
    "path", sorted({*EXAMPLES.glob("*.py"), *EXAMPLES.glob("*.toml")}), ids=lambda path: path.name
)
def test_each_shows_its_command(path: Path) -> None:
    commands = commands_in(path.read_text(encoding="utf-8"))
    assert commands
    for line in commands:
        parse(line)


def analysed(log: Path) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, str(ANALYSIS), str(log)], cwd=ROOT, capture_output=True, text=True, check=False
    )


def test_own_mission_with_own_estimator_and_an_analysis_of_its_log(tmp_path: Path) -> None:
    arguments = ("--altitude", "15", "--speed", "4", "--arg", "radius_m=15", "--estimator", str(ESTIMATOR))
    flown = flightstack_done("fly", str(MISSION), *arguments, "--out", str(tmp_path / "run"))
    assert flown.returncode == 0, flown.stderr
    assert re.search(r"spiral flown at 1[45]\.\d m, \d+% battery left", flown.stdout)
    assert re.search(r"climb, vehicle 1: \d+ estimates: alt [01]\.\d+ m RMS off autopilot", flown.stdout)

    analysis = analysed(tmp_path / "run" / "flight.tlog")
    assert analysis.returncode == 0, analysis.stderr
    assert re.search(r"vehicle 1: at most \d+\.\d m above home", analysis.stdout)
    assert re.search(r"altitude estimate: 0\.\d+ m RMS off the truth", analysis.stdout)
    assert re.search(r"attitude, vehicle 1: roll 0\.\d+ deg RMS off the truth", analysis.stdout)


def test_own_mission_refuses_arguments_that_are_not_possible(tmp_path: Path) -> None:
    refused = flightstack_done("fly", str(MISSION), "--arg", "radius_m=1", "--out", str(tmp_path / "run"))
    assert refused.returncode == 2
    assert "ask for 2 <= spacing_m" in refused.stderr


def test_the_analysis_refuses_what_is_no_log(tmp_path: Path) -> None:
    (tmp_path / "empty.tlog").write_bytes(b"")
    done = analysed(tmp_path / "empty.tlog")
    assert done.returncode == 1
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_the_windy_world_is_flown_and_its_options_are_overridden(tmp_path: Path) -> None:
    arguments = ("--world", str(WORLD), "--pattern", "L1", "--seed", "8", "--no-picture")
    flown = flightstack_done("fly", "lissajous", *arguments, "--out", str(tmp_path / "run"))
    assert flown.returncode == 0, flown.stderr
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["vehicle"] == "iris,aerosonde"
    assert summary["gps"] == "standalone,differential"
    assert summary["seed"] == 8
    assert summary["wind"] == {"speed_m_s": 5.0, "from_deg": 240.0, "profile": "log", "turbulence": "light"}
    check_gps_fault(tmp_path / "run" / "flight.tlog")


def check_gps_fault(path: Path) -> None:
    """The quadrotor's GPS is off from 45 s to 48 s, and is reported lost after a second."""
    receiver = open_log(path).table("GPS_RAW_INT", system_id=1, component_id=1)
    time_s = receiver.time_us * 1e-6
    lost_s = time_s[(receiver.columns["fix_type"] < 3) & (time_s > 40.0)]
    assert len(lost_s) > 5
    assert 45.0 < lost_s.min() < lost_s.max() < 48.1


def test_the_windy_world_is_served(tmp_path: Path) -> None:
    arguments = ("--world", str(WORLD), "--speedup", "0", "--duration", "50", "--link", "tcpin:127.0.0.1:0")
    served = flightstack_done("sitl", *arguments, "--log", str(tmp_path / "sitl.tlog"))
    assert served.returncode == 0, served.stderr
    check_gps_fault(tmp_path / "sitl.tlog")


def test_docs_show_the_windy_world() -> None:
    assert WORLD.read_text(encoding="utf-8") in (ROOT / "docs/world.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_own_aircraft_flies(tmp_path: Path) -> None:
    arguments = ("--pattern", "L1", "--model", str(AIRCRAFT))  # a circle, which is the shortest pattern
    flown = flightstack_done("fly", "lissajous", *arguments, "--out", str(tmp_path / "run"))
    assert flown.returncode == 0, flown.stderr
    assert "completed: lissajous" in flown.stdout


@pytest.mark.slow
def test_a_sweep_in_a_small_form(tmp_path: Path) -> None:
    sweep = runpy.run_path(str(EXAMPLES / "sweep.py"), run_name="sweep")
    rows = list(sweep["sweep"]((0.0, 9.0), (1,), tmp_path))
    assert [(row.wind_m_s, row.seed, row.outcome) for row in rows] == [
        (0.0, 1, "completed"),
        (9.0, 1, "completed"),
    ]
    assert rows[0].rms_error_m < rows[1].rms_error_m < rows[1].max_error_m < 5.0
    lines = sweep["table"](rows).splitlines()
    assert len(lines) == 3
    assert lines[2].startswith("     9.0     1  completed ")
    sweep["draw"](rows, tmp_path / "sweep.png")
    assert (tmp_path / "sweep.png").stat().st_size > 5_000
    assert (tmp_path / "wind-9-seed-1" / "flight.tlog").exists()


@pytest.mark.slow
def test_the_notebook_runs(tmp_path: Path) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    notebook = nbformat.read(EXAMPLES / "flight.ipynb", as_version=4)
    nbclient.NotebookClient(
        notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}
    ).execute()
    outputs = [cell["outputs"] for cell in notebook.cells if cell["cell_type"] == "code"]
    assert "<td>completed</td>" in outputs[0][-1]["data"]["text/html"]
    assert re.search(r"roll: 0\.\d\d deg RMS off the truth", outputs[3][0]["text"])
    assert re.fullmatch(r"\[0\.\d+, 0\.\d+\]", outputs[4][-1]["data"]["text/plain"])
    assert "data:image/png;base64," in outputs[5][-1]["data"]["text/html"]
    assert len(list((tmp_path / "runs").iterdir())) == 3


def test_the_notebook_has_no_outputs() -> None:
    cells = json.loads((EXAMPLES / "flight.ipynb").read_text(encoding="utf-8"))["cells"]
    assert [cell for cell in cells if cell.get("outputs")] == []
