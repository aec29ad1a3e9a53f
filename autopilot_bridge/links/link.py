"""What every link is: bytes to and from peers, never blocking, never raising for what a peer does."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

PeerId = tuple[str, int]
"""Who is at the other end: host and port; device or name and 0 where there are no ports."""

MAX_BACKLOG_BYTES: Final = 256 * 1024
MAX_READS: Final = 256  # of one `receive`, so that a flood on one link can't starve the others
MAX_READ_BYTES: Final = 1 << 18  # of one `receive`
READ_SIZE: Final = 65536


@dataclass(slots=True)
class LinkCounters:
    """What passed over a link and what did not.

    Attributes:
        bytes_in, bytes_out: received, and handed to the operating system (or the other end in memory).
        reads, writes: pieces received, and pieces sent (one piece to three peers counts three times).
        dropped, bytes_dropped: pieces that were not sent, whole, because a peer reads too slowly or is gone.
        errors: faults the operating system reported (refused, reset, unplugged).
        connects, disconnects: peers that came and went.
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
    """Bytes to and from one or several peers. Each peer is a byte stream of its own: give it its own
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
        """Who would get what is sent now."""
        ...

    @property
    def congested(self) -> bool:
        """True while a slow reader holds back much of what was sent to it; long answers should wait."""
        ...

    def send(self, data: bytes, to: PeerId | None = None) -> None:
        """Send whole frames to one peer or to all of them. Never blocks; what can't be sent is dropped
        whole.
        """
        ...

    def receive(self) -> list[tuple[PeerId, bytes]]:
        """Everything that has arrived, by sender, in order. Never blocks and never raises."""
        ...

    def filenos(self) -> tuple[int, ...]:
        """File descriptors to watch for reading (they change as peers come and go); none in memory."""
        ...

    def close(self) -> None:
        """Close; a second time does nothing."""
        ...


class SendQueue:
    """What a slow byte stream has not taken yet: pieces go out whole and in order, or not at all.

    Attributes:
        queued_bytes: waiting.
        taken_bytes: what the stream took in all.
    """

    __slots__ = ("_counters", "_limit_bytes", "_pieces", "queued_bytes", "taken_bytes")

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
        """Send `data` behind what is queued; `write` returns how much it took and raises BlockingIOError."""
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
        """Send as much as the stream takes now."""
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
        """The stream is gone: what was queued is dropped."""
        self._counters.dropped += len(self._pieces)
        self._counters.bytes_dropped += self.queued_bytes
        self._pieces.clear()
        self.queued_bytes = 0
