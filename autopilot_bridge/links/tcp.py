"""TCP links."""

import socket
import sys
from collections.abc import Callable
from typing import Final

from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.errors import LinkError
from autopilot_bridge.links.address import TcpClient, TcpServer
from autopilot_bridge.links.link import MAX_READS, READ_SIZE, LinkCounters, PeerId, SendQueue, open_error
from autopilot_bridge.links.readiness import writable

CONNECT_TIMEOUT_S: Final = 5.0
RECONNECT_INTERVAL_S: Final = 1.0
MAX_CLIENTS: Final = 32
CLIENT_READ_SIZE: Final = 8192
"""Bytes read from one client of a server at once; the rest waits in the operating system."""
REPLACE_S: Final = 5.0
STALLED_S: Final = 2.0
DEAF_S: Final = 60.0
_BACKLOG: Final = 16


class TcpServerLink:
    """A listening port; every client is a peer with its own byte stream.

    There are at most `MAX_CLIENTS`. A new client replaces one that has sent nothing for `REPLACE_S`; without
    such a client, the new one is refused. A client that reads no data for `STALLED_S` no longer delays the
    others (`congested`), and is disconnected after `DEAF_S`.

    Args:
        address: where to listen.
        monotonic: wall clock in seconds, to detect clients that do not send or do not read.

    Raises:
        LinkError: the port is busy or the host unknown.
    """

    def __init__(self, address: TcpServer, *, monotonic: Callable[[], float] = wall_time_s) -> None:
        self._monotonic = monotonic
        self.counters = LinkCounters()
        self._clients: dict[PeerId, _Stream] = {}
        self._listener: socket.socket | None = _listen(address)
        self.host, self.port = self._listener.getsockname()[:2]
        self.description = str(TcpServer(address.host, self.port))

    @property
    def peers(self) -> tuple[PeerId, ...]:
        """Connected clients."""
        return tuple(self._clients)

    @property
    def congested(self) -> bool:
        """True while any client reads too slowly, except clients that do not read at all."""
        return any(
            client.queue.congested and client.deaf_s(self._monotonic()) < STALLED_S
            for client in self._clients.values()
        )

    def send(self, data: bytes, to: PeerId | None = None) -> None:
        """Send to one client or to all of them."""
        for peer in tuple(self._clients) if to is None else (to,):
            client = self._clients.get(peer)
            if client is None:
                self.counters.dropped += 1
                self.counters.bytes_dropped += len(data)
            elif not client.send(data):
                self._drop(peer)

    def receive(self) -> list[tuple[PeerId, bytes]]:
        """Accept waiting clients; returns all received bytes, by client."""
        self._accept()
        received: list[tuple[PeerId, bytes]] = []
        for peer, client in tuple(self._clients.items()):
            before = len(received)
            alive = client.receive(peer, received, 1, CLIENT_READ_SIZE)
            if len(received) > before:
                client.received_s = self._monotonic()
            if not alive or (client.queue.congested and client.deaf_s(self._monotonic()) > DEAF_S):
                self._drop(peer)
        return received

    def filenos(self) -> tuple[int, ...]:
        """The listening socket and one for each client."""
        if self._listener is None:
            return ()
        return (self._listener.fileno(), *(client.socket.fileno() for client in self._clients.values()))

    def close(self) -> None:
        """Stop listening and disconnect every client."""
        if self._listener is not None:
            self._listener.close()
            self._listener = None
        for peer in tuple(self._clients):
            self._drop(peer)

    def _accept(self) -> None:
        for _ in range(_BACKLOG):
            if self._listener is None:
                return
            try:
                opened, peer = self._listener.accept()
            except (BlockingIOError, InterruptedError):
                return
            except OSError:  # the client has disconnected while waiting
                self.counters.errors += 1
                return
            if len(self._clients) >= MAX_CLIENTS and not self._make_room():
                self.counters.errors += 1
                opened.close()
                continue
            self.counters.connects += 1
            self._clients[peer[:2]] = stream = _Stream(opened, self.counters)
            stream.received_s = stream.taken_s = self._monotonic()

    def _make_room(self) -> bool:
        silent = min(self._clients, key=lambda peer: self._clients[peer].received_s)
        if self._monotonic() - self._clients[silent].received_s < REPLACE_S:
            return False
        self._drop(silent)
        return True

    def _drop(self, peer: PeerId) -> None:
        self._clients.pop(peer).close()
        self.counters.disconnects += 1


