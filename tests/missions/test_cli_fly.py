"""`flightstack fly`: options, and what it says of missions that are not right."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from missions.cli_fly import fly
from missions.errors import PlanError
from missions.pattern_command import ratio_of
from missions.request import RunRequest


@pytest.mark.parametrize(
    "option",
    [
        ["--seed", "3"],
        ["--wind", "5"],
        ["--autopilot", "px4"],
        ["--model", "iris"],
        ["--home", "47,8,400"],
        ["--turbulence", "light"],
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
        (
            ["own.py", "--pattern", "L2"],
            "--pattern is for lissajous, sector",
        ),
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
    assert [path.name for path in tmp_path.iterdir()] == ["own.py"]


def test_help_of_a_mission_of_ones_own_has_no_options_of_patterns() -> None:
    text = CliRunner().invoke(fly, ["own.py", "--help"]).output
    for option in ("--altitude", "--speed", "--rate", "--separation", "--arg", "--seed"):
        assert option in text
    for option in ("--pattern", "--size", "--ratio", "--periods", "--via", "--acceptance"):
        assert option not in text


@pytest.mark.parametrize(
    ("arguments", "planned_m_s"),
    [
        (["orbit"], 5.0),  # what blows there unless somebody asks for it is not looked at
        (["orbit", "--wind", "8@270"], 8.0),  # the user's word
        (["orbit", "--wind", "8@270", "--expect-wind", "3"], 3.0),
        (["orbit", "--connect", "udpin:127.0.0.1:0"], 5.0),
        (["orbit", "--connect", "udpin:127.0.0.1:0", "--expect-wind", "3"], 3.0),
        (["orbit", "--expect-wind", "0"], 0.0),
    ],
)
def test_turns_are_planned_for_the_wind_the_user_expects(
    arguments: list[str], planned_m_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def refuse(_mission: object, request: RunRequest, _on_progress: object) -> None:
        asked.append(request)
        raise PlanError("enough")

    monkeypatch.setattr("missions.session.fly", refuse)
    assert CliRunner().invoke(fly, arguments).exit_code == 2
    assert [request.planning_wind_m_s for request in asked] == [planned_m_s]


@pytest.mark.parametrize(
    ("text", "ratio"), [("3:4", (3.0, 4.0)), ("1.4", (1.4, 1.0)), ("2/3", (2.0, 3.0)), ("5,6", (5.0, 6.0))]
)
def test_ratios(text: str, ratio: tuple[float, float]) -> None:
    assert ratio_of(text) == ratio


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
    assert "told to return" in summary["reason"]


def test_an_error_in_a_mission_names_its_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("broken.py").write_text("async def fly(vehicle, options):\n    await vehicle.arm()\n    nope()\n")
    CliRunner().invoke(fly, ["broken.py", "--out", "run", "--no-picture"], standalone_mode=False)
    assert "line 3: NameError" in json.loads(Path("run/summary.json").read_text())["reason"]
