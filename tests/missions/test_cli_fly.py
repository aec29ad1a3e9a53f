"""`flightstack fly`: options, and what it says of missions that are not right."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from missions.cli_fly import fly
from missions.pattern_command import ratio_of


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
