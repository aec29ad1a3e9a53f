"""Links inside one process."""

from collections import deque
from collections.abc import Callable
from typing import Final

from autopilot_bridge.links.link import LinkCounters, PeerId
from autopilot_bridge.mavlink.packet import Packet

MAX_INBOX: Final = 100_000


class MemoryLink:
    """One end of a pair. What one end sends, the other receives, in order, at once.

    Args:
        name: for descriptions; the other end sees this name as its peer.

    Attributes:
        on_receive: when set, is called with the bytes at the moment the other end sends them; `receive` then
            returns nothing.
        on_packet: when set, is called instead with packets, if the other end sends packets and not bytes.
    """

    def __init__(self, name: str, on_receive: Callable[[bytes], None] | None = None) -> None:
        self.name = name
        self.on_receive = on_receive
        self.on_packet: Callable[[Packet], None] | None = None
        self._writes = self._bytes_out = self._dropped = self._bytes_dropped = 0
        self.closed = False
        self._inbox: deque[bytes] = deque()
        self._other: MemoryLink | None = None
        self._peer: PeerId = (name, 0)

    @property
    def description(self) -> str:
        """`memory:` and the name of this end."""
        return f"memory:{self.name}"

    @property
    def peers(self) -> tuple[PeerId, ...]:
        """The other end, while it is open."""
        return () if self._other is None or self._other.closed else (self._peer,)

    @property
    def congested(self) -> bool:
        """Never."""
        return False

    @property
    def counters(self) -> LinkCounters:
        """Counters so far: the data that one end sent, the other has received."""
        other = self._other
        return LinkCounters(
            bytes_in=0 if other is None else other._bytes_out,
            bytes_out=self._bytes_out,
            reads=0 if other is None else other._writes,
            writes=self._writes,
            dropped=self._dropped,
            bytes_dropped=self._bytes_dropped,
        )

    def send(self, data: bytes, to: PeerId | None = None) -> None:
        """Pass bytes to the other end."""
        other = self._other
        if self.closed or other is None or other.closed or len(other._inbox) >= MAX_INBOX:
            self._dropped += 1
            self._bytes_dropped += len(data)
            return
        self._writes += 1
        self._bytes_out += len(data)
        on_receive = other.on_receive
        if on_receive is not None:
            on_receive(data)
        else:
            other._inbox.append(data)

    @property
    def takes_packets(self) -> bool:
        """Whether the other end receives packets with their message ids, which need not be parsed."""
        other = self._other
        return not self.closed and other is not None and not other.closed and other.on_packet is not None

    def send_packet(self, packet: Packet) -> None:
        """Pass a packet to the other end, which must be one that `takes_packets`."""
        assert self._other is not None and self._other.on_packet is not None
        self._writes += 1
        self._bytes_out += len(packet.data)
        self._other.on_packet(packet)

    def receive(self) -> list[tuple[PeerId, bytes]]:
        """The data that the other end has sent since the last call."""
        inbox = self._inbox
        if not inbox:
            return []
        peer = self._peer
        received = [(peer, data) for data in inbox]
        inbox.clear()
        return received

    def filenos(self) -> tuple[int, ...]:
        """None."""
        return ()

    def close(self) -> None:
        """Close this end; data that the other end sends afterwards are dropped."""
        self.closed = True
        self._inbox.clear()


def memory_pair(
    name_a: str = "a",
    name_b: str = "b",
    *,
    on_receive_a: Callable[[bytes], None] | None = None,
    on_receive_b: Callable[[bytes], None] | None = None,
) -> tuple[MemoryLink, MemoryLink]:
    """Two connected links; `on_receive_a` is called for the data that arrive at the first."""
    a, b = MemoryLink(name_a, on_receive_a), MemoryLink(name_b, on_receive_b)
    a._other, b._other = b, a
    a._peer, b._peer = (name_b, 0), (name_a, 0)
    return a, b
