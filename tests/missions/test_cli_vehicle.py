"""`flightstack vehicle`: what it does beside talking to a vehicle."""

import asyncio
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import pytest

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from missions.cli import main as cli
from missions.cli.bodies import vehicle_params as cli_vehicle_params
from missions.cli.bodies.vehicle import DownloadLine, _verdict
from missions.cli.bodies.vehicle_link import confirm


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


def test_where_the_input_is_closed_no_user_can_be_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(
        click.UsageError, match="delete all: not confirmed; there is no terminal to ask on: give --yes"
    ):
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


def test_a_download_shows_how_far_and_how_fast_it_is(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    now_s = [100.0]
    line = DownloadLine(7, 62_000_000, lambda: now_s[0])
    line(float("nan"))
    for passed_s, done in ((0.0, 0.0), (0.1, 0.01), (10.0, 0.05), (100.0, 0.5), (200.0, 1.0)):
        now_s[0] = 100.0 + passed_s
        line(done)
    line.end()
    shown = [text.rstrip() for text in capsys.readouterr().err.split("\r")[1:]]
    assert shown == [
        "log 7:   0 % of 62.0 MB",
        "log 7:   5 % of 62.0 MB, 310 kB/s, 3 min left",
        "log 7:  50 % of 62.0 MB, 310 kB/s, 2 min left",
        "log 7: 100 % of 62.0 MB, 310 kB/s, 0 s left",
    ]


def test_a_download_in_a_pipe_shows_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    line = DownloadLine(7, 62_000_000, lambda: 0.0)
    line(0.5)
    line.end()
    assert capsys.readouterr().err == ""


def test_nothing_else_is_decoded_while_a_log_comes(tmp_path: Path) -> None:
    """MAVSDK would hand us each of some 700,000 messages of a log as text."""
    from missions.vehicle_client.client import VehicleClient
    from missions.vehicle_client.logs import VehicleLogs

    seen = []

    class Client(VehicleClient):
        def __init__(self) -> None:
            self.system_id, self.messages, self.keeping = 1, {}, True

        def start(self) -> None:
            self.keeping = True

        async def stop(self) -> None:
            self.keeping = False

    class Plugin:
        async def download_log_file(self, entry: Any, path: str) -> Any:
            seen.append(client.keeping)
            Path(path).write_bytes(b"ULog\x01\x12\x35" + bytes(9))
            yield None, SimpleNamespace(progress=1.0)

    client = Client()
    shelf = VehicleLogs.__new__(VehicleLogs)
    shelf._client, shelf._system_id, shelf._plugin = client, 1, Plugin()
    entry = SimpleNamespace(id=3, date="", size_bytes=16)
    path = asyncio.run(shelf.download(entry, tmp_path, lambda done: None))
    assert path.name == "log_3_undated.ulg"
    assert seen == [False] and client.keeping
