"""MAVLink FTP on the wire: header, opcodes, error codes, names and listings.

Source: MAVLink file transfer protocol, https://mavlink.io/en/services/ftp.html.
"""

import errno
import struct
import zlib
from enum import IntEnum
from typing import Final, NamedTuple

HEADER: Final = struct.Struct("<HBBBBBxI")
"""Sequence, session, opcode, size, requested opcode, burst complete, offset."""
PAYLOAD_BYTES: Final = 251
MAX_DATA: Final = PAYLOAD_BYTES - HEADER.size
_UINT32: Final = struct.Struct("<I")


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

    FAIL = 1
    FAIL_ERRNO = 2
    INVALID_DATA_SIZE = 3
    INVALID_SESSION = 4
    NO_SESSIONS_AVAILABLE = 5
    END_OF_FILE = 6
    UNKNOWN_COMMAND = 7
    FILE_EXISTS = 8
    FILE_PROTECTED = 9
    FILE_NOT_FOUND = 10


_OF_ERRNO: Final = {
    errno.ENOENT: FtpError.FILE_NOT_FOUND,
    errno.EEXIST: FtpError.FILE_EXISTS,
    errno.EACCES: FtpError.FILE_PROTECTED,
    errno.EPERM: FtpError.FILE_PROTECTED,
    errno.EROFS: FtpError.FILE_PROTECTED,
}


class FtpRefusal(Exception):
    """A request that can't be executed; `data` is the content of the NAK."""

    def __init__(self, data: bytes) -> None:
        super().__init__(data)
        self.data = data

    @classmethod
    def of(cls, code: FtpError) -> "FtpRefusal":
        """The refusal with an error code of the protocol."""
        return cls(bytes((code,)))

    @classmethod
    def of_os_error(cls, failure: OSError) -> "FtpRefusal":
        """The refusal with the protocol's code for a file system error, else FailErrno and the errno."""
        code = _OF_ERRNO.get(failure.errno or 0)
        if code is not None:
            return cls.of(code)
        return cls(bytes((FtpError.FAIL_ERRNO, min(failure.errno or errno.EIO, 255))))


class Request(NamedTuple):
    """A request: header fields and `size` bytes of data."""

    sequence: int
    session: int
    opcode: int
    offset: int
    data: bytes
    size: int


def parse_request(payload: bytes) -> Request:
    """The request in a payload of FILE_TRANSFER_PROTOCOL (251 bytes, so it always has a header).

    `size` is as sent; `data` holds at most the bytes that are present.
    """
    sequence, session, opcode, size, _, _, offset = HEADER.unpack_from(payload)
    return Request(sequence, session, opcode, offset, payload[HEADER.size : HEADER.size + size], size)


def reply_payload(
    request: Request,
    opcode: Opcode,
    data: bytes = b"",
    *,
    sequence: int | None = None,
    session: int | None = None,
    offset: int | None = None,
    burst_complete: bool = False,
) -> bytes:
    """The payload of a reply; fields not given are as in the request, with the next sequence number."""
    return (
        HEADER.pack(
            (request.sequence if sequence is None else sequence) + 1 & 0xFFFF,
            request.session if session is None else session,
            opcode,
            len(data),
            request.opcode,
            burst_complete,
            request.offset if offset is None else offset,
        )
        + data
    ).ljust(PAYLOAD_BYTES, b"\0")


def uint32(value: int) -> bytes:
    """A size or checksum in a reply; higher bits that do not fit are cut off."""
    return _UINT32.pack(value & 0xFFFFFFFF)


def crc32(data: bytes, crc: int = 0) -> int:
    """The checksum of MAVLink FTP: CRC-32 (IEEE) that starts with 0 and is not inverted at the end."""
    return zlib.crc32(data, crc ^ 0xFFFFFFFF) ^ 0xFFFFFFFF
