"""`flightstack vehicle`: what it does beside talking to a vehicle."""

import asyncio
import sys
from pathlib import Path
from typing import Any

import click
import pytest

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from missions import cli, cli_vehicle_params
from missions.cli_vehicle import _verdict
from missions.cli_vehicle_link import confirm


def test_half_a_parameter_file_does_not_stay_on_a_full_disk(
    tmp_path: Path, little_room: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = "".join(f"PARAMETER_{k} {k}\n" for k in range(100))
    monkeypatch.setattr(cli_vehicle_params, "with_client", lambda given, work: (100, text))
    path = tmp_path / "a.parm"
    words = ["vehicle", "params", "save", str(path), "--connect", "udpin:127.0.0.1:1"]
    with little_room(500):
        code = cli.run_command_line(words)
    said = capsys.readouterr()
    assert (code, said.out) == (2, "")
    assert said.err == f"flightstack: can't write {path}: File too large; check the folder\n"
    assert list(tmp_path.iterdir()) == []
    assert cli.run_command_line(words) == 0
    assert path.read_text() == text
    assert cli.run_command_line(words) == 2
    assert "nothing is overwritten" in capsys.readouterr().err


def test_where_the_input_is_closed_nobody_can_be_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(click.UsageError, match="delete all: not confirmed; give --yes"):
        asyncio.run(confirm("delete all", False))
    asyncio.run(confirm("delete all", True))


@pytest.mark.parametrize(
    ("problems", "would_arm", "words"),
    [
        (0, True, "it would arm; no problems"),
        (1, True, "1 problem: don't fly it so, although its own pre-arm checks are passed"),
        (2, False, "it would not arm; 2 problems"),
    ],
)
def test_the_doctor_s_verdict_does_not_contradict_itself(problems: int, would_arm: bool, words: str) -> None:
    assert _verdict(problems, would_arm=would_arm) == words


def test_rounding_of_a_table_of_defaults_is_no_difference() -> None:
    parameters = pytest.importorskip(
        "missions.vehicle_client.parameters", reason="the MAVSDK client library is not installed"
    )
    vehicle = {
        name: parameters.Value(number=number, type=kind)
        for name, number, kind in (
            ("COMPASS_DEC", 0.22335722, 9),
            ("INS_GYROFFS_X", 2.1559314e-05, 9),
            ("OTHER", 0.22336, 9),
            ("WHOLE", 1_000_001, 6),
        )
    }
    table = {"COMPASS_DEC": 0.223357, "INS_GYROFFS_X": 2.15593e-05, "OTHER": 0.223357, "WHOLE": 1_000_000.0}
    found = parameters.differences(vehicle, table, rounded=True)
    assert [difference.name for difference in found] == ["OTHER", "WHOLE"]
    assert len(parameters.differences(vehicle, table)) == 4  # a file has all digits
