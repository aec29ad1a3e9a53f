"""`flightstack vehicle`: what it does beside talking to a vehicle."""

import asyncio
import sys
from pathlib import Path
from typing import Any

import click
import pytest

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from missions import cli, cli_vehicle_params
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
