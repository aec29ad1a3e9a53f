"""A command in a process of its own: how it ends is told, whatever ends it."""

import os
import signal
import subprocess
import sys

import pytest

SCRIPT = """
import os, signal, sys, time
from missions.supervision import supervised

{setup}

def command():
    {body}

sys.exit(supervised(command, crashed="the library crashed"))
"""


def start(body: str, setup: str = "") -> "subprocess.Popen[str]":
    """What is run: `body` under supervision, in a program that does `setup` first."""
    command = [sys.executable, "-c", SCRIPT.format(setup=setup, body=body)]
    return subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


@pytest.mark.parametrize(
    ("body", "code", "out", "err"),
    [
        ("print('done'); return 0", 0, "done\n", ""),
        ("print('no', file=sys.stderr); return 2", 2, "", "no\n"),
        ("os.kill(os.getpid(), signal.SIGSEGV)", 1, "", "flightstack: the library crashed (SIGSEGV)\n"),
        ("print('half'); os.abort()", 1, "", "flightstack: the library crashed (SIGABRT)\n"),
        ("os.kill(os.getpid(), signal.SIGKILL)", 1, "", "flightstack: the library crashed (SIGKILL)\n"),
    ],
)
def test_how_it_ended_is_told(body: str, code: int, out: str, err: str) -> None:
    process = start(body)
    said = process.communicate(timeout=60.0)
    assert process.returncode == code
    assert said[1] == err
    assert said[0] in (out, "half\n")


SLOW_TO_WATCH = "os.register_at_fork(after_in_parent=lambda: time.sleep(0.5))"
"""The child is well under way before the process that watches it does its next step."""
SLOW_TO_NOTICE = """
waitpid = os.waitpid
os.waitpid = lambda *which: (waitpid(*which), print("ended", flush=True), time.sleep(0.5))[0]
"""
"""What watches the child learns late that it has ended."""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("setup", ["", SLOW_TO_WATCH])
def test_who_asks_it_to_end_is_obeyed(number: signal.Signals, setup: str) -> None:
    process = start("print(os.getpid(), flush=True); time.sleep(600)", setup)
    assert process.stdout is not None
    child = int(process.stdout.readline())
    process.send_signal(number)
    process.communicate(timeout=60.0)
    assert process.returncode != 0
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)


def test_who_asks_it_to_end_when_it_has_ended_gets_its_exit_code() -> None:
    process = start("return 3", SLOW_TO_NOTICE)
    assert process.stdout is not None
    assert process.stdout.readline() == "ended\n"
    process.send_signal(signal.SIGTERM)
    assert process.communicate(timeout=60.0) == ("", "")
    assert process.returncode == 3
