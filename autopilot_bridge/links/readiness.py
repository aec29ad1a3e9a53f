"""Waits until links can be read or written: `poll`, and `select` on Windows, which has no `poll`."""

import select
import sys
from collections.abc import Sequence
from threading import Event
from typing import Final

_PAUSE: Final = Event()  # is never set


def readable(filenos: Sequence[int], timeout_s: float) -> bool:
    """Whether one of these can be read, after this time at most; a signal ends the wait."""
    try:
        if sys.platform == "win32":
            if not filenos:  # which its `select` refuses
                return _PAUSE.wait(timeout_s)
            return bool(select.select(filenos, (), (), timeout_s)[0])
        poll = select.poll()
        for number in filenos:
            poll.register(number, select.POLLIN)
        return bool(poll.poll(timeout_s * 1e3))
    except InterruptedError:
        return False


def writable(fileno: int) -> bool:
    """Whether this can be written now, or has failed: a connection is made, or refused."""
    if sys.platform == "win32":  # reports a refused connection among the exceptional ones
        _, made, refused = select.select((), (fileno,), (fileno,), 0.0)
        return bool(made or refused)
    poll = select.poll()
    poll.register(fileno, select.POLLOUT)
    return bool(poll.poll(0))
