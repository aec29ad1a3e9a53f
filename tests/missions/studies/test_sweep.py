"""`flightstack study sweep`: the flights are those of `flightstack fly`, parsed by it."""

import json
import shlex
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from missions.cli.bodies.sweep import sweep_study
from missions.cli.main import run_command_line
from missions.studies.study import Trials

HOP = """
async def fly(vehicle, options):
    await vehicle.arm()
    await vehicle.takeoff(options.altitude_m)
    if options.arguments.get("fail") == "yes":
        raise ValueError("a bird")
    await vehicle.land()
"""


def commands(
    *vary: str, mission: str = "lissajous", words: tuple[str, ...] = (), sampling: str = "random"
) -> list[str]:
    """The commands of the first run."""
    study = sweep_study(mission, vary, words, sampling="random")
    trials = Trials(study, 1, 7)
    assert study.command is not None
    return [study.command(trials[k].values, trials[k].seed) for k in range(len(trials))]


def test_each_trial_is_a_command_of_fly() -> None:
    assert commands("wind-speed=0,4.5", "pattern=L1,L2", words=("--via", "setpoints")) == [
        "flightstack fly lissajous --via setpoints --wind 0 --pattern L1 --seed 7000000",
        "flightstack fly lissajous --via setpoints --wind 0 --pattern L2 --seed 7000000",
        "flightstack fly lissajous --via setpoints --wind 4.5 --pattern L1 --seed 7000000",
        "flightstack fly lissajous --via setpoints --wind 4.5 --pattern L2 --seed 7000000",
    ]


def test_parts_of_the_wind_keep_the_other_part() -> None:
    assert commands("wind-speed=4", words=("--wind", "9@270")) == [
        "flightstack fly lissajous --wind 4@270 --seed 7000000"
    ]
    assert commands("wind-from=90", mission="orbit")[0] == (
        "flightstack fly orbit --wind 4@90 --seed 7000000"  # the wind of the mission's own world
    )


def test_switches_and_values_with_commas() -> None:
    assert commands("no-gps-fault=no,yes", mission="orbit") == [
        "flightstack fly orbit --seed 7000000",
        "flightstack fly orbit --no-gps-fault --seed 7000000",
    ]
    assert commands("phase=0,90;0,0") == [
        "flightstack fly lissajous --phase 0,90 --seed 7000000",
        "flightstack fly lissajous --phase 0,0 --seed 7000000",
    ]


def test_a_range_is_drawn_for_each_run() -> None:
    study = sweep_study("lissajous", ["speed=3..8", "pattern=L1,L2"], [], sampling="latin-hypercube")
    trials = Trials(study, 5, 0)
    speeds = {trials[k].run: trials[k].values["speed"] for k in range(10)}
    assert sorted(int(float(speed) - 3.0) for speed in speeds.values()) == [0, 1, 2, 3, 4]
    assert all(trials[k].values["speed"] == speeds[trials[k].run] for k in range(10))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "sweep needs a MISSION"),
        (["nothing"], "mission 'nothing' is not known; there are lissajous"),
        (["lissajous", "--via", "setpoints"], "options of the mission follow after --"),
        (["lissajous", "--vary", "wind-sped=1"], "has no such option; did you mean wind-speed"),
        (["lissajous", "--vary", "pattern"], "is not NAME=VALUE"),
        (["lissajous", "--vary", "pattern=L1,"], "has a place without a value"),
        (["lissajous", "--vary", "pattern=L1,L9"], "L9"),
        (["lissajous", "--vary", "speed=-3,2"], "--speed -3"),
        (["lissajous", "--vary", "speed=abc"], "--speed"),
        (["lissajous", "--vary", "seed=1,2"], "the study gives each trial its seed"),
        (["lissajous", "--vary", "connect=a"], "--connect: a sweep flies embedded vehicles only"),
        (["lissajous", "--vary", "speed=1,2", "--vary", "speed=3"], "names an option twice"),
        (["lissajous", "--vary", "speed=8..3"], "is not a range"),
        (["orbit", "--vary", "no-gps-fault=perhaps"], "is not yes or no"),
        (["lissajous", "--", "--out", "x"], "--out: the study has the folder"),
        (["lissajous", "--", "--yes"], "--yes"),
        (["lissajous", "--", "--no-gps-fault"], "--no-gps-fault is for orbit, handoff, not for lissajous"),
        (["none.py"], "mission file none.py does not exist"),
    ],
)
def test_wrong_sweeps_are_usage_errors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    out = ["--out", str(tmp_path / "run")]
    line = [*arguments[:1], *out, *arguments[1:]] if arguments else out
    assert run_command_line(["study", "sweep", *line]) == 2
    err = capsys.readouterr().err
    assert words in err and err.count("\n") == 1
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_a_row_names_the_command_that_flies_the_same_flight(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mission = tmp_path / "hop.py"
    mission.write_text(HOP)
    out = tmp_path / "sweep"
    line = ["study", "sweep", str(mission), "--vary", "altitude=3,5", "--vary", "arg=fail=no;fail=yes"]
    line += ["--runs", "1", "--seed", "3", "--workers", "1", "--keep-logs", "all", "--out", str(out)]
    assert run_command_line([*line, "--", "--wind", "2@90"]) == 0  # a flight that fails is a result
    assert capsys.readouterr().err == ""
    rows = pq.read_table(out / "rows.parquet").to_pylist()
    assert [(row["altitude"], row["completed"]) for row in rows] == [
        (3, True),
        (3, False),
        (5, True),
        (5, False),
    ]
    assert "hop.py, line 6: ValueError: a bird" in rows[1]["reason"]
    assert len({row["seed"] for row in rows}) == 1
    flown = tmp_path / "again"
    assert run_command_line([*shlex.split(rows[2]["command"])[1:], "--no-picture", "--out", str(flown)]) == 0
    log = (out / "logs" / "trial-000002" / "flight.tlog").read_bytes()
    assert len(log) > 10_000 and (flown / "flight.tlog").read_bytes() == log
    summary = json.loads((flown / "summary.json").read_text())
    assert summary["distance_m"] == rows[2]["distance_m"]
