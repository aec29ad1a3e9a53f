"""MAVLink FTP of an autopilot without a file system.

Both firmwares say that they speak FTP (MAV_PROTOCOL_CAPABILITY_FTP), so clients ask for files first: MAVProxy
and QGroundControl for ArduPilot's packed parameters, QGroundControl for PX4's component metadata. Refused at
once, they fall back to the other protocols; without an answer they wait through all their time-outs.

Source: MAVLink file transfer protocol (header, opcodes, error codes), https://mavlink.io/en/services/ftp.html.
"""

import struct
from enum import IntEnum
from typing import Final

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.services.channel import MavlinkMessage, Source

_HEADER: Final = struct.Struct("<HBBBBBxI")
"""Sequence, session, opcode, size, requested opcode, burst complete, offset."""
_PAYLOAD_BYTES: Final = 251


class Opcode(IntEnum):
    """Requests and replies."""

    NONE = 0
    TERMINATE_SESSION = 1
    RESET_SESSIONS = 2
    LIST_DIRECTORY = 3
    OPEN_FILE_RO = 4
    READ_FILE = 5
    CREATE_FILE = 6
    WRITE_FILE = 7
    REMOVE_FILE = 8
    CREATE_DIRECTORY = 9
    REMOVE_DIRECTORY = 10
    OPEN_FILE_WO = 11
    TRUNCATE_FILE = 12
    RENAME = 13
    CALC_FILE_CRC32 = 14
    BURST_READ_FILE = 15
    ACK = 128
    NAK = 129


class FtpError(IntEnum):
    """First data byte of a refusal."""

    INVALID_SESSION = 4
    END_OF_FILE = 6
    UNKNOWN_COMMAND = 7
    FILE_PROTECTED = 9
    FILE_NOT_FOUND = 10


_ROOT: Final = frozenset({b"", b"/", b"."})
_ACCEPTED: Final = frozenset({Opcode.NONE, Opcode.TERMINATE_SESSION, Opcode.RESET_SESSIONS})
_REFUSALS: Final = {
    Opcode.OPEN_FILE_RO: FtpError.FILE_NOT_FOUND,
    Opcode.READ_FILE: FtpError.INVALID_SESSION,
    Opcode.CREATE_FILE: FtpError.FILE_PROTECTED,
    Opcode.WRITE_FILE: FtpError.INVALID_SESSION,
    Opcode.REMOVE_FILE: FtpError.FILE_NOT_FOUND,
    Opcode.CREATE_DIRECTORY: FtpError.FILE_PROTECTED,
    Opcode.REMOVE_DIRECTORY: FtpError.FILE_NOT_FOUND,
    Opcode.OPEN_FILE_WO: FtpError.FILE_PROTECTED,
    Opcode.TRUNCATE_FILE: FtpError.FILE_NOT_FOUND,
    Opcode.RENAME: FtpError.FILE_NOT_FOUND,
    Opcode.CALC_FILE_CRC32: FtpError.FILE_NOT_FOUND,
    Opcode.BURST_READ_FILE: FtpError.INVALID_SESSION,
}


class FileTransferService:
    """Answers every request as a file system with one empty directory."""

    def handle(self, message: MavlinkMessage, source: Source, time_us: int) -> bool:
        """Take FILE_TRANSFER_PROTOCOL; replies from others (ACK, NAK) are let pass."""
        if message.get_msgId() != mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL:
            return False
        request = bytes(message.payload)
        sequence, session, opcode, size, *_, offset = _HEADER.unpack_from(request)
        if opcode in (Opcode.ACK, Opcode.NAK):
            return True
        error = refusal(opcode, request[_HEADER.size : _HEADER.size + size])
        reply = Opcode.ACK if error is None else Opcode.NAK
        data = b"" if error is None else bytes((error,))
        payload = _HEADER.pack(sequence + 1 & 0xFFFF, session, reply, len(data), opcode, 0, offset) + data
        source.channel.send(
            mavlink.MAVLink_file_transfer_protocol_message(
                0, source.system_id, source.component_id, payload.ljust(_PAYLOAD_BYTES, b"\0")
            )
        )
        return True


def refusal(opcode: int, data: bytes) -> FtpError | None:
    """Why a request is refused; None when it is not."""
    if opcode in _ACCEPTED:
        return None
    if opcode == Opcode.LIST_DIRECTORY:
        return FtpError.END_OF_FILE if data.rstrip(b"\0") in _ROOT else FtpError.FILE_NOT_FOUND
    return _REFUSALS.get(opcode, FtpError.UNKNOWN_COMMAND)  # type: ignore[call-overload]
