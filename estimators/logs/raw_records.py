"""Raw records of a telemetry log (time stamp and frame), for copying, changing or playing."""

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import LogError
from estimators.logs.iterate import Selection
from estimators.logs.log import Log
from estimators.logs.new_file import new_file
from estimators.logs.tlog import TlogSource

Record = tuple[int, bytes]
"""Time in microseconds and one raw frame."""

_STAMP: Final = struct.Struct(">Q")
_BATCH: Final = 4096


def telemetry(log: Log) -> TlogSource:
    """The source of a log that contains frames.

    Raises:
        LogError: it is an onboard log, which contains no frames.
    """
    if isinstance(log.source, TlogSource):
        return log.source
    raise LogError(
        f"{log.path} is a {log.format}, which holds no MAVLink frames; give a telemetry log (.tlog)"
    )


def record_times_us(log: Log, order: NDArray[np.int64]) -> NDArray[np.int64]:
    """Times at which messages were recorded; vehicle time when the file has no record times."""
    times = log.source.log_time_us(order)
    return times if np.any(times) else log.source.time_us[order]


def window(
    log: Log,
    selections: Sequence[Selection],
    from_s: float | None,
    to_s: float | None,
    boot: int | None = None,
) -> list[Selection]:
    """The part of a selection that is in a part of the log; arguments and errors as in `Log.inside`."""
    found = []
    for stream, rows in selections:
        kept = rows[log.inside(stream.order[rows].astype(np.int64), from_s=from_s, to_s=to_s, boot=boot)]
        if len(kept):
            found.append((stream, kept))
    return found


def positions(selections: Sequence[Selection]) -> NDArray[np.int64]:
    """Positions in the log of the selected messages, ascending."""
    if not selections:
        return np.empty(0, dtype=np.int64)
    return np.sort(np.concatenate([stream.order[rows].astype(np.int64) for stream, rows in selections]))


def read_records(log: Log, order: NDArray[np.int64]) -> Iterator[Record]:
    """Records at the given positions, in the given order."""
    source = telemetry(log)
    data = source.data.data
    for first in range(0, len(order), _BATCH):
        part = order[first : first + _BATCH]
        times = record_times_us(log, part).tolist()
        starts, ends = source.frame_spans(part)
        for time_us, start, end in zip(times, starts.tolist(), ends.tolist(), strict=True):
            yield time_us, bytes(data[start:end])


def write_records(path: Path, records: Iterator[Record]) -> int:
    """Write a new telemetry log. After an error no file remains.

    Returns:
        The number of records written.

    Raises:
        LogError: the file exists or can't be written, or there are no records to write.
    """
    count = 0
    with new_file(path) as part, open(part, "xb") as file:
        pending = bytearray()
        for time_us, frame in records:
            pending += _STAMP.pack(time_us)
            pending += frame
            count += 1
            if count % _BATCH == 0:
                file.write(pending)
                pending.clear()
        file.write(pending)
        if not count:
            raise LogError(f"nothing to write to {path}: no message is selected")
    return count
