"""The same mission, unchanged, over every kind of link to a SITL in another process, on both firmwares."""

import contextlib
import os
import selectors
import socket
import threading
import tty
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.clients.sitl_process import free_port, running_sitl
from tests.system.runs import SHORT, started

SPEEDUP = 20.0


@dataclass(frozen=True)
class Ends:
    """One link: how the SITL and how the mission open it."""

    sitl: str
    mission: str


@contextmanager
def serial_line() -> Iterator[Ends]:
    """Two pseudo terminals joined like the ends of a null-modem cable."""
    pairs = [os.openpty(), os.openpty()]
    masters = [master for master, _ in pairs]
    for master, slave in pairs:
        tty.setraw(slave)
        os.set_blocking(master, False)
    stop_read, stop_write = os.pipe()
    other = {masters[0]: masters[1], masters[1]: masters[0]}

    def pump() -> None:
        with selectors.DefaultSelector() as selector:
            for descriptor in (*masters, stop_read):
                selector.register(descriptor, selectors.EVENT_READ)
            while True:
                for key, _ in selector.select():
                    if key.fd == stop_read:
                        return
                    data = os.read(key.fd, 4096)
                    with contextlib.suppress(BlockingIOError):  # no reader there: lost, as on a cable
                        os.write(other[key.fd], data)

    worker = threading.Thread(target=pump)
    worker.start()
    try:
        names = [os.ttyname(slave) for _, slave in pairs]
        yield Ends(f"serial:{names[0]}:921600", f"{names[1]},921600")
    finally:
        os.write(stop_write, b"x")
        worker.join()
        for descriptor in (*masters, *(slave for _, slave in pairs), stop_read, stop_write):
            os.close(descriptor)


@contextmanager
def network(kind: str) -> Iterator[Ends]:
    """A UDP or TCP link on a free port; `kind` is what the mission does."""
    port = free_port(socket.SOCK_STREAM if kind.startswith("tcp") else socket.SOCK_DGRAM)
    here = f"127.0.0.1:{port}"
    yield {
        "udpin": Ends(f"udpout:{here}", f"udpin:{here}"),
        "udpout": Ends(f"udpin:{here}", f"udpout://{here}"),
        "tcp": Ends(f"tcpin:{here}", f"tcp:{here}"),
    }[kind]


OPENERS = {
    "udpin": lambda: network("udpin"),
    "udpout": lambda: network("udpout"),
    "tcp": lambda: network("tcp"),
    "serial": serial_line,
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("px4", "ardupilot"),
    [
        (("udpin", "setpoints"), ("udpout", "waypoints")),
        (("tcp", "waypoints"), ("tcp", "setpoints")),
        (("serial", "setpoints"), ("serial", "waypoints")),
    ],
    ids=["udp", "tcp", "serial"],
)
def test_flies_a_sitl_in_another_process(
    px4: tuple[str, str], ardupilot: tuple[str, str], tmp_path: Path
) -> None:
    """One flight of each firmware at the same time, each in its own two processes."""
    with ExitStack() as stack:
        flights = []
        for flavour, (link, via) in (("px4", px4), ("ardupilot", ardupilot)):
            ends = stack.enter_context(OPENERS[link]())
            stack.enter_context(running_sitl(flavour, [ends.sitl], speedup=SPEEDUP))
            run = started(tmp_path / flavour, *SHORT, "--via", via, "--connect", ends.mission)
            flights.append((flavour, via, stack.enter_context(run)))
        for flavour, via, run in flights:
            run.finish()  # type: ignore[attr-defined]
            summary = run.summary  # type: ignore[attr-defined]
            assert summary["outcome"] == "completed"
            assert summary["autopilot"] == flavour
            assert summary["seed"] is None
            assert summary["distance_m"] > 60.0
            assert summary["sim_time_s"] > 30.0
            assert summary["path_rms_error_m"] < (0.6 if via == "setpoints" else 2.5)
            assert "HIL_STATE_QUATERNION" not in summary["message_counts"]
            if via == "waypoints":
                waypoints = summary["vehicles"][0]["waypoints"]
                assert waypoints["passed"] == waypoints["count"]
