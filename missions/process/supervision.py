"""Runs a command whose libraries may crash in a child process and watches it."""

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable
from types import FrameType
from typing import Final

from flightsim.foundation.operating_system import END_SIGNALS

FAILED: Final = 1
_KILLED: Final = 128
"""Added to the signal's number: the exit code that shells report for a command that a signal ended."""


def supervised(command: Callable[[], int], *, crashed: str) -> int:
    """Run a command in a child process and return its exit code.

    Call it before threads are started and libraries are loaded, because the process is forked. On Windows,
    which has no fork, the command runs in this process, and a crash is not put in words.

    Args:
        command: returns its exit code.
        crashed: text printed on stderr, before the signal's name, when a signal of a crash ended the process;
            the exit code is then 1.
    """
    if sys.platform == "win32":
        return command()
    _flush()
    # A signal between the fork and the installation of the handler must not leave the child without its
    # parent.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, END_SIGNALS)
    lifeline, held = os.pipe()
    child = os.fork()
    if not child:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        os.close(held)
        threading.Thread(target=_end_with_parent, args=(lifeline,), daemon=True).start()
        code = command()
        _flush()
        os._exit(code)  # the caller's remaining work is done once, in the parent
    os.close(lifeline)
    status = _wait(child, mask)
    os.close(held)
    if not os.WIFSIGNALED(status):
        return os.waitstatus_to_exitcode(status)
    number = os.WTERMSIG(status)
    if number in END_SIGNALS:
        return _KILLED + number
    if sys.stderr is not None:
        sys.stderr.write(f"flightstack: {crashed} ({signal.Signals(number).name})\n")
    return FAILED


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # may have been closed by the parent process
            stream.flush()


def _end_with_parent(lifeline: int) -> None:
    """End this process when the parent is killed, because no other process could stop it then."""
    os.read(lifeline, 1)  # returns at the end of the file; no data are ever written to it
    os.kill(os.getpid(), signal.SIGTERM)


def _wait(child: int, mask: Iterable[int]) -> int:
    """Wait for a process, and pass on signals that end this process; a terminal's Ctrl-C reaches the child
    directly.

    Args:
        child: its process id.
        mask: blocked signals; those received before this call are passed on first.
    """

    def pass_on(number: int, frame: FrameType | None) -> None:
        with contextlib.suppress(ProcessLookupError):  # it has just ended by itself
            os.kill(child, number)

    if sys.platform == "win32":
        raise AssertionError("there is no supervising parent on Windows")
    before = {number: signal.signal(number, pass_on) for number in END_SIGNALS}
    if sys.stdin is not None and sys.stdin.isatty():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    try:
        return os.waitpid(child, 0)[1]
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
