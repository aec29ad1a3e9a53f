"""Telemetry logs (.tlog) in the format of pymavlink, MAVProxy and QGroundControl.

A record is the time in microseconds of the Unix epoch, 8 bytes, big endian, and then one raw MAVLink frame.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Final

from autopilot_bridge.errors import TlogError
from autopilot_bridge.mavlink.frame import (
    INCOMPAT_SIGNED,
    MAGIC_V1,
    MAGIC_V2,
    OVERHEAD_V1,
    OVERHEAD_V2,
    SIGNATURE_SIZE,
    Frame,
)
from autopilot_bridge.mavlink.parser import FrameParser, ParserCounters
from autopilot_bridge.packet_records import packet_records
from flightsim.foundation.file_content import FileError, open_file

_TIME: Final = struct.Struct(">Q")
FLUSH_BYTES: Final = 64 * 1024
FLUSH_INTERVAL_US: Final = 1_000_000
_CHUNK_BYTES: Final = 1 << 20


class TlogWriter:
    """Writes a new log; whole records only, so that the file is readable even if the process is killed.

    Packets are kept until there are 64 KiB of them or one second of log time has passed. Then compiled code
    splits them into records, which are written to the operating system in one piece: a killed process loses
    at most these packets.

    Args:
        path: the file; it must not exist.

    Attributes:
        records: number of records handed to the operating system.

    Raises:
        TlogError: the file exists or can't be created.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.records = 0
        self._times_us: list[int] = []
        self._packets: list[bytes] = []
        self._kept = 0  # bytes of the packets
        self._buffer = bytearray()  # records
        self._flushed_us = 0
        try:
            self._file: BinaryIO | None = open(self.path, "xb", buffering=0)  # noqa: SIM115
        except FileExistsError as error:
            raise TlogError(
                f"{self.path} exists and is not overwritten; choose another path or remove it"
            ) from error
        except OSError as error:
            raise TlogError(f"can't create {self.path}: {error.strerror}; check the folder") from error

    def write(self, time_us: int, packet: bytes) -> None:
        """Append the frames of a packet, which get the same time.

        Args:
            time_us: microseconds of the Unix epoch.
            packet: one or more whole frames, in sequence, of any MAVLink version, signed or not. They are
                split by their lengths; data from other sources must go through a parser first.

        Raises:
            TlogError: a packet since the last flush does not end with a frame (all whole frames are
                written), the log is closed, or the disk is full.
        """
        self._times_us.append(time_us)
        self._packets.append(packet)
        self._kept += len(packet)
        if self._kept >= FLUSH_BYTES or not 0 <= time_us - self._flushed_us < FLUSH_INTERVAL_US:
            self._flushed_us = time_us
            self.flush()

    @property
    def unwritten(self) -> bytes:
        """The records that were not written to the operating system yet."""
        self._split()
        return bytes(self._buffer)

    def flush(self) -> None:
        """Write everything to the operating system.

        Raises:
            TlogError: a packet does not end with a frame, the log is closed, or the disk is full.
        """
        if self._file is None:
            raise TlogError(f"{self.path} is closed; open a new log")
        wrong = self._split()
        try:
            while self._buffer:
                written = self._file.write(self._buffer)
                del self._buffer[:written]
        except OSError as error:
            raise TlogError(f"can't write {self.path}: {error.strerror}; check the disk") from error
        if wrong:
            raise TlogError(wrong)

    def _split(self) -> str:
        """Split the packets into records; returns the error, or an empty text."""
        if not self._packets:
            return ""
        data, count, wrong = packet_records(self._times_us, self._packets)
        self._times_us.clear()
        self._packets.clear()
        self._kept = 0
        self._buffer += data
        self.records += count
        return wrong

    def close(self) -> None:
        """Write the remaining records and close; a second call does nothing."""
        if self._file is None:
            return
        try:
            self.flush()
        finally:
            self._file.close()
            self._file = None

    def __enter__(self) -> "TlogWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


@dataclass(slots=True)
class TlogCounters:
    """Counters of every byte of a log.

    Attributes:
        records: valid records.
        bytes_skipped: bytes outside valid records (damage, messages outside the dialect,
            and the torn record at the end of a log whose writer was killed).
        frames: counters of the frames; see `ParserCounters`.
    """

    records: int = 0
    bytes_skipped: int = 0
    frames: ParserCounters = field(default_factory=ParserCounters)


class TlogReader:
    """Reads a log, one record after the other; damage is skipped and counted.

    A whole invalid record (a wrong checksum, an unknown message) is skipped as one when another follows it; a
    record that might begin inside it is not searched. `estimators.logs` does that, and is much faster.

    Args:
        path: the log.

    Attributes:
        counters: of the newest iteration.

    Raises:
        TlogError: the file can't be read.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.counters = TlogCounters()
        self._open().close()

    def __iter__(self) -> Iterator[tuple[int, Frame]]:
        """(time in microseconds of the Unix epoch, frame), in the order of the file."""
        parser = FrameParser()
        self.counters = counters = TlogCounters(frames=parser.counters)
        buffer, start, ended = b"", 0, False
        with self._open() as file:
            while True:
                size = _record_size(buffer, start)
                if size is None:  # more bytes are needed
                    if ended:
                        counters.bytes_skipped += len(buffer) - start
                        return
                    chunk = self._read(file)
                    ended = not chunk
                    buffer, start = buffer[start:] + chunk, 0
                    continue
                end = start + size
                if size:
                    raw = buffer[start + _TIME.size : end]
                    frames = parser.feed(raw)
                    if frames and len(frames[0].raw) == len(raw):
                        counters.records += 1
                        yield _TIME.unpack_from(buffer, start)[0], frames[0]
                        start = end
                        continue
                    parser.flush()
                    if end == len(buffer) or _record_size(buffer, end) != 0:
                        counters.bytes_skipped += size  # damaged, or a message outside the dialect
                        start = end
                        continue
                following = _next_record(buffer, start + 1)
                counters.bytes_skipped += following - start
                start = following

    def _open(self) -> BinaryIO:
        try:
            return open_file(self.path, may_be_empty=True)
        except FileError as error:
            raise TlogError(f"{error}; give the path of a .tlog") from None

    def _read(self, file: BinaryIO) -> bytes:
        try:
            return file.read(_CHUNK_BYTES)
        except OSError as error:
            raise TlogError(f"can't read {self.path}: {error.strerror}") from error


def _record_size(buffer: bytes, start: int) -> int | None:
    """Size of the record that begins at `start`; 0 when none does, None when the buffer ends before its
    end.
    """
    at = start + _TIME.size
    available = len(buffer) - at
    if available < 1:
        return None
    magic = buffer[at]
    if magic not in (MAGIC_V1, MAGIC_V2):
        return 0
    if available < 3:
        return None
    if magic == MAGIC_V1:
        size = OVERHEAD_V1 + buffer[at + 1]
    else:
        size = OVERHEAD_V2 + buffer[at + 1]
        if buffer[at + 2] & INCOMPAT_SIGNED:
            size += SIGNATURE_SIZE
    return _TIME.size + size if size <= available else None


def _next_record(buffer: bytes, start: int) -> int:
    """The first possible begin of a record at or after `start`."""
    at = start + _TIME.size
    found = [index for magic in (MAGIC_V1, MAGIC_V2) if (index := buffer.find(bytes([magic]), at)) >= 0]
    return min(found, default=max(start, len(buffer) - _TIME.size + 1)) - (_TIME.size if found else 0)
