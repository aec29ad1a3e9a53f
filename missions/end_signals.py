"""The signals that ask a command to end: Ctrl-C, `kill` or a service manager, a terminal that is closed."""

import signal
import threading
from typing import Final

_ASKING: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def end_signals(*always: signal.Signals) -> tuple[signal.Signals, ...]:
    """SIGINT, SIGTERM and SIGHUP, as far as they are to be handled here and now.

    Those that are ignored (`nohup`, a background job) or have a handler of somebody's own are left alone, but
    for `always`; and all of them outside the main thread, which alone may be told of signals.
    """
    if threading.current_thread() is not threading.main_thread():
        return ()
    theirs = (signal.SIG_DFL, signal.default_int_handler)
    return tuple(n for n in _ASKING if n in always or signal.getsignal(n) in theirs)
