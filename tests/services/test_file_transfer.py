"""MAVLink FTP: everything is refused at once, in replies that fit the request."""

import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.file_transfer import FileTransferService, FtpError, Opcode

HEADER = struct.Struct("<HBBBBBBI")


class Recorder:
    name = "link"

    def __init__(self) -> None:
        self.sent: list[Any] = []

    def send(self, message: Any, /) -> None:
        self.sent.append(message)


def ask(payload: bytes) -> Any:
    """The reply to a request as the asker decodes it; None when there is none."""
    link = Recorder()
    request = mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload.ljust(251, b"\0"))
    (frame,) = FrameParser().feed(FrameEncoder(255, 190).encode(request))
    assert FileTransferService().handle(decode(frame), Source(link, 255, 190), 0)
    if not link.sent:
        return None
    (sent,) = link.sent
    (frame,) = FrameParser().feed(FrameEncoder(1, 1).encode(sent))
    reply = decode(frame)
    assert (reply.target_system, reply.target_component) == (255, 190)
    return reply


@pytest.mark.parametrize(
    ("opcode", "data", "error"),
    [
        (Opcode.OPEN_FILE_RO, b"@PARAM/param.pck", FtpError.FILE_NOT_FOUND),  # MAVProxy's first question
        (Opcode.LIST_DIRECTORY, b"/", FtpError.END_OF_FILE),
        (Opcode.LIST_DIRECTORY, b"/fs/microsd", FtpError.FILE_NOT_FOUND),
        (Opcode.READ_FILE, b"", FtpError.INVALID_SESSION),
        (Opcode.CREATE_FILE, b"x", FtpError.FILE_PROTECTED),
        (99, b"", FtpError.UNKNOWN_COMMAND),
    ],
)
def test_refusals(opcode: int, data: bytes, error: FtpError) -> None:
    reply = ask(HEADER.pack(7, 3, opcode, len(data), 0, 0, 0, 0) + data)
    sequence, session, kind, size, requested, _, _, _ = HEADER.unpack_from(bytes(reply.payload))
    assert (sequence, session, kind, size, requested) == (8, 3, Opcode.NAK, 1, opcode)
    assert reply.payload[HEADER.size] == error


@pytest.mark.parametrize("opcode", [Opcode.NONE, Opcode.RESET_SESSIONS, Opcode.TERMINATE_SESSION])
def test_sessions_can_always_be_closed(opcode: int) -> None:
    reply = ask(HEADER.pack(65535, 0, opcode, 0, 0, 0, 0, 0))
    sequence, _, kind, size, *_ = HEADER.unpack_from(bytes(reply.payload))
    assert (sequence, kind, size) == (0, Opcode.ACK, 0)


@pytest.mark.parametrize("opcode", [Opcode.ACK, Opcode.NAK])
def test_replies_are_not_answered(opcode: int) -> None:
    assert ask(HEADER.pack(1, 0, opcode, 0, 0, 0, 0, 0)) is None


@given(st.binary(max_size=251))
def test_anything_else_is_answered_too(payload: bytes) -> None:
    ask(payload)
