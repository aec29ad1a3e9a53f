"""Bytes in, frames out: finds MAVLink 1 and 2 frames in any data, never raises, accounts for every byte."""

import struct
from dataclasses import dataclass, field
from typing import Final

from fastcrc.crc16 import mcrf4xx

from autopilot_bridge.mavlink.definitions import DEFINITIONS
from autopilot_bridge.mavlink.frame import (
    INCOMPAT_SIGNED,
    MAGIC_V1,
    MAGIC_V2,
    OVERHEAD_V1,
    OVERHEAD_V2,
    SIGNATURE_SIZE,
    Frame,
    new_frame,
)

_CRC_EXTRA: Final = {key: bytes([item.crc_extra]) for key, item in DEFINITIONS.items()}
_MAGIC_V1_BYTE: Final = bytes([MAGIC_V1])
_MAGIC_V2_BYTE: Final = bytes([MAGIC_V2])
_unpack_head: Final = struct.Struct("<BBBBBBBHB").unpack_from
_MAX_LATE: Final = 16  # frames; a larger step back means that the sender has restarted


@dataclass(slots=True)
class SourceCounters:
    """Counters of the frames received from one component.

    Attributes:
        frames: valid frames.
        lost: frames missing from the sequence.
        late: frames that arrived after a later one (each was counted as lost first) or twice.
        last_sequence: newest sequence number.
    """

    frames: int = 0
    lost: int = 0
    late: int = 0
    last_sequence: int = -1

    def take(self, sequence: int) -> None:
        """Count a valid frame with this sequence number."""
        self.frames += 1
        missed = (sequence - self.last_sequence - 1) & 0xFF
        if missed < 256 - _MAX_LATE:
            self.lost += missed
            self.last_sequence = sequence
        else:
            self.late += 1


@dataclass(slots=True)
class ParserCounters:
    """Counters of all bytes: `bytes_in == bytes_framed + bytes_dropped +` the parser's `pending_bytes`.

    Attributes:
        bytes_in: bytes fed.
        bytes_framed: bytes of valid frames.
        bytes_junk: bytes between frames, those left over from damaged frames included.
        bytes_bad_crc: first bytes of apparent frames with a wrong checksum (the search continues
            after them).
        bytes_unsupported: first bytes of apparent MAVLink 2 frames with unknown incompatibility
            flags.
        bytes_unknown_message: whole frames of messages outside the dialect; their checksum can't
            be verified.
        frames: valid frames; `frames_v1` and `frames_signed` are those in MAVLink 1 and with a signature.
        bad_crc, unsupported_flags, unknown_message: how often each happened.
        sources: counters by (system id, component id).
    """

    bytes_in: int = 0
    bytes_framed: int = 0
    bytes_junk: int = 0
    bytes_bad_crc: int = 0
    bytes_unsupported: int = 0
    bytes_unknown_message: int = 0
    frames: int = 0
    frames_v1: int = 0
    frames_signed: int = 0
    bad_crc: int = 0
    unsupported_flags: int = 0
    unknown_message: int = 0
    sources: dict[tuple[int, int], SourceCounters] = field(default_factory=dict)

    @property
    def bytes_dropped(self) -> int:
        """All bytes that are not in a valid frame."""
        return self.bytes_junk + self.bytes_bad_crc + self.bytes_unsupported + self.bytes_unknown_message

    @property
    def frames_lost(self) -> int:
        """Frames missing from the sequences of all sources, without those that came late."""
        return sum(max(0, source.lost - source.late) for source in self.sources.values())


