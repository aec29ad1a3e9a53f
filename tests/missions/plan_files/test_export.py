"""A mission written to a file while its vehicle flies something else."""

from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import common as mavlink

from flightsim.foundation.geodesy import GeodeticPosition
from missions.cli import main as cli
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.plan_files.files import read_mission_file, write_mission_file
from tests.missions.plan_files.plans import write

CONNECT = ("--connect", "udpin:127.0.0.1:1")
ASKING = {mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAV_CMD_REQUEST_MESSAGE}


@pytest.fixture
def flying(elsewhere: Any) -> Any:
    """A vehicle on its way to somewhere, without us."""
    elsewhere.armed = True
    elsewhere.pos = [10.0, 5.0, -20.0]
    elsewhere.target = (400.0, 0.0, -20.0)
    return elsewhere


def state(vehicle: Any) -> tuple[Any, ...]:
    return vehicle.armed, vehicle.mode, vehicle.target, vehicle.items, dict(vehicle.parameters)


@pytest.mark.parametrize("option", [["--yes"], ["--check"], ["--max-error", "1"]])
def test_a_vehicle_that_flies_flies_on(
    flying: Any, option: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = state(flying)
    path = tmp_path / "x.plan"
    code = cli.run_command_line(["fly", "lissajous", *CONNECT, "--export-plan", str(path), *option])
    said = capsys.readouterr()
    assert (code, said.err) == (0, "")
    assert said.out == f"{len(read_mission_file(path).items)} items: {path}\n"
    assert state(flying) == before
    assert {command for command, _ in flying.commands} <= ASKING


def test_a_file_that_can_not_be_made_changes_nothing_either(
    flying: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flying.parameters["MPC_XY_VEL_MAX"] = (2.0, 9)
    before = state(flying)
    code = cli.run_command_line(
        ["fly", "lissajous", *CONNECT, "--speed", "4", "--export-plan", str(tmp_path / "x.plan")]
    )
    assert code == 1
    assert "speed 4 m/s" in capsys.readouterr().err
    assert state(flying) == before
    assert {command for command, _ in flying.commands} <= ASKING
    assert list(tmp_path.iterdir()) == []


def test_parameters_are_not_set_for_a_file(
    flying: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = state(flying)
    (tmp_path / "p.parm").write_text("MPC_ACC_HOR 5\n")
    code = cli.run_command_line(
        [
            *("fly", "lissajous", *CONNECT, "--params", str(tmp_path / "p.parm")),
            *("--export-plan", str(tmp_path / "x.plan")),
        ]
    )
    said = capsys.readouterr().err
    assert code == 2
    assert "leave --params out" in said and len(said.splitlines()) == 1
    assert state(flying) == before
    assert not (tmp_path / "x.plan").exists()


@pytest.mark.parametrize("name", ["x.plan", "x.waypoints"])
def test_half_a_file_does_not_stay_on_a_full_disk(name: str, tmp_path: Path, little_room: Any) -> None:
    items = read_mission_file(write(tmp_path)).items
    path = tmp_path / "there" / name
    path.parent.mkdir()
    home = GeodeticPosition(lat_deg=47.0, lon_deg=8.0, alt_m=400.0)
    about: dict[str, Any] = {"firmware": "px4", "kind": VehicleKind.MULTICOPTER, "speed_m_s": 5.0}
    with little_room(100), pytest.raises(PlanError, match=f"can't write .*{name}: File too large"):
        write_mission_file(path, items, home, **about)
    assert list(path.parent.iterdir()) == []
    write_mission_file(path, items, home, **about)
    assert len(read_mission_file(path).items) == len(items)
    with pytest.raises(PlanError, match="is there already"):
        write_mission_file(path, items, home, **about)
