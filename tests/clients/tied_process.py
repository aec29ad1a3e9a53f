"""Programs that end with the test process, however that ends: by SIGKILL or by a timeout, too.

A fixture's clean-up does not run when pytest is killed, and a SITL left behind holds its ports and a core.
"""

import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

_TIE: Final = """
import ctypes, os, signal, sys
parent = int(sys.argv[1])
PR_SET_PDEATHSIG = 1  # prctl(2): kept across execve
ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
if os.getppid() == parent:  # it has not ended in between
    os.execvp(sys.argv[2], sys.argv[2:])
"""


def tied(command: Sequence[str]) -> list[str]:
    """A command for `subprocess` that runs `command`, and is killed by the kernel when its parent ends.

    The parent is the thread that starts it; tests start programs from the main thread. On other systems than
    Linux it is the command itself.
    """
    if not sys.platform.startswith("linux"):
        return list(command)
    return [sys.executable, "-S", "-E", "-c", _TIE, str(os.getpid()), *command]


def gone(pid: int, within_s: float = 60.0) -> bool:
    """A process has ended, or does so in that time."""
    deadline_s = time.monotonic() + within_s
    while alive(pid):
        if time.monotonic() > deadline_s:
            return False
        time.sleep(0.01)
    return True


def alive(pid: int) -> bool:
    """A process is there, and no zombie that its new parent has not reaped yet."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"
