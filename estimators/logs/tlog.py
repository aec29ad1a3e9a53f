"""Telemetry logs (.tlog) and raw captures of MAVLink streams."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.frame import HEADER_SIZE_V1, HEADER_SIZE_V2, MAGIC_V2
from estimators.errors import LogError
from estimators.logs.columns import Columns, decode_columns
from estimators.logs.crc import Int
from estimators.logs.dialect import Description, Dialect
from estimators.logs.gaps import GapFigures, find_lead, sort_gaps
from estimators.logs.mapped_file import mapped_bytes
from estimators.logs.scan import (
    FRAMES,
    LATE,
    LOST,
    STAMP_SIZE,
    FrameIndex,
    Offsets,
    frame_end,
    message_table,
    scan,
)
from estimators.logs.source import LogSource, Positions, SourceLoss, Stream, UnknownMessage
from estimators.logs.time_stamps import plausible
from estimators.vehicle_time import UNIX_TIME_US, stamp_field, vehicle_times
from flightsim.foundation.kernels import kernel

_FAR_FUTURE_US: Final = 1 << 62
_STAMP_SAMPLE: Final = 4096
_MILLISECOND_US: Final = 1000
_LONGEST_PAUSE_US: Final = 86_400_000_000
"""A first or last record that is farther than a day from the others has a damaged stamp."""


class TlogSource(LogSource):
    """A mapped telemetry log and the index of its frames.

    The file must not be shortened while it is open; a log that is still being written is read up to its end
    at the time of opening.

    Args:
        path: the file.
        data: bytes of the file.
        dialect: messages to look for.

    Raises:
        LogError: there is no valid frame in it.
    """

    def __init__(self, path: Path, data: NDArray[np.uint8], dialect: Dialect) -> None:
        self.path = path
        self.size_bytes = len(data)
        self.dialect = dialect
        self.data = data
        self._table = message_table({key: item.definition for key, item in dialect.messages.items()})
        self.index: FrameIndex = scan(data, self._table, find_lead(data, self._table))
        self.count = len(self.index.starts)
        if not self.count:
            raise LogError(
                f"{path}: no valid MAVLink frame of dialect '{dialect.name}' in {len(data)} bytes; "
                "give a telemetry log, or the dialect that it was recorded with"
            )
        self.format = "tlog" if self.index.lead else "raw MAVLink"
        described = list(dialect.messages.values())
        self._descriptions: list[Description] = [
            described[key] for key in self.index.stream_keys[:, 0].tolist()
        ]
        self.streams: Sequence[Stream] = self._make_streams()
        self._time_us, begins = self._find_times()
        systems = self.index.stream_keys[self.index.streams[begins], 1]
        self._boot_starts = {int(system): begins[systems == system] for system in np.unique(systems)}
        # They are no longer needed, and take a tenth of the file's size in memory.
        self.index = replace(self.index, streams=np.empty(0, dtype=np.int32))

    def _make_streams(self) -> tuple[Stream, ...]:
        keys = self.index.stream_keys
        counts = np.bincount(self.index.streams, minlength=len(keys))
        grouped: NDArray[Any] = np.empty(self.count, dtype=np.int32 if self.count < 1 << 31 else np.int64)
        ends = np.cumsum(counts)
        _group(self.index.streams, (ends - counts).astype(np.int64), grouped)
        return tuple(
            Stream(description, int(system_id), int(component_id), grouped[end - count : end])
            for description, (_, system_id, component_id), count, end in zip(
                self._descriptions, keys.tolist(), counts.tolist(), ends.tolist(), strict=True
            )
        )

    def _find_times(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Vehicle times, and the positions at which boots begin."""
        layout = np.zeros((len(self._descriptions), 3), dtype=np.int64)  # offset, size, unit; size 0: none
        for row, description in zip(layout, self._descriptions, strict=True):
            definition = description.definition
            found = stamp_field(definition.name, definition.field_names)
            for field in definition.wire_fields:
                if found is not None and field.name == found[0] and field.code in "IQ" and not field.length:
                    row[:] = field.offset, field.size, found[1]
        times = np.empty(self.count, dtype=np.int64)
        _own_stamps(self.data, self.index.starts, self.index.streams, layout, times)
        keys = self.index.stream_keys
        begins = vehicle_times(
            times, self.index.streams, np.ascontiguousarray(keys[:, 1]), np.ascontiguousarray(keys[:, 2])
        )
        times.flags.writeable = False
        return times, begins

    @property
    def time_us(self) -> NDArray[np.int64]:
        """Vehicle time of every frame."""
        return self._time_us

    @property
    def boot_starts(self) -> Mapping[int, NDArray[np.int64]]:
        """By system id: frames that begin its second, third, ... boot."""
        return self._boot_starts

    def log_time_us(self, order: Positions) -> NDArray[np.int64]:
        """Times of the records; a frame without its own time, or with a damaged one, has that of the previous
        frame with a time, and before the first such frame the time of that one.
        """
        if not self.index.lead:
            return np.zeros(len(order), dtype=np.int64)
        return self._record_times[0][order]

    @cached_property
    def _record_times(self) -> tuple[NDArray[np.int64], int]:
        """Times of all records, and the number of damaged stamps among them."""
        times = self._stamps_us(self._little_endian, self.count)
        good = plausible(times, _LONGEST_PAUSE_US)
        damaged = int(np.count_nonzero(~good & (times >= 0)))
        _fill(times, good)
        times.flags.writeable = False
        return times, damaged

    def _stamps_us(self, little_endian: bool, count: int) -> NDArray[np.int64]:
        """The stamps of the first frames of the log, as they are; -1: none, or one in the far future."""
        times = np.empty(count, dtype=np.int64)
        _read_stamps(self.data, self.index.starts[:count], little_endian, times)
        return times

    @cached_property
    def _little_endian(self) -> bool:
        """Whether the stamps are little-endian, as old ground stations wrote them; read as big-endian they
        are far in the future.
        """
        sample = min(self.count, _STAMP_SAMPLE)
        past = [
            np.count_nonzero((times >= 0) & (times < 4 * UNIX_TIME_US))
            for times in (self._stamps_us(False, sample), self._stamps_us(True, sample))
        ]
        return bool(past[1] > past[0])

    def columns(self, stream: Stream, rows: slice | NDArray[np.int64]) -> Columns:
        """Fields of some messages of a stream."""
        return decode_columns(self.data, self.index.starts[stream.order[rows]], stream.description.definition)

    def frame_spans(self, order: Positions) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """First byte, and the byte after the last, of frames in the file; the time stamp is before the first
        byte.
        """
        starts = self.index.starts[order].astype(np.int64)
        ends = np.empty_like(starts)
        _frame_ends(self.data, starts, ends)
        return starts, ends

    def frame(self, position: int) -> bytes:
        """The raw frame at a position."""
        starts, ends = self.frame_spans(np.array([position]))
        return self.data[starts[0] : ends[0]].tobytes()

    @cached_property
    def gaps(self) -> GapFigures:
        """The bytes between the frames."""
        return sort_gaps(self.data, self.index, self._table)

    @property
    def bytes_by_kind(self) -> Mapping[str, int]:
        """The bytes of the file, by the use of each."""
        gaps = self.gaps
        return {
            "frames": self.index.frame_bytes,
            "timestamps": gaps.stamp_bytes,
            "unknown_messages": gaps.unknown_bytes,
            "bad_crc": gaps.bad_crc_bytes,
            "unsupported_flags": gaps.unsupported_bytes,
            "junk": gaps.junk_bytes,
            "torn_tail": gaps.torn_bytes,
        }

    @property
    def drops(self) -> Mapping[str, int]:
        """Number of dropped frames, by reason."""
        gaps = self.gaps
        return {
            "unknown_messages": gaps.unknown,
            "bad_crc": gaps.bad_crc,
            "unsupported_flags": gaps.unsupported,
        }

    @property
    def remarks(self) -> Mapping[str, int | str]:
        """Figures of the MAVLink versions and of the time stamps."""
        return {
            "frames_v1": self.index.frames_v1,
            "frames_v2": self.count - self.index.frames_v1,
            "frames_signed": self.index.frames_signed,
            "frames_without_timestamp": self.index.unstamped if self.index.lead else self.count,
            "timestamps_damaged": self._record_times[1] if self.index.lead else 0,
            "timestamps": self._stamp_kind,
        }

    @property
    def _stamp_kind(self) -> str:
        if not self.index.lead:
            return "none"
        times = self.log_time_us(np.arange(min(self.count, _STAMP_SAMPLE)))
        return "milliseconds" if not np.any(times % _MILLISECOND_US) else "microseconds"

    @property
    def losses(self) -> Sequence[SourceLoss]:
        """Losses from sequence numbers, by system and component; frames of unknown messages do not count as
        lost.
        """
        sources = self.index.sources
        unknown: dict[int, int] = {}
        for item in self.unknown:
            row = item.system_id << 8 | item.component_id
            unknown[row] = unknown.get(row, 0) + item.count
        return tuple(
            SourceLoss(
                system_id=int(row) >> 8,
                component_id=int(row) & 0xFF,
                frames=int(sources[row, FRAMES]),
                lost=max(0, int(sources[row, LOST] - sources[row, LATE]) - unknown.get(int(row), 0)),
                late=int(sources[row, LATE]),
            )
            for row in np.flatnonzero(sources[:, FRAMES])
        )

    @cached_property
    def unknown(self) -> Sequence[UnknownMessage]:
        """Messages that the dialect does not know."""
        starts = self.gaps.unknown_starts
        if not len(starts):
            return ()
        data = self.data
        v2 = data[starts] == MAGIC_V2
        system = np.where(v2, data[starts + np.where(v2, 5, 3)], data[starts + 3]).astype(np.int64)
        component = data[starts + np.where(v2, 6, 4)].astype(np.int64)
        number = data[starts + np.where(v2, 7, 5)].astype(np.int64)
        # In MAVLink 1, bytes 8 and 9 may be outside the frame.
        number += np.where(v2, data[starts + np.where(v2, 8, 0)].astype(np.int64) << 8, 0)
        number += np.where(v2, data[starts + np.where(v2, 9, 0)].astype(np.int64) << 16, 0)
        ends = np.empty_like(starts)
        _frame_ends(data, starts, ends)
        codes, which = np.unique(number << 16 | system << 8 | component, return_inverse=True)
        counts = np.bincount(which)
        sizes = np.bincount(which, weights=(ends - starts).astype(np.float64)).astype(np.int64)
        return tuple(
            UnknownMessage(
                message_id=code >> 16,
                system_id=code >> 8 & 0xFF,
                component_id=code & 0xFF,
                count=count,
                frame_bytes=size,
            )
            for code, count, size in zip(codes.tolist(), counts.tolist(), sizes.tolist(), strict=True)
        )

    def unknown_frames(self, message_id: int) -> list[bytes]:
        """Raw frames of a message that the dialect does not know, in the order of the file."""
        starts = self.gaps.unknown_starts
        ends = np.empty_like(starts)
        _frame_ends(self.data, starts, ends)
        frames = (self.data[start:end].tobytes() for start, end in zip(starts, ends, strict=True))
        return [raw for raw in frames if _message_id(raw) == message_id]


