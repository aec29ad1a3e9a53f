"""The clients of the file transfer, their open files, and the last replies sent to them."""

import contextlib
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from autopilot_bridge.services.channel import Channel, Source
from autopilot_bridge.services.files.ftp_protocol import FtpError, FtpRefusal, Request
from autopilot_bridge.storage import OpenFile

MAX_SESSIONS: Final = 16
MAX_SESSIONS_PER_CLIENT: Final = 4
MAX_CLIENTS: Final = 32
IDLE_US: Final = 60_000_000
"""A session that is not used for this time is closed."""
GIVEN_UP_US: Final = 10_000_000
"""A session that is not used for this time is closed when another client needs the place."""
REPEAT_US: Final = 10_000_000
"""For this time, a repeated request (equal in every byte) gets the same reply and is not executed again."""
_MAX_REPLIES: Final = 16


@dataclass(slots=True)
class Burst:
    """A read burst in progress.

    Attributes:
        request: the client's request.
        offset: offset of the next bytes.
        size: bytes in one reply.
        sequence: sequence number of the reply before the next.
        left: replies left in this burst.
    """

    request: Request
    offset: int
    size: int
    sequence: int
    left: int


@dataclass(slots=True)
class Session:
    """An open file of a client."""

    number: int
    file: OpenFile
    writable: bool
    used_us: int
    burst: Burst | None = None

    def close(self) -> None:
        """Close the file.

        Raises:
            OSError: the written data are not accepted.
        """
        self.burst = None
        self.file.close()


@dataclass(slots=True)
class Client:
    """One client: a component on a channel.

    Attributes:
        channel, system_id, component_id: identity of the client.
        sessions: its open sessions, by number.
        replies: the last replies sent to it: request bytes -> time, and the reply.
        seen_us: time of its last request.
    """

    channel: Channel
    system_id: int
    component_id: int
    seen_us: int
    sessions: dict[int, Session] = field(default_factory=dict)
    replies: "OrderedDict[bytes, tuple[int, bytes]]" = field(default_factory=OrderedDict)

    def repeated(self, request: bytes, time_us: int) -> bytes | None:
        """The reply to a request that was answered a short time ago; None for a new request."""
        answered = self.replies.get(request)
        return answered[1] if answered is not None and time_us - answered[0] <= REPEAT_US else None

    def remember(self, request: bytes, reply: bytes, time_us: int) -> None:
        """Keep a reply for a repeated request."""
        self.replies[request] = (time_us, reply)
        self.replies.move_to_end(request)
        if len(self.replies) > _MAX_REPLIES:
            self.replies.popitem(last=False)

    def session(self, number: int, time_us: int) -> Session:
        """An open session, marked as used now; `FtpRefusal` when no session has that number."""
        session = self.sessions.get(number)
        if session is None:
            raise FtpRefusal.of(FtpError.INVALID_SESSION)
        session.used_us = time_us
        return session

    def close_all(self) -> None:
        """Close every session; errors in closing are ignored."""
        for session in self.sessions.values():
            with contextlib.suppress(OSError):
                session.close()
        self.sessions.clear()


class Clients:
    """All clients and their sessions."""

    def __init__(self) -> None:
        self._clients: dict[tuple[str, int, int], Client] = {}

    def __iter__(self) -> Iterator[Client]:
        return iter(self._clients.values())

    def client(self, source: Source, time_us: int) -> Client:
        """The client that sent a message; a new client replaces the one that was idle longest."""
        key = (source.channel.name, source.system_id, source.component_id)
        client = self._clients.get(key)
        if client is None or client.channel is not source.channel:
            if client is not None:
                client.close_all()
            elif len(self._clients) >= MAX_CLIENTS:
                oldest = min(self._clients, key=lambda each: self._age(self._clients[each]))
                self._clients.pop(oldest).close_all()
            client = Client(source.channel, source.system_id, source.component_id, time_us)
            self._clients[key] = client
        client.seen_us = time_us
        return client

    @staticmethod
    def _age(client: Client) -> tuple[bool, int]:
        return bool(client.sessions), client.seen_us

    def make_room(self, client: Client, time_us: int) -> None:
        """Ensure that a client may open one more file; `FtpRefusal` when there are too many."""
        if len(client.sessions) >= MAX_SESSIONS_PER_CLIENT:
            self._close_idle(time_us - GIVEN_UP_US, client)
        if sum(len(each.sessions) for each in self) >= MAX_SESSIONS:
            self._close_idle(time_us - GIVEN_UP_US)
        if (
            len(client.sessions) >= MAX_SESSIONS_PER_CLIENT
            or sum(len(each.sessions) for each in self) >= MAX_SESSIONS
        ):
            raise FtpRefusal.of(FtpError.NO_SESSIONS_AVAILABLE)

    def close_idle(self, time_us: int) -> None:
        """Close sessions that were not used for a minute, and forget clients without sessions."""
        self._close_idle(time_us - IDLE_US)
        for key, client in list(self._clients.items()):
            if not client.sessions and client.seen_us < time_us - IDLE_US:
                del self._clients[key]

    def _close_idle(self, before_us: int, only: Client | None = None) -> None:
        for client in self if only is None else (only,):
            for number, session in list(client.sessions.items()):
                if session.used_us < before_us:
                    del client.sessions[number]
                    with contextlib.suppress(OSError):
                        session.close()
