"""MAVLink FTP: the vehicle's files for ground stations.

Every client (system and component on a channel) has its own sessions. A client repeats a request when the
reply was lost; it then gets the same reply, and the request is not executed twice. Bursts and checksums of
long files are processed in pieces at 50 Hz, so that they neither block the vehicle nor overload a link.

A session gets the number that the client proposes if it is free, else the lowest free one: PX4's clients use
the number in the reply, ArduPilot's expect the one that they have sent.

Source: MAVLink file transfer protocol, https://mavlink.io/en/services/ftp.html.
"""

import errno
from collections.abc import Callable, Mapping
from typing import Final

from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Source, is_congested
from autopilot_bridge.services.files.ftp_protocol import (
    HEADER,
    MAX_DATA,
    FtpError,
    FtpRefusal,
    Opcode,
    Request,
    crc32,
    parse_request,
    reply_payload,
    uint32,
)
from autopilot_bridge.services.files.ftp_sessions import Burst, Client, Clients, Session
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.storage import FileStore, Mode, OpenFile, parse_path

BURST_REPLIES: Final = 100
"""Replies in one burst. The client then requests the next one, so no simulation speed floods it."""
REPLIES_PER_TICK: Final = 20
"""On one channel: 240 kB/s of vehicle time, as over USB."""
_CHECKSUM_BYTES_PER_TICK: Final = 512 * 1024
_CHECK_US: Final = 1_000_000
_MAX_SESSION: Final = 256
_NOT_REPEATED: Final = frozenset(
    {
        Opcode.TERMINATE_SESSION,
        Opcode.OPEN_FILE_RO,
        Opcode.OPEN_FILE_WO,
        Opcode.CREATE_FILE,
        Opcode.REMOVE_FILE,
        Opcode.CREATE_DIRECTORY,
        Opcode.REMOVE_DIRECTORY,
        Opcode.RENAME,
    }
)
"""Requests whose second execution would have a different effect."""

_Reply = tuple[bytes, int | None]
"""Data of an acknowledgement, and its session number (None: as in the request)."""


class _Checksum:
    """A running checksum computation of a long file."""

    def __init__(self, client: Client, request: Request, file: OpenFile) -> None:
        self.client = client
        self.request = request
        self.file = file
        self.offset = 0
        self.crc = 0


