"""A Ray cluster of two nodes on this machine: a head and a worker, each a process of its own, on loopback."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from tests.clients.tied_process import alive, tied

HEAD, WORKER = "127.0.0.2", "127.0.0.3"
"""Addresses of loopback. Ray replaces 127.0.0.1 by the machine's address on the network."""
_START_S: Final = 120.0
_QUICK: Final = {
    # a node that is gone is noticed after two seconds instead of half a minute
    "RAY_health_check_initial_delay_ms": "1000",
    "RAY_health_check_period_ms": "500",
    "RAY_health_check_timeout_ms": "2000",
    "RAY_health_check_failure_threshold": "4",
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_AUTH_MODE": "disabled",  # a token in the home folder would be used for the head only
    "RAY_DISABLE_MEMORY_MONITOR": "1",
}


def free_port() -> int:
    """A TCP port of loopback that is free now."""
    with socket.create_server((HEAD, 0)) as server:
        port: int = server.getsockname()[1]
        return port


def descendants(pid: int) -> list[int]:
    """A process and all that it has started, by their parents."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with suppress(OSError):
                parents[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
    found = [pid]
    for one in found:
        found += [child for child, parent in parents.items() if parent == one]
    return found


def program_of(pid: int) -> str:
    """The command line of a process."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    return ""


class Node:
    """One node: `ray start --block`.

    Args:
        arguments: of `ray start`, besides those of every node here.
        host: its address.
        folder: for its output.
    """

    def __init__(self, *arguments: str, host: str, folder: Path, processors: int = 1) -> None:
        command = [
            *(sys.executable, "-m", "ray.scripts.scripts", "start", "--block", "--disable-usage-stats"),
            *(f"--node-ip-address={host}", f"--num-cpus={processors}", "--object-store-memory=80000000"),
            *("--min-worker-port=0", "--max-worker-port=0", "--dashboard-agent-listen-port=0"),
            *arguments,
        ]
        self._output = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 - open as long as the node
        self.process = subprocess.Popen(
            tied(command), env={**os.environ, **_QUICK}, stdout=self._output, stderr=self._output, cwd=folder
        )

    def output(self) -> str:
        self._output.seek(0)
        return self._output.read().decode(errors="replace")

    def raylet(self) -> int:
        """The process that is the node for Ray."""
        return next(
            pid for pid in descendants(self.process.pid) if "/raylet/raylet" in program_of(pid).split(" ")[0]
        )

    def kill(self) -> None:
        """As when the machine is gone: its node manager and all its workers."""
        for pid in descendants(self.raylet()):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def stop(self) -> None:
        everything = descendants(self.process.pid)
        self.process.terminate()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(timeout=20.0)
        for pid in everything:
            if alive(pid):
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
        self.process.wait(timeout=20.0)
        self._output.close()


class Cluster:
    """A head and a worker node with a processor each.

    Attributes:
        address: HOST:PORT of the head.
        client_address: of its client server.
        worker: the other node.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        port, client_port = free_port(), free_port()
        self.address, self.client_address = f"{HEAD}:{port}", f"ray://{HEAD}:{client_port}"
        self.head = Node(
            *("--head", f"--port={port}", f"--ray-client-server-port={client_port}"),
            *("--include-dashboard=false", f"--temp-dir={folder}"),
            host=HEAD,
            folder=folder,
        )
        _wait_for(port, self.head)
        self.worker = self.join()

    def join(self) -> Node:
        """Start another worker node."""
        return Node(f"--address={self.address}", host=WORKER, folder=self._folder)

    def stop(self) -> None:
        self.worker.stop()
        self.head.stop()


def _wait_for(port: int, node: Node) -> None:
    deadline_s = time.monotonic() + _START_S
    while True:
        with suppress(OSError), socket.create_connection((HEAD, port), timeout=1.0):
            return
        if time.monotonic() > deadline_s or node.process.poll() is not None:
            raise AssertionError(f"the Ray head did not start: {node.output()}")
        time.sleep(0.1)


@contextmanager
def two_nodes() -> Iterator[Cluster]:
    """A cluster for the tests of a module."""
    folder = Path(tempfile.mkdtemp(prefix="fr-"))  # sockets are in it: their paths must be short
    cluster = Cluster(folder)
    try:
        yield cluster
    finally:
        cluster.stop()
        shutil.rmtree(folder, ignore_errors=True)
