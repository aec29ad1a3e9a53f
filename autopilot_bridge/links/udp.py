"""UDP links."""

import contextlib
import socket
from collections.abc import Callable
from typing import Final

from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.errors import LinkError
from autopilot_bridge.links.address import UdpClient, UdpPeer, UdpServer
from autopilot_bridge.links.link import MAX_READ_BYTES, READ_SIZE, LinkCounters, PeerId, open_error

PEER_SILENCE_S: Final = 30.0
REPLACE_S: Final = 5.0
MAX_PEERS: Final = 32
_MAX_DATAGRAMS: Final = 128
_RECEIVE_BUFFER_BYTES: Final = 1 << 20


class UdpLink:
    """A UDP socket with any number of peers.

    * `UdpServer`: every sender is a peer until it has sent nothing for `silence_s`, or is forgotten. When
    there are `MAX_PEERS`, a new sender replaces a peer that has sent nothing for `REPLACE_S`; without such a
    peer, data of new senders are received but nothing is sent to them, so that many new senders can't replace
    active peers. * `UdpClient`: the remote is the only peer; data of other senders are dropped. * `UdpPeer`:
    the remote is the peer from the start; the first sender received replaces it and stays, unless it is
    forgotten. Data of others are received but nothing is sent to them (PX4).

    Args:
        address: what to open.
        monotonic: wall clock in seconds, to detect silent peers.
        silence_s: a server forgets a peer after this time without data.

    Raises:
        LinkError: the port is busy or the host unknown.
    """

    def __init__(
        self,
        address: UdpServer | UdpClient | UdpPeer,
        *,
        monotonic: Callable[[], float] = wall_time_s,
        silence_s: float = PEER_SILENCE_S,
    ) -> None:
        self._monotonic = monotonic
        self._silence_s = silence_s
        self.counters = LinkCounters()
        self._last_received_s: dict[PeerId, float] = {}
        self._partner: PeerId | None = None
        self._remote: PeerId | None = None  # the peer until the first sender is received
        self._partner_known = False
        self._learns = isinstance(address, UdpServer)
        self._is_client = isinstance(address, UdpClient)
        self._socket = _open(address)
        self._buffer = bytearray(READ_SIZE)
        self._read = memoryview(self._buffer)
        self._closed = False
        if isinstance(address, UdpClient):
            self._partner = self._socket.getpeername()[:2]
            self.description = str(address)
        else:
            host, port = self._socket.getsockname()[:2]
            if isinstance(address, UdpPeer):
                _, remote = _resolve(address.remote_host, address.remote_port, self._socket.family)
                self._partner = self._remote = remote
                self.description = str(UdpPeer(address.host, port, address.remote_host, address.remote_port))
            else:
                self.description = str(UdpServer(address.host, port))
            self.host, self.port = host, port

    @property
    def peers(self) -> tuple[PeerId, ...]:
        """The peers that data are sent to."""
        if self._partner is not None:
            return (self._partner,)
        return tuple(self._last_received_s)

    @property
    def congested(self) -> bool:
        """Never: datagrams do not queue."""
        return False

    def send(self, data: bytes, to: PeerId | None = None) -> None:
        """Send one datagram to one peer or to each of them."""
        if self._closed:
            return
        if to is not None:
            self._send_to(data, to)
            return
        if self._learns:
            self._forget_silent()
            for peer in tuple(self._last_received_s):
                self._send_to(data, peer)
        elif self._partner is not None:
            self._send_to(data, self._partner)

    def receive(self) -> list[tuple[PeerId, bytes]]:
        """All received datagrams (at most 128 of them, and a quarter of a megabyte, at once)."""
        received: list[tuple[PeerId, bytes]] = []
        if self._closed:
            return received
        counters = self.counters
        most_bytes = counters.bytes_in + MAX_READ_BYTES
        for _ in range(_MAX_DATAGRAMS):
            if counters.bytes_in > most_bytes:
                break
            try:
                size, sender = self._socket.recvfrom_into(self._buffer)
            except (BlockingIOError, InterruptedError):
                break
            except OSError:  # a datagram of ours was refused; the socket stays open
                counters.errors += 1
                continue
            counters.bytes_in += size
            counters.reads += 1
            peer: PeerId = sender[:2]
            if not self._is_client:
                self._received_from(peer)
            received.append((peer, bytes(self._read[:size])))
        return received

    def filenos(self) -> tuple[int, ...]:
        """The socket."""
        return () if self._closed else (self._socket.fileno(),)

    def close(self) -> None:
        """Close the socket."""
        self._closed = True
        self._socket.close()

    def _send_to(self, data: bytes, peer: PeerId) -> None:
        counters = self.counters
        try:
            if self._is_client:
                self._socket.send(data)
            else:
                self._socket.sendto(data, peer)
        except (BlockingIOError, InterruptedError):
            counters.dropped += 1
            counters.bytes_dropped += len(data)
        except OSError:
            counters.errors += 1
            counters.dropped += 1
            counters.bytes_dropped += len(data)
        else:
            counters.writes += 1
            counters.bytes_out += len(data)

    def _received_from(self, peer: PeerId) -> None:
        if not self._learns:
            if not self._partner_known:
                self._partner, self._partner_known = peer, True
                self.counters.connects += 1
            return
        now_s = self._monotonic()
        if peer not in self._last_received_s:
            if len(self._last_received_s) >= MAX_PEERS:
                silent = min(self._last_received_s, key=self._last_received_s.__getitem__)
                if now_s - self._last_received_s[silent] < REPLACE_S:
                    return
                self.forget(silent)
            self.counters.connects += 1
        self._last_received_s[peer] = now_s

    def forget(self, peer: PeerId) -> None:
        """Send nothing more to a peer, until data of it are received again."""
        if peer in self._last_received_s:
            del self._last_received_s[peer]
            self.counters.disconnects += 1
        elif peer == self._partner and self._partner_known:
            self._partner, self._partner_known = self._remote, False
            self.counters.disconnects += 1

    def _forget_silent(self) -> None:
        if not self._last_received_s:
            return
        oldest_s = self._monotonic() - self._silence_s
        for peer in [peer for peer, received_s in self._last_received_s.items() if received_s < oldest_s]:
            self.forget(peer)


def _resolve(host: str, port: int, family: int = 0) -> tuple[int, PeerId]:
    try:
        found = socket.getaddrinfo(host, port, family, socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        raise LinkError(f"host {host!r} is unknown; check the name or give an IP address") from error
    return found[0][0], found[0][4][:2]  # type: ignore[return-value]


def _open(address: UdpServer | UdpClient | UdpPeer) -> socket.socket:
    family, target = _resolve(address.host, address.port)
    opened = socket.socket(family, socket.SOCK_DGRAM)
    opened.setblocking(False)
    with contextlib.suppress(OSError):
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER_BYTES)
    try:
        if isinstance(address, UdpClient):
            opened.connect(target)
        else:
            opened.bind(target)
    except OSError as error:
        opened.close()
        raise open_error(str(address), error) from error
    return opened
