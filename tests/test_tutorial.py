"""`docs/tutorial.md` as a student works through it: its files are saved, its commands run in their order."""

import contextlib
import json
import re
import shlex
import signal
import socket
from pathlib import Path
from typing import Final

import pytest

from tests.clients.forked_process import flightstack, flightstack_done
from tests.documented_commands import commands_in

pytestmark = pytest.mark.slow

TUTORIAL: Final = (Path(__file__).parents[1] / "docs" / "tutorial.md").read_text(encoding="utf-8")
PORT: Final = "5790"


def run(line: str) -> str:
    done = flightstack_done(*shlex.split(line)[1:])
    assert done.returncode == 0, (line, done.stderr)
    assert isinstance(done.stdout, str)
    return done.stdout


def free_port() -> str:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return str(server.getsockname()[1])


def on_a_link(serve: str, fly: str) -> str:
    server = flightstack(*shlex.split(serve)[1:], merged=True)
    try:
        next(line for line in server.stdout if "tcpin" in line)
        return run(fly)
    finally:
        server.send_signal(signal.SIGINT)
        server.communicate(timeout=60.0)


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """The student's folder at the end, and what each command printed."""
    folder = tmp_path_factory.mktemp("tutorial")
    for name, text in re.findall(r"Save this as `(\S+)`:\n\n```python\n(.*?)```", TUTORIAL, re.DOTALL):
        (folder / name).write_text(text, encoding="utf-8")
    port = free_port()
    lines = [line.replace(PORT, port) for line in commands_in(TUTORIAL)]
    *alone, serve, fly = lines
    assert "sitl" in serve
    with contextlib.chdir(folder):
        outputs = {line: run(line) for line in alone}
        outputs[fly] = on_a_link(serve, fly)
    return folder, outputs


def output(printed: tuple[Path, dict[str, str]], name: str) -> str:
    """What the command with this run folder printed."""
    (text,) = (text for line, text in printed[1].items() if line.endswith(f"--out {name}"))
    return text


def test_flights_are_completed(printed: tuple[Path, dict[str, str]]) -> None:
    for name in ("first", "square", "windy", "together", "linked"):
        assert "completed: " in output(printed, name)
        summary = json.loads((printed[0] / name / "summary.json").read_text(encoding="utf-8"))
        assert summary["outcome"] == "completed"
        assert (printed[0] / name / "track.png").stat().st_size > 10_000


def test_the_mission_reports_its_corners(printed: tuple[Path, dict[str, str]]) -> None:
    assert output(printed, "square").count("at 30 m north") == 2
    assert output(printed, "windy").count("at 20 m north") == 2


def test_a_longer_time_constant_has_larger_errors(printed: tuple[Path, dict[str, str]]) -> None:
    errors_m = [
        float(found[1])
        for name in ("filtered", "slower")
        if (found := re.search(r"truth +alt +\d+ +\S+ m +(\S+) m", output(printed, name)))
    ]
    assert len(errors_m) == 2
    assert errors_m[1] > 2.0 * errors_m[0]


def test_the_table_has_the_exported_message(printed: tuple[Path, dict[str, str]]) -> None:
    (table,) = (printed[0] / "tables").glob("*ATTITUDE*.csv")
    header, *rows = table.read_text(encoding="utf-8").splitlines()
    assert "roll" in header
    assert len(rows) > 5000
