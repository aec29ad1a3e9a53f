"""A SITL in a process of its own, as a user starts it, for tests with other people's clients."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

START_DEADLINE_S = 90.0
READY_LINE = "ready"


def free_port(kind: int = socket.SOCK_DGRAM) -> int:
    """A port that nobody uses at the moment."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@dataclass
class SitlProcess:
    """A running `flightstack sitl`; `lines` is what it has printed so far."""

    process: subprocess.Popen[str]
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
    command = [sys.executable, "-m", "missions", "sitl", "--autopilot", flavour, "--speedup", str(speedup)]
    for link in links:
        command += ["--link", link]
    command += options
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        bufsize=1,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
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
            process.wait(10.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        reader.join(5.0)
