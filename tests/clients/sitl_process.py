"""A SITL in a process of its own, as a user starts it, for tests with other people's clients."""

import contextlib
import itertools
import os
import signal
import socket
import subprocess
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from tests.clients.forked_process import Program, flightstack

START_DEADLINE_S = 240.0  # a first start compiles the flight code, on a machine that has other work too
READY_LINE = "ready"
_PORTS = range(20_000, 24_900)  # not the firmwares', not MAVProxy's, below every system's ephemeral range
_candidates = itertools.cycle((*_PORTS[os.getpid() * 37 % len(_PORTS) :], *_PORTS))
"""Every process of a test run begins elsewhere."""


def free_port(kind: int = socket.SOCK_DGRAM) -> int:
    """A port that no process uses at the moment, and that no socket without a port of its own is given.

    Those get theirs from the ephemeral range, which on a busy machine is soon where a test wanted to listen.
    """
    for port in _candidates:
        with socket.socket(socket.AF_INET, kind) as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port
    raise AssertionError("unreachable: the candidates don't end")


@dataclass
class SitlProcess:
    """A running `flightstack sitl`; `lines` is what it has printed so far."""

    process: Program
    lines: list[str] = field(default_factory=list)
    started: threading.Event = field(default_factory=threading.Event)

    def read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line.rstrip("\n"))
            if READY_LINE in line:
                self.started.set()
        self.started.set()


@contextlib.contextmanager
def running_sitl(
    flavour: str, links: Sequence[str], *, speedup: float = 10.0, options: Sequence[str] = ()
) -> Iterator[SitlProcess]:
    """Start a SITL on the given links, wait until it is ready, stop it with Ctrl-C at the end."""
    arguments = ["sitl", "--autopilot", flavour, "--speedup", str(speedup)]
    for link in links:
        arguments += ["--link", link]
    process = flightstack(*arguments, *options, merged=True)
    sitl = SitlProcess(process)
    reader = threading.Thread(target=sitl.read, daemon=True)
    reader.start()
    try:
        assert sitl.started.wait(START_DEADLINE_S), f"no {READY_LINE!r} line: {sitl.lines}"
        assert any(READY_LINE in line for line in sitl.lines), f"the SITL ended at once: {sitl.lines}"
        yield sitl
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(60.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        reader.join(5.0)
