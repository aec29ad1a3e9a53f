"""A command whose libraries may crash, watched by the process that the user started."""

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable
from types import FrameType
from typing import Final

FAILED: Final = 1
_KILLED: Final = 128
"""Plus the signal's number: what shells make of a command that was ended by one."""
_ASKED_TO_END: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def supervised(command: Callable[[], int], *, crashed: str) -> int:
    """Run a command in a process of its own and give its exit code.

    Call it before threads are started and libraries loaded: the process is forked.

    Args:
        command: gives its exit code.
        crashed: what is said on stderr when the process was ended by a signal that nobody sent, in front of
            the signal's name; the exit code is 1 then.
    """
    _flush()
    # What asks us to end between the fork and the handler that passes it on must not leave the child alone.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, _ASKED_TO_END)
    lifeline, held = os.pipe()
    child = os.fork()
    if not child:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        os.close(held)
        threading.Thread(target=_end_with_parent, args=(lifeline,), daemon=True).start()
        code = command()
        _flush()
        os._exit(code)  # what the caller still has to do is done once, and not here
    os.close(lifeline)
    status = _wait(child, mask)
    os.close(held)
    if not os.WIFSIGNALED(status):
        return os.waitstatus_to_exitcode(status)
    number = os.WTERMSIG(status)
    if number in _ASKED_TO_END:
        return _KILLED + number
    if sys.stderr is not None:
        sys.stderr.write(f"flightstack: {crashed} ({signal.Signals(number).name})\n")
    return FAILED


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:  # closed by whoever started us
            stream.flush()


def _end_with_parent(lifeline: int) -> None:
    """Nobody would hear what comes of it, or could end it, once the parent was killed."""
    os.read(lifeline, 1)  # the end of it: nothing is ever written
    os.kill(os.getpid(), signal.SIGTERM)


def _wait(child: int, mask: Iterable[int]) -> int:
    """Wait for a process, and pass on to it what asks us to end; a terminal's Ctrl-C reaches it anyway.

    Args:
        child: its number.
        mask: signals that are blocked while it is waited for; what has come by now is passed on first.
    """

    def pass_on(number: int, frame: FrameType | None) -> None:
        with contextlib.suppress(ProcessLookupError):  # it has just ended by itself
            os.kill(child, number)

    before = {number: signal.signal(number, pass_on) for number in _ASKED_TO_END}
    if sys.stdin is not None and sys.stdin.isatty():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    try:
        return os.waitpid(child, 0)[1]
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
