"""The interface of a link: bytes to and from peers; it never blocks, and never raises because of a peer."""

import errno
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from autopilot_bridge.errors import LinkError

PeerId = tuple[str, int]
"""The identity of a peer: host and port; device or name and 0 where there are no ports."""

MAX_BACKLOG_BYTES: Final = 256 * 1024
MAX_READS: Final = 256  # in one `receive`, so that a flood on one link can't block the others
MAX_READ_BYTES: Final = 1 << 18  # in one `receive`
READ_SIZE: Final = 65536

_HUNG_UP: Final = "the other end hung up at once: check what listens there"


def open_error(address: str, error: OSError) -> LinkError:
    """A LinkError with the problem of the address and its solution."""
    advice = {
        errno.EADDRINUSE: "the port is in use: stop the other program or choose another port",
        errno.EADDRNOTAVAIL: "no interface of this machine has that address: use 127.0.0.1 or 0.0.0.0",
        errno.EACCES: "not permitted: choose a port above 1023",
        errno.ECONNREFUSED: "nothing listens there: start the vehicle or the simulator first, check the port",
        errno.ECONNRESET: _HUNG_UP,
        errno.ENOTCONN: _HUNG_UP,
        errno.EHOSTUNREACH: "the host can't be reached: check the network",
        errno.ENETUNREACH: "the network can't be reached: check the network",
        errno.ETIMEDOUT: "no answer: check the host and the port",
    }.get(error.errno or 0, "check the address")
    return LinkError(f"can't open {address}: {error.strerror or error}; {advice}")


@dataclass(slots=True)
class LinkCounters:
    """The data that a link has transmitted and dropped.

    Attributes:
        bytes_in, bytes_out: bytes received, and bytes passed to the operating system (or the other end in
            memory).
        reads, writes: pieces received, and pieces sent (one piece to three peers counts three times).
        dropped, bytes_dropped: whole pieces that were not sent, because a peer reads too slowly or is gone.
        errors: faults reported by the operating system (refused, reset, unplugged).
        connects, disconnects: number of peers that connected and disconnected.
    """

    bytes_in: int = 0
    bytes_out: int = 0
    reads: int = 0
    writes: int = 0
    dropped: int = 0
    bytes_dropped: int = 0
    errors: int = 0
    connects: int = 0
    disconnects: int = 0


class Link(Protocol):
    """Bytes to and from one or several peers. Each peer is a separate byte stream and needs a separate
    parser.
    """

    @property
    def description(self) -> str:
        """The address in its canonical form."""
        ...

    @property
    def counters(self) -> LinkCounters: ...

    @property
    def peers(self) -> tuple[PeerId, ...]:
        """The peers that get the data sent now."""
        ...

    @property
    def congested(self) -> bool:
        """True while much data waits for a slow reader; long answers should wait."""
        ...

    def send(self, data: bytes, to: PeerId | None = None) -> None:
        """Send whole frames to one peer or to all of them. Never blocks; data that can't be sent are dropped
        as a whole.
        """
        ...

    def receive(self) -> list[tuple[PeerId, bytes]]:
        """All received data, by sender, in order. Never blocks and never raises."""
        ...

    def filenos(self) -> tuple[int, ...]:
        """File descriptors to watch for reading (they change when peers connect and disconnect); none in
        memory.
        """
        ...

    def close(self) -> None:
        """Close; a second time does nothing."""
        ...


class SendQueue:
    """The data that a slow byte stream has not accepted yet: pieces are sent whole and in order, or not at
    all.

    Attributes:
        queued_bytes: bytes waiting.
        taken_bytes: total bytes that the stream has accepted.
    """

    def __init__(self, counters: LinkCounters, limit_bytes: int = MAX_BACKLOG_BYTES) -> None:
        self._counters = counters
        self._limit_bytes = limit_bytes
        self._pieces: deque[bytes] = deque()
        self.queued_bytes = 0
        self.taken_bytes = 0

    @property
    def congested(self) -> bool:
        """More than a quarter full."""
        return self.queued_bytes * 4 > self._limit_bytes

    def send(self, data: bytes, write: Callable[[bytes], int]) -> None:
        """Send `data` after the queued data; `write` returns the accepted bytes and raises
        BlockingIOError.
        """
        if self.queued_bytes + len(data) > self._limit_bytes:
            self.flush(write)
            if self.queued_bytes + len(data) > self._limit_bytes:
                self._counters.dropped += 1
                self._counters.bytes_dropped += len(data)
                return
        self._counters.writes += 1
        self._pieces.append(data)
        self.queued_bytes += len(data)
        self.flush(write)

    def flush(self, write: Callable[[bytes], int]) -> None:
        """Send as much as the stream accepts now."""
        pieces = self._pieces
        while pieces:
            try:
                taken = write(pieces[0])
            except (BlockingIOError, InterruptedError):
                return
            self._counters.bytes_out += taken
            self.queued_bytes -= taken
            self.taken_bytes += taken
            if taken < len(pieces[0]):
                pieces[0] = pieces[0][taken:]
                return
            pieces.popleft()

    def clear(self) -> None:
        """Drop the queued data of a stream that is closed."""
        self._counters.dropped += len(self._pieces)
        self._counters.bytes_dropped += self.queued_bytes
        self._pieces.clear()
        self.queued_bytes = 0