def open_tlog(path: Path, dialect: Dialect) -> TlogSource:
    """Map a telemetry log and find its frames.

    Raises:
        LogError: it can't be read, or contains no valid frame.
    """
    return TlogSource(path, mapped_bytes(path), dialect)


def _message_id(raw: bytes) -> int:
    return int.from_bytes(raw[7:10], "little") if raw[0] == MAGIC_V2 else raw[5]


@kernel
def _group(streams: NDArray[np.int32], places: NDArray[np.int64], grouped: Positions) -> None:
    """Counting sort: positions by stream, in ascending order within each stream."""
    for position in range(len(streams)):
        stream = streams[position]
        grouped[places[stream]] = position
        places[stream] += 1


@kernel
def _frame_ends(data: NDArray[np.uint8], starts: NDArray[np.int64], ends: NDArray[np.int64]) -> None:
    for index in range(len(starts)):
        ends[index] = frame_end(data, starts[index])


@kernel
def _read_stamps(
    data: NDArray[np.uint8], starts: Offsets, little_endian: bool, times: NDArray[np.int64]
) -> None:
    before: Int = np.int64(0)
    for index in range(len(starts)):
        start = np.int64(starts[index])
        times[index] = -1
        if start - before >= STAMP_SIZE:
            value = np.uint64(0)
            for byte in range(STAMP_SIZE):
                at = start - 1 - byte if little_endian else start - STAMP_SIZE + byte
                value = value << np.uint64(8) | np.uint64(data[at])
            if value < np.uint64(_FAR_FUTURE_US):
                times[index] = np.int64(value)
        before = frame_end(data, start)


@kernel
def _fill(times: NDArray[np.int64], good: NDArray[np.bool_]) -> None:
    """Give frames without a good time that of the one before; before the first good time, that."""
    last = np.int64(0)
    for index in range(len(times)):
        if good[index]:
            last = times[index]
            break
    for index in range(len(times)):
        if good[index]:
            last = times[index]
        else:
            times[index] = last


@kernel
def _own_stamps(
    data: NDArray[np.uint8],
    starts: Offsets,
    streams: NDArray[np.int32],
    layout: NDArray[np.int64],
    times: NDArray[np.int64],
) -> None:
    for index in range(len(starts)):
        stream = streams[index]
        width = layout[stream, 1]
        value = np.uint64(0)
        if width:
            start = starts[index]
            payload = start + (HEADER_SIZE_V2 if data[start] == MAGIC_V2 else HEADER_SIZE_V1)
            length = np.int64(data[start + 1])
            offset = layout[stream, 0]
            for byte in range(min(width, length - offset)):
                value |= np.uint64(data[payload + offset + byte]) << np.uint64(8 * byte)
            if value >= np.uint64(UNIX_TIME_US):
                value = np.uint64(0)
        times[index] = np.int64(value) * layout[stream, 2]
