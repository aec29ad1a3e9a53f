"""A telemetry log as a read-only link."""

from collections.abc import Callable
from typing import Final

from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.links.address import ReplayLog
from autopilot_bridge.links.link import LinkCounters, PeerId
from autopilot_bridge.tlog import TlogReader

_MAX_PIECES: Final = 10_000  # of one `receive`


class ReplayLink:
    """Delivers the frames of a log at their times, counted from the first `receive`.

    Args:
        address: the log.
        time_us: the clock that paces it, in microseconds; the wall clock when not given.

    Attributes:
        finished: all frames were delivered.

    Raises:
        TlogError: the log can't be read.
    """

    def __init__(self, address: ReplayLog, *, time_us: Callable[[], int] | None = None) -> None:
        self.description = str(address)
        self.counters = LinkCounters()
        self.finished = False
        self._time_us = time_us if time_us is not None else _wall_time_us
        self._peer: PeerId = (address.path.name, 0)
        self._records = iter(TlogReader(address.path))
        self._next = next(self._records, None)
        self._log_start_us = 0 if self._next is None else self._next[0]
        self._start_us: int | None = None
        self.finished = self._next is None

    @property
    def peers(self) -> tuple[PeerId, ...]:
        """The log."""
        return (self._peer,)

    @property
    def congested(self) -> bool:
        """Never."""
        return False

    def send(self, data: bytes, to: PeerId | None = None) -> None:
        """Drop the data, and count them as dropped: a log is read-only."""
        self.counters.dropped += 1
        self.counters.bytes_dropped += len(data)

    def receive(self) -> list[tuple[PeerId, bytes]]:
        """All frames that are due."""
        now_us = self._time_us()
        if self._start_us is None:
            self._start_us = now_us
        log_now_us = self._log_start_us + now_us - self._start_us
        received: list[tuple[PeerId, bytes]] = []
        while self._next is not None and self._next[0] <= log_now_us and len(received) < _MAX_PIECES:
            raw = self._next[1].raw
            self.counters.reads += 1
            self.counters.bytes_in += len(raw)
            received.append((self._peer, raw))
            self._next = next(self._records, None)
        self.finished = self._next is None
        return received

    def filenos(self) -> tuple[int, ...]:
        """None."""
        return ()

    def close(self) -> None:
        """End the replay."""
        self._next = None
        self.finished = True


def _wall_time_us() -> int:
    return int(wall_time_s() * 1e6)
