"""The script that flies the mission set on real firmware: what it flies, its rows and its table.

Where a build is named (FLIGHTSTACK_PX4, FLIGHTSTACK_ARDUCOPTER, FLIGHTSTACK_ARDUPLANE), a slow test flies one
mission on it.
"""

import json
from dataclasses import asdict
from pathlib import Path

import pytest

from benchmarks.firmware import FIRMWARES, VEHICLES, Firmware, FirmwareMissing
from benchmarks.firmware_cases import CASES
from benchmarks.firmware_missions import main, parser
from benchmarks.firmware_table import EMULATED, Session, row_of, rows_in, sessions, table
from missions.plan_files.wpl import read_wpl

PLANE = ("px4", "plane")


def summary_in(folder: Path, **values: object) -> Path:
    """A run folder with a summary."""
    folder.mkdir(parents=True)
    block = {"waypoints": {"passed": 19, "count": 20}}
    whole = {"outcome": "completed", "reason": "", "distance_m": 900.0, "vehicles": [block], **values}
    (folder / "summary.json").write_text(json.dumps(whole))
    return folder


def session(mission: str = "sector", speed: float = 1.0) -> Session:
    return Session(firmware="px4", vehicle="plane", speed=speed, mission=mission)


def test_each_vehicle_flies_its_missions_and_the_long_ones_first() -> None:
    wanted = sessions([PLANE, ("ardupilot", "copter")], [5.0, 1.0, EMULATED], ["sector", "orbit"])
    assert [(s.vehicle, s.speed, s.mission) for s in wanted] == [
        ("plane", 1.0, "sector"),
        ("plane", 1.0, "orbit"),
        ("copter", 1.0, "sector"),
        ("copter", 1.0, "orbit"),
        ("plane", 5.0, "sector"),
        ("plane", 5.0, "orbit"),
        ("copter", 5.0, "sector"),
        ("copter", 5.0, "orbit"),
        ("plane", EMULATED, "sector"),
        ("copter", EMULATED, "sector"),
    ]
    assert not [s for s in sessions([("px4", "copter")], [1.0], CASES) if s.mission.endswith("-setpoints")][
        1:
    ]


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize("vehicle", VEHICLES)
def test_the_plan_file_changes_speed_between_waypoints_and_comes_down(
    firmware: str, vehicle: str, tmp_path: Path
) -> None:
    [file] = CASES["plan-file"].arguments_on(firmware, vehicle, tmp_path)
    document = read_wpl(Path(file))
    commands = [item.command for item in document.items]
    assert commands[:4] == [22, 178, 16, 178]
    assert document.lands


@pytest.mark.parametrize(
    ("mission", "exit_code", "values", "outcome", "well"),
    [
        ("sector", 0, {}, "completed", True),
        ("sector", 1, {"outcome": "failed", "reason": "lost"}, "failed", False),
        ("sector", 1, {"outcome": "failed", "reason": "not ready", "distance_m": 0.2}, "refused", False),
        ("sector", None, {"outcome": "interrupted"}, "timeout", False),
        ("orbit", 1, {"outcome": "failed", "reason": "no camera", "distance_m": None}, "refused", True),
        ("orbit", 1, {"outcome": "failed", "reason": "no camera"}, "failed", False),
        ("orbit", 0, {}, "completed", False),
    ],
)
def test_a_row_tells_how_a_flight_ended(
    mission: str, exit_code: int | None, values: dict[str, object], outcome: str, well: bool, tmp_path: Path
) -> None:
    folder = summary_in(tmp_path / "run", **values)
    row = row_of(session(mission), 1, folder, exit_code, "", 10.0)
    assert (row.outcome, row.well) == (outcome, well)
    assert (row.waypoints_passed, row.waypoints) == (19, 20)


def test_a_flight_without_a_run_has_the_reason_that_was_printed(tmp_path: Path) -> None:
    row = row_of(session(), 1, tmp_path / "none", 2, "Error: --size 4 is too small\n", 1.0)
    assert (row.outcome, row.well, row.reason) == ("refused", False, "Error: --size 4 is too small")


def test_the_table_has_a_line_for_each_session_beside_the_emulator(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flown = summary_in(tmp_path / "run", path_rms_error_m=2.5, path_max_error_m=6.25)
    rows = [row_of(session(), flight, flown, 0, "", 100.0) for flight in (1, 2)]
    rows.append(row_of(session(speed=EMULATED), 1, flown, 0, "", 9.0))
    rows.append(row_of(session("script"), 1, tmp_path / "none", 1, "it fell down", 1.0))
    file = tmp_path / "rows.jsonl"
    lines = [json.dumps(asdict(row)) for row in rows]
    file.write_text("\n".join([*lines, lines[0][:40]]))  # the last one was cut off
    assert rows_in(file) == {row.key: row for row in rows}
    text = table(rows_in(file))
    cell = "completed, exit 0, 2.50 / 6.25 m, 19 of 20"
    assert f"| px4 | plane | 1 | sector | {cell} | {cell} | {cell} |" in text
    assert "| px4 | plane | 1 | script | **refused**, exit 1 |  |  |" in text
    assert "4 flights, 1 not as expected." in text
    assert "it fell down" in text
    assert main(["--out", str(tmp_path), "--table"]) == 1
    assert capsys.readouterr().out == text


@pytest.mark.parametrize("wrong", [["--jobs", "11"], ["--speed", "fast"], ["--mission", "walk"], []])
def test_wrong_options_are_refused(wrong: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    out = ["--out", "x"] if wrong else []
    with pytest.raises(SystemExit) as ended:
        parser().parse_args([*out, *wrong])
    assert ended.value.code == 2
    assert (wrong or ["--out"])[-1] in capsys.readouterr().err


def test_a_build_that_is_missing_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("FLIGHTSTACK_PX4", "FLIGHTSTACK_ARDUCOPTER", "FLIGHTSTACK_ARDUPLANE"):
        monkeypatch.delenv(name, raising=False)
    assert main(["--out", str(tmp_path / "out"), "--px4", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert str(tmp_path / "bin" / "px4") in said
    assert "set FLIGHTSTACK_ARDUPLANE" in said
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("firmware", FIRMWARES)
def test_a_mission_is_flown_twice_on_real_firmware(firmware: str, vehicle: str, tmp_path: Path) -> None:
    try:
        Firmware.find(firmware, vehicle)
    except FirmwareMissing as missing:
        pytest.skip(str(missing))
    chosen = ["--firmware", firmware, "--vehicle", vehicle, "--mission", "parallel-sweep", "--speed", "2"]
    assert main(["--out", str(tmp_path), *chosen, "--no-emulator"]) == 0
