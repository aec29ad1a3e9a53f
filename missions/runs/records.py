"""The frames of a flight as columns: raw payloads, collected by message and decoded with numpy."""

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.errors import TlogError
from autopilot_bridge.mavlink import DEFINITIONS, definition
from autopilot_bridge.tlog import TlogReader, TlogWriter
from estimators.logs.columns import record_dtype

SCORED_MESSAGES: Final = frozenset(
    definition(name).message_id
    for name in (
        "HIL_STATE_QUATERNION",
        "LOCAL_POSITION_NED",
        "GLOBAL_POSITION_INT",
        "GPS_GLOBAL_ORIGIN",
        "ATTITUDE",
        "ATTITUDE_TARGET",
        "HEARTBEAT",
    )
)
"""Messages kept for the summary and the picture; all others are only counted."""

UnixTime = Callable[[], int]
"""Returns microseconds of the Unix epoch."""

_MAGIC_V2: Final = 0xFD


class FlightRecords:
    """Counts of all messages of a flight, and the payloads of messages that are scored."""

    def __init__(self) -> None:
        self._counts: Counter[int] = Counter()
        self._payloads: dict[tuple[int, int, int], list[bytes]] = {}

    @classmethod
    def from_tlog(cls, path: Path) -> "FlightRecords":
        """Records from an existing log."""
        records = cls()
        for _, frame in TlogReader(path):
            records.add(frame.raw)
        return records

    def add(self, raw: bytes) -> None:
        """Add one valid frame."""
        if raw[0] == _MAGIC_V2:
            message_id = raw[7] | raw[8] << 8 | raw[9] << 16
            self._counts[message_id] += 1
            if message_id in SCORED_MESSAGES:
                key = (message_id, raw[5], raw[6])
                self._payloads.setdefault(key, []).append(raw[10 : 10 + raw[1]])
        else:
            self._counts[raw[5]] += 1
            if raw[5] in SCORED_MESSAGES:
                self._payloads.setdefault((raw[5], raw[3], raw[4]), []).append(raw[6 : 6 + raw[1]])

    @property
    def message_counts(self) -> dict[str, int]:
        """Frames by message name, sorted by name."""
        return dict(sorted((DEFINITIONS[k].name, n) for k, n in self._counts.items()))

    def table(self, name: str, system_id: int, component_id: int | None = None) -> NDArray[np.void]:
        """All messages of a name from one system, as a structured array with the message's fields.

        Args:
            component_id: sender; None: any component of the system.
        """
        found = definition(name)
        dtype = record_dtype(found)
        parts = [
            payload
            for (message_id, system, component), payloads in self._payloads.items()
            if message_id == found.message_id and system == system_id and component_id in (None, component)
            for payload in payloads
        ]
        size = dtype.itemsize
        return np.frombuffer(b"".join(p[:size].ljust(size, b"\0") for p in parts), dtype=dtype)


class FlightRecorder:
    """Writes the frames of all connections, and the truth, to the log and the records.

    Args:
        log: an open log.
        epoch_us: Unix time of vehicle time 0 (embedded flights), or None to stamp with `unix_time_us`.
        unix_time_us: wall clock for flights of vehicles that are not embedded.

    Attributes:
        records: records of all frames.
        failure: reason why the log can no longer be written. The log ends there, and recording continues
            without it. "" without a failure.
    """

    def __init__(self, log: TlogWriter, *, epoch_us: int | None, unix_time_us: UnixTime) -> None:
        self.records = FlightRecords()
        self.failure = ""
        self._log = log
        self._epoch_us = epoch_us
        self._unix_time_us = unix_time_us

    def record(self, frame: bytes, time_us: int) -> None:
        """Log one frame that was sent or received at vehicle time `time_us`."""
        stamp = self._unix_time_us() if self._epoch_us is None else self._epoch_us + time_us
        if not self.failure:
            try:
                self._log.write(stamp, frame)
            except TlogError as error:
                self.failure = str(error)
        self.records.add(frame)

    def record_truth(self, time_us: int, frame: bytes) -> None:
        """Log one frame of truth."""
        self.record(frame, time_us)

    def flush(self) -> None:
        """Pass all data to the operating system, so that `failure` is up to date."""
        self._try(self._log.flush)

    def close(self) -> None:
        """Close the log."""
        self._try(self._log.close)

    def _try(self, write: Callable[[], None]) -> None:
        try:
            write()
        except TlogError as error:
            self.failure = self.failure or str(error)