class TcpClientLink:
    """A connection to a TCP server. When it breaks, `receive` tries to open it again, at most once a second.

    Args:
        address: the server.
        monotonic: wall clock in seconds, for the time between attempts.
        connect_timeout_s: how long the first connection may take.

    Raises:
        LinkError: no server answers at the address.
    """

    def __init__(
        self,
        address: TcpClient,
        *,
        monotonic: Callable[[], float] = wall_time_s,
        connect_timeout_s: float = CONNECT_TIMEOUT_S,
    ) -> None:
        self.description = str(address)
        self.counters = LinkCounters()
        self._peer: PeerId = (address.host, address.port)
        self._monotonic = monotonic
        self._last_attempt_s = monotonic()
        self._connecting: socket.socket | None = None
        self._closed = False
        try:
            opened = socket.create_connection(self._peer, connect_timeout_s)
        except (OSError, UnicodeError) as error:
            raise _refused(self.description, error) from error
        try:
            self._family, self._remote = opened.family, opened.getpeername()
            self._stream: _Stream | None = _Stream(opened, self.counters)
        except OSError as error:  # the server has reset the connection at once
            opened.close()
            raise _refused(self.description, error) from error
        self.counters.connects += 1

    @property
    def connected(self) -> bool:
        """The connection is open."""
        return self._stream is not None

    @property
    def peers(self) -> tuple[PeerId, ...]:
        """The server, while connected."""
        return (self._peer,) if self._stream is not None else ()

    @property
    def congested(self) -> bool:
        """True while the server reads too slowly."""
        return self._stream is not None and self._stream.queue.congested

    def send(self, data: bytes, to: PeerId | None = None) -> None:
        """Send to the server; the data are dropped while not connected."""
        if self._stream is None:
            self.counters.dropped += 1
            self.counters.bytes_dropped += len(data)
        elif not self._stream.send(data):
            self._disconnect()

    def receive(self) -> list[tuple[PeerId, bytes]]:
        """All received bytes."""
        received: list[tuple[PeerId, bytes]] = []
        if self._closed:
            return received
        if self._stream is None and not self._reconnect():
            return received
        if self._stream is not None and not self._stream.receive(self._peer, received):
            self._disconnect()
        return received

    def filenos(self) -> tuple[int, ...]:
        """The connection, while it is open."""
        return () if self._stream is None else (self._stream.socket.fileno(),)

    def close(self) -> None:
        """Close the connection permanently."""
        self._closed = True
        if self._connecting is not None:
            self._connecting.close()
            self._connecting = None
        if self._stream is not None:
            self._disconnect()

    def _disconnect(self) -> None:
        assert self._stream is not None
        self._stream.close()
        self._stream = None
        self.counters.disconnects += 1
        self._last_attempt_s = self._monotonic()

    def _reconnect(self) -> bool:
        if self._connecting is None:
            if self._monotonic() - self._last_attempt_s < RECONNECT_INTERVAL_S:
                return False
            self._last_attempt_s = self._monotonic()
            self._connecting = socket.socket(self._family, socket.SOCK_STREAM)
            self._connecting.setblocking(False)
            self._connecting.connect_ex(self._remote)
        if not writable(self._connecting.fileno()):
            if self._monotonic() - self._last_attempt_s > CONNECT_TIMEOUT_S:
                self._give_up_attempt()
            return False
        if self._connecting.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) != 0:
            self._give_up_attempt()
            return False
        self._stream = _Stream(self._connecting, self.counters)
        self._connecting = None
        self.counters.connects += 1
        return True

    def _give_up_attempt(self) -> None:
        assert self._connecting is not None
        self._connecting.close()
        self._connecting = None
        self.counters.errors += 1


class _Stream:
    """One open connection.

    Attributes:
        socket: as opened.
        queue: data not accepted yet.
        received_s: time of the last received data.
        taken_s: time at which it last accepted queued data, as far as this was checked.
    """

    def __init__(self, opened: socket.socket, counters: LinkCounters) -> None:
        opened.setblocking(False)
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket = opened
        self.queue = SendQueue(counters)
        self.received_s = self.taken_s = 0.0
        self._taken_bytes = 0
        self._counters = counters

    def deaf_s(self, now_s: float) -> float:
        """The time for which it has accepted none of its queued data."""
        queue = self.queue
        if queue.taken_bytes != self._taken_bytes or not queue.queued_bytes:
            self.taken_s = now_s
        self._taken_bytes = queue.taken_bytes
        return now_s - self.taken_s

    def send(self, data: bytes) -> bool:
        """False when the connection is broken."""
        try:
            self.queue.send(data, self.socket.send)
        except OSError:
            self._counters.errors += 1
            return False
        return True

    def receive(
        self,
        peer: PeerId,
        received: list[tuple[PeerId, bytes]],
        reads: int = MAX_READS,
        size: int = READ_SIZE,
    ) -> bool:
        """Append the received data; False when the connection is closed or broken."""
        counters = self._counters
        try:
            self.queue.flush(self.socket.send)
            for _ in range(reads):
                data = self.socket.recv(size)
                if not data:
                    return False
                counters.reads += 1
                counters.bytes_in += len(data)
                received.append((peer, data))
        except (BlockingIOError, InterruptedError):
            return True
        except OSError:
            counters.errors += 1
            return False
        return True

    def close(self) -> None:
        self.queue.clear()
        self.socket.close()


def _listen(address: TcpServer) -> socket.socket:
    try:
        family, kind, _, _, target = socket.getaddrinfo(
            address.host, address.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except (OSError, UnicodeError) as error:
        raise _refused(str(address), error) from error
    listener = socket.socket(family, kind)
    listener.setblocking(False)
    if sys.platform == "win32":  # there SO_REUSEADDR would let a second server take the port
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
    else:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(target)
        listener.listen(_BACKLOG)
    except OSError as error:
        listener.close()
        raise open_error(str(address), error) from error
    return listener


def _refused(address: str, error: Exception) -> LinkError:
    if isinstance(error, socket.gaierror | UnicodeError):
        return LinkError(f"can't open {address}: the host is unknown; check the name or give an IP address")
    if isinstance(error, TimeoutError):
        return LinkError(f"can't open {address}: no answer; check the host and the port")
    assert isinstance(error, OSError)
    return open_error(address, error)
