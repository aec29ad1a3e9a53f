"""Parameter files of real vehicles: what the vehicle has is set, the rest is listed, or refused if strict."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from autopilot_bridge.mavlink import dialect
from missions.cli.fly import fly
from missions.cli.sitl import sitl
from missions.errors import CommandRejected

FILE = "MPC_XY_VEL_MAX 8\nCAL_ACC7_ID 1\nMPC_ACC_HOR 3\nNO_SUCH_NAME 2\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "real.parm"
    path.write_text(FILE)
    return path


def test_sitl_sets_what_it_has_and_lists_the_rest(file: Path) -> None:
    arguments = ["--speedup", "0", "--duration", "0.1", "--link", "udpin:127.0.0.1:0"]
    result = CliRunner().invoke(sitl, [*arguments, "--params", str(file)])
    assert result.exit_code == 0, result.output
    assert (
        "2 parameters are not set, because the vehicle has none of that name: CAL_ACC7_ID, NO_SUCH_NAME"
        in (result.output)
    )
    strict = CliRunner().invoke(sitl, [*arguments, "--params", str(file), "--strict-params"])
    assert strict.exit_code == 2
    assert "no parameter 'CAL_ACC7_ID'" in strict.output


def test_all_values_that_are_not_accepted_are_named_at_once(file: Path) -> None:
    file.write_text("MPC_XY_VEL_MAX -8\nNO_SUCH_NAME 2\nMPC_ACC_HOR 1e9\n")
    result = CliRunner().invoke(sitl, ["--duration", "0.1", "--params", str(file)])
    assert result.exit_code == 2
    assert "--params: MPC_XY_VEL_MAX = -8: accepted is a number in 0..20 m/s; MPC_ACC_HOR = 1e+09" in (
        result.output
    )


def test_fly_sets_what_the_vehicle_has_and_the_summary_lists_the_rest(file: Path, tmp_path: Path) -> None:
    own = tmp_path / "own.py"
    own.write_text(
        "async def fly(vehicle, options):\n    assert await vehicle.parameter('MPC_XY_VEL_MAX') == 8.0\n"
    )
    out = tmp_path / "run"
    arguments = [str(own), "--params", str(file), "--out", str(out), "--no-picture"]
    result = CliRunner().invoke(fly, arguments, standalone_mode=False)
    assert result.return_value == 0, result.output
    summary = json.loads((out / "summary.json").read_text())
    assert summary["parameters"] == {"MPC_XY_VEL_MAX": 8.0, "MPC_ACC_HOR": 3.0}
    assert summary["parameters_left_out"] == ["CAL_ACC7_ID", "NO_SUCH_NAME"]


VALUES = {"MPC_XY_VEL_MAX": 8.0, "CAL_ACC7_ID": 1.0, "WPNAV_SPEED": 900.0, "NO_SUCH_NAME": 2.0}


@pytest.mark.parametrize("lists", [True, False])
def test_a_vehicle_elsewhere_gets_what_it_has(flown, lists) -> None:
    """From its list; where it sends none, or a parameter that it does not list, by requests."""

    async def script(vehicle, autopilot):
        unlisted = "WPNAV_SPEED"

        def send_list(_message):
            names = [name for name in autopilot.parameters if name != unlisted] if lists else []
            for index, name in enumerate(names):
                value, kind = autopilot.parameters[name]
                message = dialect.MAVLink_param_value_message(name.encode(), value, kind, len(names), index)
                autopilot.send(message)

        autopilot.on_param_request_list = send_list
        many = {**VALUES, **{f"NONE_{k}": 0.0 for k in range(8)}}
        left_out = await vehicle.parameters.write_known(many)
        assert left_out == ("CAL_ACC7_ID", "NO_SUCH_NAME", *(f"NONE_{k}" for k in range(8)))
        assert autopilot.parameters["MPC_XY_VEL_MAX"][0] == 8.0
        assert autopilot.parameters["WPNAV_SPEED"][0] == 900.0
        assert await vehicle.parameters.write_known({"NO_SUCH_NAME": 2.0}) == ("NO_SUCH_NAME",)

    flown(script)


def test_values_that_a_vehicle_elsewhere_keeps_are_named_together(flown) -> None:
    async def script(vehicle, autopilot):
        autopilot.on_param_set = lambda m: autopilot.on_param_request_read(
            dialect.MAVLink_param_request_read_message(1, 1, m.param_id.encode(), -1)
        )
        with pytest.raises(CommandRejected, match=r"kept MPC_XY_VEL_MAX = 12 .*; .*kept WPNAV_SPEED = 1000 "):
            await vehicle.parameters.write_known(VALUES)

    flown(script)