class FileTransferService(Microservice):
    """Answers FILE_TRANSFER_PROTOCOL from a tree of files.

    Args:
        files: the tree of files.
    """

    def __init__(self, files: FileStore) -> None:
        self._files = files
        self._clients = Clients()
        self._checksums: list[_Checksum] = []
        self._bursting = False
        self._next_check_us = 0
        self._handlers: Mapping[int, Callable[[Client, Request, int], _Reply | None]] = {
            Opcode.NONE: lambda client, request, time_us: (b"", None),
            Opcode.TERMINATE_SESSION: self._terminate,
            Opcode.RESET_SESSIONS: self._reset,
            Opcode.LIST_DIRECTORY: self._list,
            Opcode.OPEN_FILE_RO: self._opener(Mode.READ),
            Opcode.OPEN_FILE_WO: self._opener(Mode.WRITE),
            Opcode.CREATE_FILE: self._opener(Mode.REPLACE),
            Opcode.READ_FILE: self._read,
            Opcode.BURST_READ_FILE: self._burst,
            Opcode.WRITE_FILE: self._write,
            Opcode.REMOVE_FILE: lambda client, request, time_us: self._at_path(request, files.remove),
            Opcode.CREATE_DIRECTORY: lambda client, request, time_us: self._at_path(
                request, files.make_directory
            ),
            Opcode.REMOVE_DIRECTORY: lambda client, request, time_us: self._at_path(
                request, files.remove_directory
            ),
            Opcode.TRUNCATE_FILE: lambda client, request, time_us: self._at_path(
                request, lambda path: files.truncate(path, request.offset)
            ),
            Opcode.RENAME: self._rename,
            Opcode.CALC_FILE_CRC32: self._checksum,
        }

    @receives(dialect.MAVLink_file_transfer_protocol_message)
    def on_transfer(
        self, message: dialect.MAVLink_file_transfer_protocol_message, source: Source, time_us: int
    ) -> None:
        """Answer a request; replies (ACK, NAK) of other systems are ignored."""
        payload = bytes(message.payload)
        request = parse_request(payload)
        if request.opcode in (Opcode.ACK, Opcode.NAK):
            return
        client = self._clients.client(source, time_us)
        raw = payload[: HEADER.size + request.size]
        reply = client.repeated(raw, time_us)
        if reply is None:
            reply = self._answer(client, request, time_us)
            if reply is not None and request.opcode in _NOT_REPEATED:
                client.remember(raw, reply, time_us)
        if reply is not None:
            _send(client, reply)

    def tick(self, time_us: int) -> None:
        """Continue bursts and checksums; close idle sessions."""
        if self._bursting:
            self._bursting = False
            for client in tuple(self._clients):  # a copy: an answer may change the list
                self._continue_bursts(client)
        if self._checksums:
            self._continue_checksum()
        if time_us >= self._next_check_us:
            self._next_check_us = time_us + _CHECK_US
            self._clients.close_idle(time_us)

    def close(self) -> None:
        """Close every session."""
        for client in self._clients:
            client.close_all()
        for work in self._checksums:
            work.file.close()
        self._checksums.clear()

    def _answer(self, client: Client, request: Request, time_us: int) -> bytes | None:
        """The reply to a request; None when the reply is sent later."""
        try:
            handler = self._handlers.get(request.opcode)
            if handler is None:
                raise FtpRefusal.of(FtpError.UNKNOWN_COMMAND)
            if request.size > MAX_DATA and request.opcode not in (Opcode.READ_FILE, Opcode.BURST_READ_FILE):
                raise FtpRefusal.of(FtpError.INVALID_DATA_SIZE)
            done = handler(client, request, time_us)
        except FtpRefusal as refusal:
            return reply_payload(request, Opcode.NAK, refusal.data)
        except OSError as failure:
            return reply_payload(request, Opcode.NAK, FtpRefusal.of_os_error(failure).data)
        return None if done is None else reply_payload(request, Opcode.ACK, done[0], session=done[1])

    # sessions

    def _opener(self, mode: Mode) -> Callable[[Client, Request, int], _Reply]:
        def open_file(client: Client, request: Request, time_us: int) -> _Reply:
            path = parse_path(request.data)
            self._clients.make_room(client, time_us)
            file = self._files.open(path, mode)
            number = request.session
            if number in client.sessions:
                number = next(free for free in range(_MAX_SESSION) if free not in client.sessions)
            client.sessions[number] = Session(number, file, mode is not Mode.READ, time_us)
            return uint32(file.size), number

        return open_file

    def _terminate(self, client: Client, request: Request, time_us: int) -> _Reply:
        session = client.session(request.session, time_us)
        del client.sessions[request.session]
        client.replies.clear()
        session.close()
        return b"", None

    def _reset(self, client: Client, request: Request, time_us: int) -> _Reply:
        client.close_all()
        client.replies.clear()
        return b"", None

    # files

    def _list(self, client: Client, request: Request, time_us: int) -> _Reply:
        entries = self._files.entries(parse_path(request.data))
        data = b""
        for entry in entries[request.offset :]:
            text = f"D{entry.name}" if entry.is_directory else f"F{entry.name}\t{entry.size}"
            line = text.encode() + b"\0"
            if len(line) > MAX_DATA:
                line = b"S\0"  # a name too long for a reply still counts as an entry
            if len(data) + len(line) > MAX_DATA:
                break
            data += line
        if not data:
            raise FtpRefusal.of(FtpError.END_OF_FILE)
        return data, None

    def _read(self, client: Client, request: Request, time_us: int) -> _Reply:
        session = _readable(client.session(request.session, time_us))
        data = session.file.read(request.offset, _chunk(request))
        if not data:
            raise FtpRefusal.of(FtpError.END_OF_FILE)
        return data, None

    def _burst(self, client: Client, request: Request, time_us: int) -> None:
        session = _readable(client.session(request.session, time_us))
        session.burst = Burst(request, request.offset, _chunk(request), request.sequence, BURST_REPLIES)
        self._bursting = True

    def _write(self, client: Client, request: Request, time_us: int) -> _Reply:
        session = client.session(request.session, time_us)
        if not session.writable:
            raise OSError(errno.EBADF, "not open for writing")
        session.file.write(request.offset, request.data)
        return uint32(len(request.data)), None

    def _at_path(self, request: Request, do: Callable[[tuple[str, ...]], None]) -> _Reply:
        do(parse_path(request.data))
        return b"", None

    def _rename(self, client: Client, request: Request, time_us: int) -> _Reply:
        old, separator, new = request.data.partition(b"\0")
        if not separator or not new.rstrip(b"\0"):
            raise FtpRefusal.of(FtpError.INVALID_DATA_SIZE)
        self._files.rename(parse_path(old), parse_path(new))
        return b"", None

    def _checksum(self, client: Client, request: Request, time_us: int) -> None:
        """Reply when the file was read; a request repeated before that starts no second computation."""
        if not any(work.client is client and work.request == request for work in self._checksums):
            path = parse_path(request.data)
            self._clients.make_room(client, time_us)
            file = self._files.open(path, Mode.READ)
            for work in [work for work in self._checksums if work.client is client]:
                work.file.close()
                self._checksums.remove(work)
            self._checksums.append(_Checksum(client, request, file))

    # continued by the tick

    def _continue_bursts(self, client: Client) -> None:
        bursting = [session for session in client.sessions.values() if session.burst is not None]
        for session in bursting:
            for _ in range(max(1, REPLIES_PER_TICK // len(bursting))):
                if session.burst is None or is_congested(client.channel):
                    break
                self._send_piece(client, session, session.burst)
        self._bursting |= any(session.burst is not None for session in bursting)

    def _send_piece(self, client: Client, session: Session, burst: Burst) -> None:
        refusal = FtpRefusal.of(FtpError.END_OF_FILE)
        try:
            data = session.file.read(burst.offset, burst.size)
        except OSError as failure:
            data, refusal = b"", FtpRefusal.of_os_error(failure)
        burst.left -= 1
        if not data or burst.left == 0:
            session.burst = None
        _send(
            client,
            reply_payload(
                burst.request,
                Opcode.ACK if data else Opcode.NAK,
                data or refusal.data,
                sequence=burst.sequence,
                offset=burst.offset,
                burst_complete=session.burst is None,
            ),
        )
        burst.sequence = burst.sequence + 1 & 0xFFFF
        burst.offset += len(data)

    def _continue_checksum(self) -> None:
        work = self._checksums[0]
        try:
            data = work.file.read(work.offset, _CHECKSUM_BYTES_PER_TICK)
        except OSError as failure:
            reply = reply_payload(work.request, Opcode.NAK, FtpRefusal.of_os_error(failure).data)
        else:
            work.crc = crc32(data, work.crc)
            work.offset += len(data)
            if len(data) == _CHECKSUM_BYTES_PER_TICK:
                return
            reply = reply_payload(work.request, Opcode.ACK, uint32(work.crc))
        work.file.close()
        self._checksums.pop(0)
        _send(work.client, reply)


def _readable(session: Session) -> Session:
    if session.writable:
        raise OSError(errno.EBADF, "open for writing only")
    return session


def _chunk(request: Request) -> int:
    """Bytes in a reply: the requested number, as far as they fit; 0 requests as many as fit."""
    return min(request.size or MAX_DATA, MAX_DATA)


def _send(client: Client, payload: bytes) -> None:
    client.channel.send(
        dialect.MAVLink_file_transfer_protocol_message(0, client.system_id, client.component_id, payload)
    )
