"""A command in a process of its own: how it ends is reported, whatever ends it."""

import signal
import subprocess
import sys

import pytest

from tests.clients.tied_process import gone

SCRIPT = """
import os, signal, sys, time
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # as on a terminal, though the tests are run by nohup
from missions.process.supervision import supervised

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
def test_how_it_ended_is_reported(body: str, code: int, out: str, err: str) -> None:
    process = start(body)
    said = process.communicate(timeout=60.0)
    assert process.returncode == code
    assert said[1] == err
    assert said[0] in (out, "half\n")


SLOW_TO_WATCH = "os.register_at_fork(after_in_parent=lambda: time.sleep(0.5))"
"""The child is well under way before the process that watches it does its next step."""
SLOW_TO_NOTICE = """
import threading
waitpid, kill, reported = os.waitpid, os.kill, threading.Event()
os.kill = lambda *signal: (reported.set(), kill(*signal))
os.waitpid = lambda *which: (waitpid(*which), print("ended", flush=True), reported.wait(60.0))[0]
"""
"""What watches the child learns that it has ended only after it has terminated it."""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("setup", ["", SLOW_TO_WATCH])
def test_who_asks_it_to_end_is_obeyed(number: signal.Signals, setup: str) -> None:
    process = start("print(os.getpid(), flush=True); time.sleep(600)", setup)
    assert process.stdout is not None
    child = int(process.stdout.readline())
    process.send_signal(number)
    process.communicate(timeout=60.0)
    assert process.returncode != 0
    assert gone(child)


def test_who_asks_it_to_end_when_it_has_ended_gets_its_exit_code() -> None:
    process = start("return 3", SLOW_TO_NOTICE)
    assert process.stdout is not None
    assert process.stdout.readline() == "ended\n"
    process.send_signal(signal.SIGTERM)
    assert process.communicate(timeout=60.0) == ("", "")
    assert process.returncode == 3


def test_a_command_ends_with_the_process_that_watches_it() -> None:
    process = start("print(os.getpid(), flush=True); time.sleep(600)")
    assert process.stdout is not None
    child = int(process.stdout.readline())
    process.kill()
    process.communicate(timeout=60.0)  # the child holds the other end, too
    assert gone(child)


def test_a_command_without_output_gives_its_exit_code() -> None:
    process = start("return 3", "sys.stdout = sys.stderr = None")  # as Python finds them closed
    assert process.communicate(timeout=60.0) == ("", "")
    assert process.returncode == 3
