"""A Python in which the project finds what Windows has: on PYTHONPATH it is imported at the start.

Only the project's own modules find it; libraries keep what they need, because on Windows they have code of
their own. `sys.platform` is "win32" for the project, modules and names that only POSIX has are absent, and
names that only Windows has stand for the nearest that there is here. Worker processes inherit PYTHONPATH.
"""

import asyncio
import builtins
import os
import signal
import socket
import sys
from types import ModuleType

OURS = ("flightsim", "autopilot_bridge", "estimators", "missions", "flightstack")
ABSENT_MODULES = ("fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty", "posix")
ABSENT = {
    "os": (
        *(
            "O_CLOEXEC",
            "O_DIRECTORY",
            "O_NOFOLLOW",
            "O_NONBLOCK",
            "WIFSIGNALED",
            "WTERMSIG",
            "chroot",
            "fchmod",
        ),
        *("fork", "forkpty", "fwalk", "getgid", "getpgid", "getuid", "killpg", "mkfifo", "nice", "openpty"),
        *("pread", "pwrite", "sched_getaffinity", "set_blocking", "setsid", "statvfs", "ttyname", "uname"),
    ),
    "select": ("epoll", "kqueue", "poll", "POLLIN", "POLLOUT"),
    "signal": (
        *(
            "ITIMER_REAL",
            "SIGALRM",
            "SIGCHLD",
            "SIGCONT",
            "SIGHUP",
            "SIGKILL",
            "SIGPIPE",
            "SIGQUIT",
            "SIGSTOP",
        ),
        *("SIGUSR1", "SIGUSR2", "SIG_BLOCK", "SIG_SETMASK", "alarm", "pause", "pthread_sigmask", "setitimer"),
    ),
    "socket": ("AF_UNIX", "MSG_DONTWAIT", "MSG_NOSIGNAL", "SO_REUSEPORT"),
    "sys": (),
}
PRESENT = {
    "os": {"O_BINARY": 0, "O_NOINHERIT": os.O_CLOEXEC},
    "signal": {"SIGBREAK": signal.SIGUSR2},
    "socket": {"SO_EXCLUSIVEADDRUSE": socket.SO_REUSEADDR},
    "sys": {"platform": "win32"},
}


class AsOnWindows(ModuleType):
    """A module of the standard library with what Windows has of it."""

    def __init__(self, module):
        super().__init__(module.__name__)
        self.__dict__.update(_module=module, _present=PRESENT.get(module.__name__, {}))

    def __getattr__(self, name):
        if name in ABSENT[self.__name__]:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        return self._present[name] if name in self._present else getattr(self._module, name)

    def __setattr__(self, name, value):
        setattr(self._module, name, value)


seen = {name: AsOnWindows(sys.modules.get(name) or __import__(name)) for name in ABSENT}
original = builtins.__import__


def import_as_on_windows(name, globals=None, locals=None, fromlist=(), level=0):
    if level or not (globals or {}).get("__name__", "").startswith(OURS):
        return original(name, globals, locals, fromlist, level)
    if name.partition(".")[0] in ABSENT_MODULES:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    found = original(name, globals, locals, fromlist, level)
    if name == "serial":
        found.Serial.set_buffer_size = lambda *_arguments, **_sizes: None
    return seen.get(name, found)


def add_signal_handler(*_arguments):
    raise NotImplementedError


builtins.__import__ = import_as_on_windows
asyncio.SelectorEventLoop.add_signal_handler = add_signal_handler
