"""The bytes between the valid frames of a log; each byte is assigned a reason.

A whole record (a time stamp and bytes in the form of a frame) that is followed by another record, or by the
end of the gap, has one reason: its message is unknown, its flags are unsupported, or its checksum is wrong.
The remaining bytes are junk or, after the last whole record of a file, the torn record of a writer that was
killed.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.frame import MAGIC_V1, MAGIC_V2
from estimators.logs.crc import Int
from estimators.logs.scan import STAMP_SIZE, FrameIndex, MessageTable, frame_end, message_row, scan
from flightsim.foundation.kernels import kernel

_UNKNOWN, _UNSUPPORTED, _BAD_CRC = range(3)
# Figures that the kernel counts, by index.
(
    _N_UNKNOWN,
    _N_UNSUPPORTED,
    _N_BAD_CRC,
    _B_UNKNOWN,
    _B_UNSUPPORTED,
    _B_BAD_CRC,
    _B_STAMPS,
    _B_JUNK,
    _B_TORN,
) = range(9)
_FIGURES: Final = 9
_SAMPLE_BYTES: Final = 1 << 18
_SAMPLE_FRAMES: Final = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class GapFigures:
    """The contents of the gaps.

    Attributes:
        unknown, unsupported, bad_crc: records that are not valid, by reason.
        unknown_bytes, unsupported_bytes, bad_crc_bytes: bytes of these records that have the form of a frame.
        stamp_bytes: bytes of time stamps, including those of the valid frames after the gaps.
        junk_bytes: bytes that do not have the form of a frame.
        torn_bytes: bytes of the incomplete record at the end of the file.
        unknown_starts: positions at which frames of unknown messages begin (int64).
    """

    unknown: int
    unsupported: int
    bad_crc: int
    unknown_bytes: int
    unsupported_bytes: int
    bad_crc_bytes: int
    stamp_bytes: int
    junk_bytes: int
    torn_bytes: int
    unknown_starts: NDArray[np.int64]


def find_lead(data: NDArray[np.uint8], table: MessageTable) -> int:
    """Number of bytes before each frame: 8 with time stamps, 0 in captures without.

    The result is the number that explains more of the beginning of the file.
    """
    size = _SAMPLE_BYTES
    while True:
        sample = data[:size]
        plain = scan(sample, table, 0)
        if len(plain.starts) >= _SAMPLE_FRAMES or size >= len(data):
            break
        size *= 8
    stamped = scan(sample, table, STAMP_SIZE)
    left_over = _left_over(sample, stamped, table) + STAMP_SIZE * stamped.unstamped
    return STAMP_SIZE if left_over <= _left_over(sample, plain, table) else 0


def _left_over(data: NDArray[np.uint8], index: FrameIndex, table: MessageTable) -> int:
    figures = sort_gaps(data, index, table)
    return figures.junk_bytes + figures.torn_bytes


def sort_gaps(data: NDArray[np.uint8], index: FrameIndex, table: MessageTable) -> GapFigures:
    """Classify the bytes between the frames of an index."""
    figures = np.zeros(_FIGURES, dtype=np.int64)
    starts = np.empty(0, dtype=np.int64)
    _sort_gaps(data, index.lead, index.gaps, table.pages, table.rows, figures, starts)
    if figures[_N_UNKNOWN]:
        starts = np.empty(figures[_N_UNKNOWN], dtype=np.int64)
        figures[:] = 0
        _sort_gaps(data, index.lead, index.gaps, table.pages, table.rows, figures, starts)
    clean = len(index.starts) - np.count_nonzero(
        index.gaps[:, 1] < len(data)
    )  # frames without a gap before them
    return GapFigures(
        unknown=int(figures[_N_UNKNOWN]),
        unsupported=int(figures[_N_UNSUPPORTED]),
        bad_crc=int(figures[_N_BAD_CRC]),
        unknown_bytes=int(figures[_B_UNKNOWN]),
        unsupported_bytes=int(figures[_B_UNSUPPORTED]),
        bad_crc_bytes=int(figures[_B_BAD_CRC]),
        stamp_bytes=int(figures[_B_STAMPS]) + int(clean) * index.lead,
        junk_bytes=int(figures[_B_JUNK]),
        torn_bytes=int(figures[_B_TORN]),
        unknown_starts=starts,
    )


@kernel
def _shape(
    data: NDArray[np.uint8], at: Int, pages: NDArray[np.int16], rows: NDArray[np.int16]
) -> tuple[Int, Int]:
    """End of the bytes that have the form of a frame, and why they are not valid; end -1: not the form of a
    frame, -2: the file ends before.
    """
    size = len(data)
    if at >= size:
        return -2, -1
    v2 = data[at] == MAGIC_V2
    if not v2 and data[at] != MAGIC_V1:
        return -1, -1
    if at + (3 if v2 else 2) > size:
        return -2, -1
    end = frame_end(data, at)
    if end > size:
        return -2, -1
    if v2 and data[at + 2] > 1:
        return end, _UNSUPPORTED
    return end, (_BAD_CRC if message_row(data, at, pages, rows) >= 0 else _UNKNOWN)


@kernel
def _sort_gaps(
    data: NDArray[np.uint8],
    lead: int,
    gaps: NDArray[np.int64],
    pages: NDArray[np.int16],
    rows: NDArray[np.int16],
    figures: NDArray[np.int64],
    unknown_starts: NDArray[np.int64],
) -> None:
    size = len(data)
    for gap in range(len(gaps)):
        at = gaps[gap, 0]
        limit = gaps[gap, 1]
        if limit < size and limit - at >= lead:
            limit -= lead  # the stamp of the valid frame after the gap
            figures[_B_STAMPS] += lead
        elif limit < size:
            figures[_B_JUNK] += limit - at
            continue
        aligned = True
        while at < limit:
            start = at + lead
            end, reason = _shape(data, start, pages, rows)
            if 0 <= end <= limit and (
                end == limit
                or (end + lead < limit and (data[end + lead] == MAGIC_V1 or data[end + lead] == MAGIC_V2))
            ):
                if reason == _UNKNOWN and len(unknown_starts):
                    unknown_starts[figures[_N_UNKNOWN]] = start
                figures[_N_UNKNOWN + reason] += 1
                figures[_B_UNKNOWN + reason] += end - start
                figures[_B_STAMPS] += lead
                at = end
                aligned = True
            elif end == -2 and aligned and limit == size:
                figures[_B_TORN] += size - at
                at = size
            else:
                figures[_B_JUNK] += 1
                at += 1
                aligned = False