class FrameParser:
    """Frames from one byte stream: one parser for each peer of a link.

    A byte that can't begin a valid frame is dropped and the search continues after it, so damage costs at
    most the damaged frame. A frame of an unknown message is skipped as a whole when another frame or the end
    of the data follows it; otherwise it counts as junk. Frames with incompatibility flags other than "signed"
    are dropped, as the MAVLink guide requires ("Incompatibility Flags"). Signatures are not verified here
    (`signing.LinkSigning` checks them).
    """

    def __init__(self) -> None:
        self.counters = ParserCounters()
        self._pending = b""

    @property
    def pending_bytes(self) -> int:
        """Bytes of a frame that is not complete yet."""
        return len(self._pending)

    def feed(self, data: bytes) -> list[Frame]:
        """All frames completed by `data`, in order."""
        data = bytes(data)  # no copy of bytes
        size = len(data)
        counters = self.counters
        counters.bytes_in += size
        if self._pending:
            return self._search(self._pending + data)
        # The usual data of most links: whole unsigned MAVLink 2 frames, and nothing else.
        frames: list[Frame] = []
        start = 0
        source: SourceCounters | None = None
        sender = -1, -1
        while size - start >= OVERHEAD_V2:
            magic, length, flags, _, sequence, system_id, component_id, low, high = _unpack_head(data, start)
            end = start + OVERHEAD_V2 + length
            if magic != MAGIC_V2 or flags or end > size:
                break
            message_id = low | high << 16
            extra = _CRC_EXTRA.get(message_id)
            raw = data[start:end]
            if extra is None or mcrf4xx(raw[1:-2] + extra) != raw[-2] | raw[-1] << 8:
                break
            if source is None or sender != (system_id, component_id):
                sender = system_id, component_id
                source = self._source(sender, sequence)
            if sequence == (source.last_sequence + 1) & 0xFF:
                source.frames += 1
                source.last_sequence = sequence
            else:
                source.take(sequence)
            frames.append(new_frame((raw, message_id, system_id, component_id, sequence, 2, False)))
            start = end
        counters.frames += len(frames)
        counters.bytes_framed += start
        if start < size:
            frames += self._search(data[start:])
        return frames

    def flush(self) -> None:
        """The stream has ended or was interrupted: the pending bytes will not be completed and are counted
        as junk.
        """
        self.counters.bytes_junk += len(self._pending)
        self._pending = b""

    def _search(self, buffer: bytes) -> list[Frame]:
        counters = self.counters
        frames: list[Frame] = []
        size = len(buffer)
        next_v1 = next_v2 = -1  # next magic bytes at or after `start`
        start = 0
        while start < size:
            if next_v2 < start:
                next_v2 = buffer.find(_MAGIC_V2_BYTE, start)
                if next_v2 < 0:
                    next_v2 = size
            if next_v1 < start:
                next_v1 = buffer.find(_MAGIC_V1_BYTE, start)
                if next_v1 < 0:
                    next_v1 = size
            found = min(next_v1, next_v2)
            counters.bytes_junk += found - start
            start = found
            if start == size:
                break
            if found == next_v2:
                if size - start < 3:
                    break
                flags = buffer[start + 2]
                if flags & ~INCOMPAT_SIGNED:
                    counters.unsupported_flags += 1
                    counters.bytes_unsupported += 1
                    start += 1
                    continue
                crc_end = start + OVERHEAD_V2 + buffer[start + 1]
                end = crc_end + SIGNATURE_SIZE if flags else crc_end
                if end > size:
                    break
                message_id = buffer[start + 7] | buffer[start + 8] << 8 | buffer[start + 9] << 16
            else:
                if size - start < 2:
                    break
                flags = 0
                crc_end = end = start + OVERHEAD_V1 + buffer[start + 1]
                if end > size:
                    break
                message_id = buffer[start + 5]
            extra = _CRC_EXTRA.get(message_id)
            if extra is None:
                if end == size or buffer[end] in (MAGIC_V1, MAGIC_V2):
                    counters.unknown_message += 1
                    counters.bytes_unknown_message += end - start
                    start = end
                else:
                    counters.bytes_junk += 1
                    start += 1
                continue
            if (
                mcrf4xx(buffer[start + 1 : crc_end - 2] + extra)
                != buffer[crc_end - 2] | buffer[crc_end - 1] << 8
            ):
                counters.bad_crc += 1
                counters.bytes_bad_crc += 1
                start += 1
                continue
            raw = buffer[start:end]
            if found == next_v2:
                frame = Frame(raw, message_id, raw[5], raw[6], raw[4], 2, flags != 0)
            else:
                frame = Frame(raw, message_id, raw[3], raw[4], raw[2], 1, False)
            self._count(frame)
            frames.append(frame)
            start = end
        self._pending = buffer[start:]
        return frames

    def _count(self, frame: Frame) -> None:
        counters = self.counters
        counters.frames += 1
        counters.bytes_framed += len(frame.raw)
        if frame.version == 1:
            counters.frames_v1 += 1
        elif frame.signed:
            counters.frames_signed += 1
        sender = frame.system_id, frame.component_id
        self._source(sender, frame.sequence).take(frame.sequence)

    def _source(self, sender: tuple[int, int], sequence: int) -> SourceCounters:
        """Counters of a component; a new component begins with the sequence number of its first frame."""
        source = self.counters.sources.get(sender)
        if source is None:
            source = self.counters.sources[sender] = SourceCounters(last_sequence=(sequence - 1) & 0xFF)
        return source
