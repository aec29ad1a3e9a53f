"""SITL for external clients: opens links, keeps pace with the wall clock, runs until it is stopped."""

import contextlib
import gc
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.clock import RealTimeClock
from autopilot_bridge.firmware.simulator import Port, default_ports
from autopilot_bridge.links import Link, open_link, reach_of
from autopilot_bridge.links.readiness import readable
from autopilot_bridge.sitl.containment import FailureReport, VehicleFailure
from autopilot_bridge.sitl.sitl import Sitl
from autopilot_bridge.sitl.vehicle import SitlVehicle

_FREE_RUN_POLL_US: Final = 20_000
_POLL_WALL_S: Final = 0.004
_WAIT_S: Final = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class PaceReport:
    """How well the server keeps pace with the wall clock.

    Attributes:
        time_us: vehicle time.
        speedup: simulated seconds per wall second since the last report.
        slipped_s: total wall time that was lost because the machine was too slow, s.
    """

    time_us: int
    speedup: float
    slipped_s: float


@contextlib.contextmanager
def objects_kept() -> Iterator[None]:
    """Exclude the existing objects from Python's garbage collection: a full collection takes more than a
    tenth of a second, during which the simulation stands still.
    """
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


class SitlServer:
    """Runs a `Sitl` for clients on real links.

    No message of a client ends it: a vehicle that fails ends alone (`sitl.containment`).

    Args:
        sitl: the world.
        speedup: simulated seconds per wall second; None: as fast as the machine can.
        monotonic: wall clock, seconds.
        on_failure: called with each failure of a vehicle.

    Attributes:
        sitl: as given.
        failures: the failures of vehicles so far.
    """

    def __init__(
        self,
        sitl: Sitl,
        *,
        speedup: float | None,
        monotonic: Callable[[], float],
        on_failure: FailureReport | None = None,
    ) -> None:
        self.sitl = sitl
        self.failures: list[VehicleFailure] = []
        self._on_failure = on_failure
        sitl.contain(self._note)
        self._monotonic = monotonic
        self._speedup = speedup
        self._first: Link | None = None  # the first link opened
        self._clock = (
            None if speedup is None else RealTimeClock(speedup, monotonic=monotonic, wait=self._wait)
        )
        poll_us = _FREE_RUN_POLL_US if speedup is None else round(_POLL_WALL_S * speedup * 1e6)
        sitl.poll_every(min(poll_us, _FREE_RUN_POLL_US))

    def open(
        self, ports: Sequence[Sequence[Port]] | None = None, *, shared: Sequence[Port] = (), instance: int = 0
    ) -> list[tuple[SitlVehicle, Port, str]]:
        """Open the links of every vehicle.

        Args:
            ports: links per vehicle; None: the default ports of each flavour's clients.
            shared: links that all vehicles share.
            instance: instance of the first vehicle, which the default ports follow.

        Returns:
            (vehicle, port, address as opened) of every link.

        Raises:
            LinkError: a port is busy or a device missing; links that were opened before are closed again.
        """
        opened: list[tuple[SitlVehicle, Port, str]] = []
        with contextlib.ExitStack() as undo:
            undo.callback(self.sitl.close)
            for index, vehicle in enumerate(self.sitl.vehicles):
                flavour = vehicle.specification.autopilot
                chosen = default_ports(flavour, instance + index) if ports is None else ports[index]
                for port in chosen:
                    link = self._open(port)
                    vehicle.open(
                        link, role=port.role, bytes_per_s=self._capacity(link), reach=reach_of(port.address)
                    )
                    opened.append((vehicle, port, link.description))
            for port in shared:
                link = self._open(port)
                self.sitl.share(
                    link, role=port.role, bytes_per_s=self._capacity(link), reach=reach_of(port.address)
                )
                opened += [(vehicle, port, link.description) for vehicle in self.sitl.vehicles]
            undo.pop_all()
        return opened

    def _note(self, failure: VehicleFailure) -> None:
        self.failures.append(failure)
        if self._on_failure is not None:
            self._on_failure(failure)

    def _open(self, port: Port) -> Link:
        link = open_link(port.address, monotonic=self._monotonic)
        if self._first is None:
            self._first = link
        return link

    def _capacity(self, link: Link) -> float | None:
        """Bytes that a link carries in a second of vehicle time; a speedup does not change a serial line."""
        capacity: float | None = getattr(link, "bytes_per_s", None)
        return None if capacity is None or self._speedup is None else capacity / self._speedup

    def wait_for_client(self, stopped: Callable[[], bool]) -> bool:
        """Wait for a client on the first opened link (ArduPilot's `tcp:0:wait`); False when stopped.

        Raises:
            ValueError: no link was opened.
        """
        link = self._first
        if link is None:
            raise ValueError("no link is open that a client could come on; call open first")
        while not link.peers:
            if stopped():
                return False
            readable(link.filenos(), _WAIT_S)
            self.sitl.poll()
        return True

    def run(
        self,
        stopped: Callable[[], bool],
        *,
        report: Callable[[PaceReport], None] | None = None,
        report_every_s: float = 1.0,
        until_us: int | None = None,
    ) -> None:
        """Advance until `stopped()` or until vehicle time `until_us`."""
        with objects_kept():
            self._run(stopped, report, report_every_s, until_us)

    def _run(
        self,
        stopped: Callable[[], bool],
        report: Callable[[PaceReport], None] | None,
        report_every_s: float,
        until_us: int | None,
    ) -> None:
        sitl, clock, monotonic = self.sitl, self._clock, self._monotonic
        last_s, last_us = monotonic(), sitl.time_us
        while not stopped() and (until_us is None or sitl.time_us < until_us):
            sitl.advance()
            if clock is not None:
                clock.wait_until(sitl.time_us)
            if report is None:
                continue
            now_s = monotonic()
            if now_s - last_s >= report_every_s:
                speed = (sitl.time_us - last_us) * 1e-6 / (now_s - last_s)
                report(PaceReport(time_us=sitl.time_us, speedup=speed, slipped_s=self.slipped_s))
                last_s, last_us = now_s, sitl.time_us

    @property
    def slipped_s(self) -> float:
        """Total wall time lost, s."""
        return 0.0 if self._clock is None else self._clock.slipped_s

    def _wait(self, seconds: float) -> None:
        """Sleep, but deliver messages at once when they arrive: replies should not wait for the next step."""
        deadline_s = self._monotonic() + seconds
        while True:
            left_s = deadline_s - self._monotonic()
            if left_s <= 0.0:
                return
            if readable(self.sitl.filenos(), left_s):
                self.sitl.poll()
