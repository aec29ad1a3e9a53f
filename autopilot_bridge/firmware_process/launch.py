"""Start a program that ends with its parent: `python -I launch.py PROGRAM ARGUMENT...`.

On Linux the kernel ends it when the process that started it ends, however that happens. The program may not
take real-time priority there: with it a firmware's threads starve the world that they wait for.
"""

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1
_PR_CAPBSET_DROP = 24
_CAP_SYS_NICE = 23


def main(arguments: list[str]) -> None:
    """Replace this process by the program."""
    if sys.platform == "linux":
        prctl = ctypes.CDLL(None).prctl
        prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        prctl(_PR_CAPBSET_DROP, _CAP_SYS_NICE, 0, 0, 0)  # permitted to the superuser only, who alone needs it
    os.execv(arguments[0], arguments)


if __name__ == "__main__":
    main(sys.argv[1:])
