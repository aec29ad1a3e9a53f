"""A client of the file transfer service, message by message."""

import struct
from typing import Any

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.files.file_transfer import FileTransferService
from autopilot_bridge.services.files.ftp_protocol import Opcode
from autopilot_bridge.storage import FileStore, MemoryStore
from tests.services.dispatch import deliver

HEADER = struct.Struct("<HBBBBBBI")
TICK_US = 20_000


class Reply:
    """A reply as the asker decodes it."""

    def __init__(self, payload: bytes) -> None:
        header = HEADER.unpack_from(payload)
        self.sequence, self.session, self.opcode, size, self.requested, self.complete, _, self.offset = header
        self.data = payload[HEADER.size : HEADER.size + size]
        self.whole = payload

    @property
    def error(self) -> tuple[int, ...] | None:
        """What a NAK says; None for an ACK."""
        assert self.opcode in (Opcode.ACK, Opcode.NAK)
        return tuple(self.data) if self.opcode == Opcode.NAK else None


class Link:
    """A channel that keeps what is sent."""

    def __init__(self, name: str = "link") -> None:
        self.name = name
        self.congested = False
        self.sent: list[Any] = []

    def send(self, message: Any, /) -> None:
        self.sent.append(message)


class FtpRig:
    """A service and its clients."""

    def __init__(self, files: FileStore | None = None) -> None:
        self.files = MemoryStore() if files is None else files
        self.service = FileTransferService(self.files)
        self.link = Link()
        self.time_us = 0
        self.sequence = 100

    def send(
        self,
        opcode: int,
        data: bytes = b"",
        *,
        session: int = 0,
        offset: int = 0,
        size: int | None = None,
        sequence: int | None = None,
        client: int = 255,
        link: Link | None = None,
    ) -> list[Reply]:
        """Send a request, whose bytes go over the wire; what is answered at once."""
        if sequence is None:
            self.sequence += 2
            sequence = self.sequence
        length = len(data) if size is None else size
        header = HEADER.pack(sequence & 0xFFFF, session, opcode, length, 0, 0, 0, offset)
        return self.send_raw(header + data, client=client, link=link)

    def send_raw(self, payload: bytes, *, client: int = 255, link: Link | None = None) -> list[Reply]:
        link = link or self.link
        message = mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload.ljust(251, b"\0"))
        (frame,) = FrameParser().feed(FrameEncoder(client, 190).encode(message))
        assert deliver(decode(frame), Source(link, client, 190), self.time_us, self.service)
        return self.take(link)

    def ask(self, opcode: int, data: bytes = b"", **more: Any) -> Reply:
        """A request with exactly one reply."""
        (reply,) = self.send(opcode, data, **more)
        return reply

    def run(self, ticks: int = 1) -> list[Reply]:
        """What comes by itself."""
        for _ in range(ticks):
            self.time_us += TICK_US
            self.service.tick(self.time_us)
        return self.take(self.link)

    def take(self, link: Link) -> list[Reply]:
        sent, link.sent = link.sent, []
        replies = []
        for message in sent:
            (frame,) = FrameParser().feed(FrameEncoder(1, 1).encode(message))
            replies.append(Reply(bytes(decode(frame).payload)))  # type: ignore[attr-defined]
        return replies

    def put(self, name: bytes, data: bytes) -> None:
        """Write a file as a client does."""
        session = self.ask(Opcode.CREATE_FILE, name).session
        for start in range(0, len(data), 239):
            piece = data[start : start + 239]
            assert self.ask(Opcode.WRITE_FILE, piece, session=session, offset=start).error is None
        assert self.ask(Opcode.TERMINATE_SESSION, session=session).error is None
