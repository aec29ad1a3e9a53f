"""What only some operating systems have: signals that end a program, flags of files, processors.

`sys.platform` decides, because the type checker follows it: the static checks run for Linux, Windows and
macOS.
"""

import os
import signal
import sys
from typing import Final

if sys.platform == "win32":
    END_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGBREAK)
    """The signals that end a command: Ctrl-C, a service manager; Ctrl-Break and a closed console."""
    READ_AT_ONCE: Final = os.O_RDONLY | os.O_BINARY | os.O_NOINHERIT
    """Flags to open a file for reading without waiting for another process."""
else:
    END_SIGNALS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    """The signals that end a command: Ctrl-C, `kill` and service managers, a closed terminal."""
    READ_AT_ONCE: Final = os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC
    """Flags to open a file for reading; a pipe without a writer would keep a blocking open waiting."""


def processors() -> int:
    """Number of processors that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def lower_priority() -> None:
    """Let other processes run first, where a process can say so."""
    if sys.platform != "win32":
        os.nice(5)
