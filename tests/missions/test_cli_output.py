"""Output that no process takes: a full disk, a reader that has gone, no output at all."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from autopilot_bridge.mavlink import FrameEncoder, dialect
from autopilot_bridge.tlog import TlogWriter
from missions.cli import entry

ROOT = Path(__file__).parents[2]
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}


@pytest.fixture
def log(tmp_path: Path) -> str:
    path = tmp_path / "short.tlog"
    with TlogWriter(path) as writer:
        writer.write(
            1_700_000_000_000_000, FrameEncoder(1, 1).encode(dialect.MAVLink_system_time_message(1, 1))
        )
    return str(path)


def run(redirected: str, *words: str) -> "subprocess.CompletedProcess[str]":
    """The command line as a shell starts it, with its output somewhere."""
    command = ["sh", "-c", f'"$@" {redirected}', "sh", sys.executable, "-m", "missions", *words]
    return subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, check=False)


def test_on_a_full_disk_it_fails_in_one_line(log: str) -> None:
    done = run("> /dev/full", "log", "info", log)
    assert done.returncode == 1
    assert done.stderr == "flightstack: can't write the output: No space left on device\n"


@pytest.mark.slow
def test_a_sitl_that_can_not_say_where_it_is_does_not_start() -> None:
    done = run("> /dev/full", "sitl", "--link", "udpin:127.0.0.1:0", "--speedup", "0", "--duration", "1")
    assert done.returncode == 1
    assert done.stderr.splitlines()[1:] == ["flightstack: can't write the output: No space left on device"]


def test_a_reader_that_has_gone_is_no_news(log: str) -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "missions", "log", "info", log],
        cwd=ROOT, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as process:  # fmt: skip
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()  # long before the first line
        assert process.stderr.read() == b""
    assert process.returncode == 1


@pytest.mark.slow
def test_without_any_output_a_sitl_runs() -> None:
    done = run(">&-", "sitl", "--link", "udpin:127.0.0.1:0", "--speedup", "0", "--duration", "1")
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("closed", ["2>&-", "2>&- <&-", ">&- 2>&- <&-"])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_without_an_error_output_a_command_runs(closed: str, log: str) -> None:
    done = run(closed, "log", "play", log, "--link", "udpout:127.0.0.1:9")
    assert done.returncode == 0


def test_ctrl_c_while_the_command_line_is_imported_is_one_line(monkeypatch, capsys) -> None:
    class Interrupted:
        def find_spec(self, name: str, *_: object) -> None:
            if name == "missions.cli.main":
                raise KeyboardInterrupt

    monkeypatch.delitem(sys.modules, "missions.cli.main", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Interrupted(), *sys.meta_path])
    with pytest.raises(SystemExit) as ended:
        entry.main()
    assert ended.value.code == 130
    assert capsys.readouterr().err == "\ninterrupted\n"


def test_no_file_gets_the_number_of_a_closed_stream() -> None:
    code = (
        "import os, sys; from missions.cli.main import main\n"
        "try: main(['nosuch'])\n"
        "except SystemExit as stop: print(stop.code, sys.stderr.fileno(), os.open('/dev/null', 0) > 2)"
    )
    done = subprocess.run(
        ["sh", "-c", '"$@" 2>&-', "sh", sys.executable, "-c", code],
        cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.stdout == "2 2 True\n"
