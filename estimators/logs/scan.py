"""Positions of the frames in a telemetry log, found in one compiled pass over the bytes.

A frame is valid when the dialect contains its message, it has no incompatibility flag other than "signed",
the whole frame is in the file, and its checksum is correct. After each frame the next one is first looked for
at its expected place, after a time stamp of 8 bytes (`lead`; 0 in captures without stamps). If there is none,
the next frame is the first valid one that begins anywhere after the last. Therefore no damage hides a frame
that begins outside a valid one, and a stamp that looks like the beginning of a frame does not hide one
either. The bytes between frames are classified afterwards (`gaps`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import MessageDefinition
from autopilot_bridge.mavlink.frame import MAGIC_V1, MAGIC_V2
from estimators.logs.crc import Int, checksum
from flightsim.foundation.kernels import kernel

STAMP_SIZE: Final = 8
"""Size of the time stamp before each frame, bytes."""

MAX_LATE: Final = 16
"""A larger step back in the sequence, in frames, means that the sender restarted; same value as in
`FrameParser`.
"""

_PAGE: Final = 256
_CAPACITY: Final = 1 << 20
_OVERHEAD_V1: Final = 8
_OVERHEAD_V2: Final = 12
_SIGNATURE: Final = 13
_HASH: Final = 0x9E3779B97F4A7C15  # Knuth's multiplicative hash
# Columns of `sources`, one row per system and component.
FRAMES, LOST, LATE, LAST = range(4)
# Contents of `progress`, which are kept from call to call.
_AT, _FOUND, _GAPS, _STREAMS, _V1, _SIGNED, _UNSTAMPED, _FRAME_BYTES = range(8)


@dataclass(frozen=True, slots=True)
class MessageTable:
    """Lookup table of a dialect for compiled code. Messages are numbered in the order of their ids.

    Attributes:
        pages, rows: the number of a message is rows[pages[id // 256], id % 256]; -1 when there is none.
        extras: CRC_EXTRA of each message.
        ids: id of each message.
    """

    pages: NDArray[np.int16]
    rows: NDArray[np.int16]
    extras: NDArray[np.uint8]
    ids: NDArray[np.int64]


def message_table(definitions: Mapping[int, MessageDefinition]) -> MessageTable:
    """Lookup table of messages, by id."""
    ids = np.array(sorted(definitions), dtype=np.int64)
    used = np.unique(ids // _PAGE)
    pages = np.zeros((1 << 24) // _PAGE, dtype=np.int16)
    pages[used] = np.arange(1, len(used) + 1)
    rows = np.full((len(used) + 1, _PAGE), -1, dtype=np.int16)
    rows[pages[ids // _PAGE], ids % _PAGE] = np.arange(len(ids))
    extras = np.array([definitions[int(key)].crc_extra for key in ids], dtype=np.uint8)
    return MessageTable(pages, rows, extras, ids)


Offsets = NDArray[np.uint32] | NDArray[np.int64]
"""Positions of bytes in a file."""


@dataclass(frozen=True, slots=True)
class FrameIndex:
    """All valid frames of a log, in the order of the file.

    Attributes:
        lead: bytes before each frame that belong to it: 8 (time stamp) or 0.
        starts: position at which each frame begins; uint32, or int64 in files of 4 GiB and more.
        streams: number of each frame's stream (int32), which is a message, system and component.
        stream_keys: shape (streams, 3): message number of the `MessageTable`, system id, component id; in the
            order of their first frames.
        gaps: shape (gaps, 2): from the end of a frame (or the beginning of the file) to the beginning of the
            next (or the end of the file), when these are not exactly `lead` bytes.
        sources: by system and component (row = system * 256 + component): frames, lost, late, last sequence.
        frames_v1, frames_signed: number of frames in MAVLink 1, and with a signature.
        unstamped: number of frames with fewer than 8 bytes before them, although the log has stamps.
        frame_bytes: number of bytes in frames.
    """

    lead: int
    starts: Offsets
    streams: NDArray[np.int32]
    stream_keys: NDArray[np.int64]
    gaps: NDArray[np.int64]
    sources: NDArray[np.int64]
    frames_v1: int
    frames_signed: int
    unstamped: int
    frame_bytes: int


def scan(data: NDArray[np.uint8], table: MessageTable, lead: int) -> FrameIndex:
    """Find every valid frame.

    Args:
        data: bytes of the file.
        table: messages to look for.
        lead: bytes before each frame that belong to it, 8 or 0.
    """
    progress = np.zeros(8, dtype=np.int64)
    sources = np.zeros((256 * 256, 4), dtype=np.int64)
    keys = np.zeros((1024, 3), dtype=np.int64)
    slots = np.full(4 * len(keys), -1, dtype=np.int32)
    capacity = min(_CAPACITY, len(data) // (_OVERHEAD_V1 + lead) + 2)
    offset: np.dtype[Any] = np.dtype(np.uint32 if len(data) < 1 << 32 else np.int64)
    starts: list[NDArray[Any]] = []
    streams: list[NDArray[np.int32]] = []
    gaps: list[NDArray[np.int64]] = []
    while progress[_AT] < len(data):
        starts.append(np.empty(capacity, dtype=offset))
        streams.append(np.empty(capacity, dtype=np.int32))
        gaps.append(np.empty((capacity, 2), dtype=np.int64))
        progress[_FOUND] = progress[_GAPS] = 0
        _scan_some(
            *(data, lead, table.pages, table.rows, table.extras, starts[-1], streams[-1], gaps[-1]),
            *(keys, slots, sources, progress),
        )
        starts[-1] = starts[-1][: progress[_FOUND]].copy()
        streams[-1] = streams[-1][: progress[_FOUND]].copy()
        gaps[-1] = gaps[-1][: progress[_GAPS]].copy()
        if 2 * (progress[_STREAMS] + 1) > len(keys):
            keys, slots = _grown(keys, int(progress[_STREAMS]))
    return FrameIndex(
        lead=lead,
        starts=_joined(starts, np.empty(0, dtype=offset)),
        streams=_joined(streams, np.empty(0, dtype=np.int32)),
        stream_keys=keys[: progress[_STREAMS]].copy(),
        gaps=_joined(gaps, np.empty((0, 2), dtype=np.int64)),
        sources=sources,
        frames_v1=int(progress[_V1]),
        frames_signed=int(progress[_SIGNED]),
        unstamped=int(progress[_UNSTAMPED]),
        frame_bytes=int(progress[_FRAME_BYTES]),
    )


def _joined(parts: list[NDArray[Any]], empty: NDArray[Any]) -> NDArray[Any]:
    return parts[0] if len(parts) == 1 else np.concatenate(parts) if parts else empty


def _grown(keys: NDArray[np.int64], used: int) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Arrays with twice the room for streams, and a rebuilt hash table."""
    larger = np.zeros((2 * len(keys), 3), dtype=np.int64)
    larger[:used] = keys[:used]
    slots = np.full(4 * len(larger), -1, dtype=np.int32)
    for number in range(used):
        _insert(larger, slots, number)
    return larger, slots


@kernel
def _slot(message: Int, sender: Int, size: int) -> Int:
    code = np.uint64(message) * np.uint64(65536) + np.uint64(sender)
    return np.int64(((code * np.uint64(_HASH)) >> np.uint64(32)) & np.uint64(size - 1))


@kernel
def _insert(keys: NDArray[np.int64], slots: NDArray[np.int32], number: int) -> None:
    at = _slot(keys[number, 0], keys[number, 1] * 256 + keys[number, 2], len(slots))
    while slots[at] >= 0:
        at = (at + 1) & (len(slots) - 1)
    slots[at] = number


@kernel
def frame_end(data: NDArray[np.uint8], at: Int) -> Int:
    """End, from its length and flags, of the bytes at `at` that begin like a frame; their header is in the
    file.
    """
    length = np.int64(data[at + 1])
    if data[at] != MAGIC_V2:
        return at + _OVERHEAD_V1 + length
    return at + _OVERHEAD_V2 + length + (_SIGNATURE if data[at + 2] & 1 else 0)


@kernel
def message_row(
    data: NDArray[np.uint8], at: Int, pages: NDArray[np.int16], rows: NDArray[np.int16]
) -> np.int64:
    """Number of the message of the frame at `at`; negative: not in the dialect."""
    if data[at] == MAGIC_V2:
        page = np.int64(data[at + 8]) | np.int64(data[at + 9]) << 8
        return np.int64(rows[pages[page], data[at + 7]])
    return np.int64(rows[pages[0], data[at + 5]])


@kernel
def valid_frame(
    data: NDArray[np.uint8],
    at: Int,
    pages: NDArray[np.int16],
    rows: NDArray[np.int16],
    extras: NDArray[np.uint8],
) -> tuple[Int, Int]:
    """End of the valid frame that begins at `at`, and the number of its message; (-1, -1) if none."""
    size = len(data)
    magic = data[at]
    if magic == MAGIC_V2:
        if at + _OVERHEAD_V2 > size or data[at + 2] > 1:
            return -1, -1
        crc_at = at + _OVERHEAD_V2 - 2 + np.int64(data[at + 1])
    elif magic == MAGIC_V1:
        if at + _OVERHEAD_V1 > size:
            return -1, -1
        crc_at = at + _OVERHEAD_V1 - 2 + np.int64(data[at + 1])
    else:
        return -1, -1
    end = frame_end(data, at)
    if end > size:
        return -1, -1
    message = message_row(data, at, pages, rows)
    if message < 0:
        return -1, -1
    if checksum(data, at + 1, crc_at, extras[message]) != (
        np.int64(data[crc_at]) | np.int64(data[crc_at + 1]) << 8
    ):
        return -1, -1
    return end, message


@kernel
def _scan_some(
    data: NDArray[np.uint8],
    lead: int,
    pages: NDArray[np.int16],
    rows: NDArray[np.int16],
    extras: NDArray[np.uint8],
    starts: Offsets,
    streams: NDArray[np.int32],
    gaps: NDArray[np.int64],
    keys: NDArray[np.int64],
    slots: NDArray[np.int32],
    sources: NDArray[np.int64],
    progress: NDArray[np.int64],
) -> None:
    """Continue from `progress` until the file ends, an array is full, or the stream table is half full."""
    size = len(data)
    at: Int = progress[_AT]
    found = 0
    gap_count = 0
    unstamped = signed = frames_v1 = frame_bytes = 0
    stream_count = progress[_STREAMS]
    mask = len(slots) - 1
    while at < size and found < len(starts) and gap_count < len(gaps) and 2 * stream_count < len(keys):
        start = at + lead
        end: Int = np.int64(-1)
        message: Int = np.int64(-1)
        if start < size:
            end, message = valid_frame(data, start, pages, rows, extras)
        if end < 0:
            start = at
            while start < size:
                byte = data[start]
                if byte in (MAGIC_V1, MAGIC_V2):
                    end, message = valid_frame(data, start, pages, rows, extras)
                    if end >= 0:
                        break
                start += 1
            if start - at != lead or end < 0:
                gaps[gap_count, 0] = at
                gaps[gap_count, 1] = start
                gap_count += 1
            if end < 0:
                at = size
                break
            if start - at < lead:
                unstamped += 1
        if data[start] == MAGIC_V2:
            sequence = np.int64(data[start + 4])
            sender = np.int64(data[start + 5]) * 256 + np.int64(data[start + 6])
            signed += data[start + 2] & 1
        else:
            sequence = np.int64(data[start + 2])
            sender = np.int64(data[start + 3]) * 256 + np.int64(data[start + 4])
            frames_v1 += 1
        frame_bytes += end - start
        slot = _slot(message, sender, mask + 1)
        stream = slots[slot]
        while stream >= 0 and (
            keys[stream, 0] != message or keys[stream, 1] * 256 + keys[stream, 2] != sender
        ):
            slot = (slot + 1) & mask
            stream = slots[slot]
        if stream < 0:
            stream = np.int32(stream_count)
            slots[slot] = stream
            keys[stream, 0] = message
            keys[stream, 1] = sender >> 8
            keys[stream, 2] = sender & 0xFF
            stream_count += 1
        if sources[sender, FRAMES] == 0:
            sources[sender, LAST] = (sequence - 1) & 0xFF
        sources[sender, FRAMES] += 1
        missed = (sequence - sources[sender, LAST] - 1) & 0xFF
        if missed < 256 - MAX_LATE:
            sources[sender, LOST] += missed
            sources[sender, LAST] = sequence
        else:
            sources[sender, LATE] += 1
        starts[found] = start
        streams[found] = stream
        found += 1
        at = end
    progress[_AT] = at
    progress[_FOUND] = found
    progress[_GAPS] = gap_count
    progress[_STREAMS] = stream_count
    progress[_UNSTAMPED] += unstamped
    progress[_SIGNED] += signed
    progress[_V1] += frames_v1
    progress[_FRAME_BYTES] += frame_bytes
