"""`flightstack fly`: options, and what it says of missions that are not right."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import click
import pytest
from click.testing import CliRunner

from autopilot_bridge.clock import Clock
from missions.base.report import Report
from missions.base.request import RunRequest
from missions.cli.bodies.fly import flight_of
from missions.cli.bodies.fly_report import Pace, print_result
from missions.cli.declared_options import FlightOption
from missions.cli.fly import fly
from missions.errors import PlanError
from missions.flown.run_folder import wind_words
from missions.library import MISSIONS
from missions.runs.results import title as run_title
from missions.runs.session import Flight, RunResult
from missions.vehicle.vehicle import Vehicle


@pytest.mark.parametrize(
    "option",
    [
        ["--seed", "3"],
        ["--wind", "5"],
        ["--autopilot", "px4"],
        ["--model", "iris"],
        ["--home", "47,8,400"],
        ["--turbulence", "light"],
        ["--gps", "standalone"],
        ["--speedup", "2"],
    ],
    ids=lambda option: option[0],
)
def test_options_of_the_embedded_sitl_are_refused_with_a_vehicle_elsewhere(option: list[str]) -> None:
    result = CliRunner().invoke(fly, ["lissajous", "--connect", "udpin:127.0.0.1:0", *option])
    assert result.exit_code == 2
    assert f"{option[0]}: of the embedded SITL only" in result.output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["lissajous", "--model", ","], "--model ',' has a place without a name"),
        (["lissajous", "--model", "iris,", "--vehicles", "2"], "--model 'iris,' has a place without a name"),
        (["lissajous", "--model", ""], "--model '' has a place without a name"),
        (["lissajous", "--system-id", "2"], "1 --system-id for 0 --connect"),
        (
            ["lissajous", "--connect", "udpin:127.0.0.1:0", "--system-id", "2", "--system-id", "3"],
            "2 --system-id for 1 --connect",
        ),
        (["lissajous", "--connect", "udpin:127.0.0.1:0", "--system-id", "0"], "--system-id"),
        (["lissajous", "--vehicles", "2", "--separation", "1"], "layers of 1 m are too thin"),
        (["lissajous", "--max-error", "0"], "--max-error 0 is not possible"),
        (["own.py", "--pattern", "L2"], "--pattern is for lissajous, not for own.py"),
        (["sector", "--pattern", "L2"], "--pattern is for lissajous, not for sector"),
        (["sector", "--ratio", "3:4"], "--ratio is for lissajous, not for sector"),
        (["sector", "--spacing", "5"], ", not for sector"),
        (["lissajous", "--heading", "5"], ", not for lissajous"),
        (["expanding-square", "--phase", "5"], "--phase is for lissajous, not for expanding-square"),
        (["orbit", "--pattern", "L2"], "--pattern is for lissajous, not for orbit"),
        (["lissajous", "--arg", "a=1"], "--arg is for a mission of your own, not for lissajous"),
        (["own.py", "--arg", "a"], "--arg 'a' is not NAME=VALUE"),
        (["orbit", "--then", "land"], "--then is for a mission file, not for orbit"),
        (["lissajous", "--ratio", "3:4", "--pattern", "L2"], "--pattern: has no effect beside --ratio"),
        (["sector", "--size", "80", "--amplitude-x", "20"], "--size: has no effect beside --amplitude-x"),
        (
            ["lissajous", "--search-time", "90", "--periods", "2"],
            "--periods: has no effect beside --search-time",
        ),
        (
            ["lissajous", "--via", "setpoints", "--period", "90", "--speed", "4"],
            "--speed: has no effect beside --period",
        ),
        (
            ["occupancy", "--connect", "udpin:127.0.0.1:0", "--map", "m.npz", "--amplitude", "20"],
            "--amplitude: of the embedded SITL only",
        ),
        (
            ["orbit", "--connect", "udpin:127.0.0.1:0", "--target-motion", "circle"],
            "--target-motion: of the embedded SITL only",
        ),
        (["lissajous", "--check", "--yes"], "--yes, --check: for vehicles elsewhere"),
        (
            ["occupancy", "--class", "sub:gaussian:30:80:60"],
            "--class: has no effect with --identify threshold; give --identify trace or --identify bayes, or",
        ),
        (
            ["occupancy", "--identify", "bayes", "--confirmations", "3"],
            "--confirmations: has no effect with --identify bayes; give --identify threshold, or",
        ),
        (["occupancy", "--depth", "5"], "--depth: has no effect without --moment; give --moment, or leave"),
        (["occupancy", "--moment", "1e5", "--sigma", "9"], "--sigma: has no effect beside --moment"),
        (["occupancy", "--moment", "1e5", "--depth", "-90"], "--depth -90 m puts the target 90 m above home"),
        (
            ["occupancy", "--identify", "trace", "--class", "sub:dipole:15:50:150", "--false-class", "none"],
            "--identify trace: no class that is sought (sub) is Gaussian",
        ),
        (["occupancy", "--identify", "bayes", "--class", "a:gaussian:1e308:8:6"], "sizes of 0.001 to 1e+06"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    arguments: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("own.py").write_text("async def fly(vehicle, options):\n    pass\n")
    result = CliRunner().invoke(fly, arguments)
    assert result.exit_code == 2, result.output
    assert words in " ".join(result.output.split())
    assert {path.name for path in tmp_path.iterdir()} <= {"own.py", "__pycache__"}


def test_help_of_a_mission_of_ones_own_has_no_options_of_patterns() -> None:
    text = CliRunner().invoke(fly, ["own.py", "--help"]).output
    for option in ("--altitude", "--speed", "--rate", "--separation", "--arg", "--seed"):
        assert option in text
    for option in ("--pattern", "--size", "--ratio", "--periods", "--via", "--acceptance"):
        assert option not in text


def test_help_lists_options_under_headings() -> None:
    text = CliRunner().invoke(fly, ["lissajous", "--help"]).output
    headings = ["The mission's own:", "Vehicles:", "The embedded SITL:", "The flight:", "Results:"]
    places = [text.index(heading) for heading in headings]
    assert places == sorted(places)
    assert places[0] < text.index("--pattern") < places[1] < text.index("--connect") < places[2]
    assert places[2] < text.index("--seed") < places[3] < text.index("--on-failure") < places[4]


def test_each_option_of_a_flight_is_under_a_heading() -> None:
    loose = [p.name for p in fly.params if isinstance(p, click.Option) and not isinstance(p, FlightOption)]
    assert not loose


def test_the_pace_on_a_link_is_that_of_the_vehicle_since_it_was_received() -> None:
    pace = Pace()
    reported = [
        pace.factor(wall_s, 0.5 * wall_s) for wall_s in (0.0, 0.3)
    ]  # nothing received: this machine's time
    assert reported == [None, None]
    # the vehicle reports that it booted an hour ago: elapsed time begins anew
    reported = [pace.factor(0.5 + wall_s, 0.01 + 2.0 * wall_s) for wall_s in (0.0, 0.2, 0.6, 10.0)]
    assert reported[:2] == [None, None]
    assert reported[2:] == [pytest.approx(2.0), pytest.approx(2.0)]
    late = [pace.factor(10.5 + wall_s, 20.0 + 5.0 * wall_s) for wall_s in (0.0, 2.0, 4.0, 6.0, 8.0)]
    assert late[-1] == pytest.approx(5.0)  # of the last seconds, not of the whole flight


def test_a_run_on_a_link_counts_from_the_first_heartbeat() -> None:
    flight = Flight()
    flight.elsewhere = True
    assert flight.elapsed_s == 0.0
    flight.clock = cast(Clock, SimpleNamespace(time_us=3_605_000_000))
    flight.vehicles = [cast(Vehicle, SimpleNamespace(link=SimpleNamespace(first_heartbeat_us=3_600_000_000)))]
    assert flight.elapsed_s == 5.0


@pytest.mark.parametrize(
    ("speed_m_s", "profile", "turbulence", "words"),
    [
        (0.0, "log", "none", "still air"),
        (6.0, "uniform", "none", "wind 6 m/s from 270 degrees"),
        (6.0, "log", "moderate", "wind 6 m/s from 270 degrees at 10 m, log profile, moderate turbulence"),
        (0.0, "log", "light", "no steady wind, light turbulence"),
    ],
)
def test_the_wind_in_words(speed_m_s: float, profile: str, turbulence: str, words: str) -> None:
    wind = {"speed_m_s": speed_m_s, "from_deg": 270.0, "profile": profile, "turbulence": turbulence}
    assert wind_words(wind) == words


@pytest.mark.parametrize(
    ("arguments", "planned_m_s"),
    [
        (["orbit"], 5.0),  # the default wind there is not looked at
        (["orbit", "--wind", "8@270", "--wind-profile", "uniform"], 8.0),  # the user's word
        (["orbit", "--wind", "8@270", "--expect-wind", "3"], 3.0),
        (["orbit", "--connect", "udpin:127.0.0.1:0"], 5.0),
        (["orbit", "--connect", "udpin:127.0.0.1:0", "--expect-wind", "3"], 3.0),
        (["orbit", "--expect-wind", "0"], 0.0),
    ],
)
def test_turns_are_planned_for_the_wind_the_user_expects(
    arguments: list[str], planned_m_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    requested = []

    def refuse(_mission: object, request: RunRequest, _on_progress: object) -> None:
        requested.append(request)
        raise PlanError("enough")

    monkeypatch.setattr("missions.cli.bodies.fly.fly_mission", refuse)
    assert CliRunner().invoke(fly, arguments).exit_code == 2
    assert [request.planning_wind_m_s for request in requested] == [planned_m_s]


@pytest.mark.parametrize(
    ("text", "ratio"), [("3:4", (3.0, 4.0)), ("1.4", (1.4, 1.0)), ("2/3", (2.0, 3.0)), ("5,6", (5.0, 6.0))]
)
def test_ratios(text: str, ratio: tuple[float, float]) -> None:
    context = fly.make_context("fly", ["lissajous", "--ratio", text])
    assert flight_of(context)[1].options.ratio == ratio  # type: ignore[attr-defined]


@pytest.mark.parametrize("text", ["0:0", "1:0", "-1:2", "0", "x:y", ""])
def test_ratios_that_are_none(text: str) -> None:
    result = CliRunner().invoke(fly, ["lissajous", "--ratio", text])
    assert result.exit_code == 2
    assert "--ratio" in result.output


def test_a_log_is_no_vehicle(tmp_path: Path) -> None:
    result = CliRunner().invoke(
        fly, ["lissajous", "--connect", str(tmp_path / "a.tlog"), "--out", str(tmp_path / "run")]
    )
    assert result.exit_code == 2
    assert "a log can't be flown" in result.output
    assert not (tmp_path / "run").exists()


def test_a_mission_that_ends_in_the_air_has_failed(tmp_path: Path) -> None:
    script = tmp_path / "up.py"
    script.write_text(
        "async def fly(vehicle, options):\n    await vehicle.arm()\n    await vehicle.takeoff(6.0)\n"
    )
    out = tmp_path / "run"
    result = CliRunner().invoke(fly, [str(script), "--out", str(out), "--no-picture"], standalone_mode=False)
    assert result.return_value == 1
    summary = json.loads((out / "summary.json").read_text())
    assert summary["outcome"] == "failed"
    assert "the mission ended with the vehicle armed" in summary["reason"]
    assert "was commanded to return and does" in summary["vehicles"][0]["left"]["text"]


def test_an_error_in_a_mission_names_its_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("broken.py").write_text("async def fly(vehicle, options):\n    await vehicle.arm()\n    nope()\n")
    CliRunner().invoke(fly, ["broken.py", "--out", "run", "--no-picture"], standalone_mode=False)
    assert "line 3: NameError" in json.loads(Path("run/summary.json").read_text())["reason"]


def flown_summary(**more: object) -> dict[str, object]:
    return {
        "mission": "sector",
        "autopilot": "px4",
        "outcome": "completed",
        "distance_m": 466.0,
        "sim_time_s": 139.0,
        "speedup": 1.01,
        "path_rms_error_m": None,
        "vehicles": [],
        **more,
    }


def test_the_wind_that_was_flown_is_in_the_last_lines_and_above_the_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wind = {"speed_m_s": 5.0, "from_deg": 270.0, "profile": "uniform", "turbulence": "light"}
    summary = flown_summary(wind=wind)
    result = RunResult(outcome="completed", reason="", folder=tmp_path, summary=summary)
    assert print_result(result) == 0
    reported = capsys.readouterr().out.splitlines()
    assert reported[0].endswith("139.0 s, 1.01 times real time")
    assert reported[1] == "wind 5 m/s from 270 degrees, light turbulence"
    title = run_title(MISSIONS["sector"], Report(), summary)
    assert title.splitlines()[-1] == "wind 5 m/s from 270 degrees, light turbulence"
    assert "wind" not in run_title(MISSIONS["sector"], Report(), flown_summary())  # elsewhere: not known
