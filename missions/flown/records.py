"""The frames of a flight: its log while it is flown, and columns of it afterwards."""

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.errors import TlogError
from autopilot_bridge.mavlink import DEFINITIONS, Packet, definition
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import degrees, metres, place_columns
from autopilot_bridge.packet_records import packet_records
from autopilot_bridge.tlog import TlogWriter
from estimators.logs.columns import decode_records, record_dtype
from estimators.logs.scan import STAMP_SIZE, FrameIndex, MessageTable, message_table, scan
from estimators.received import received_positions, together
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

UnixTime = Callable[[], int]
"""Returns microseconds of the Unix epoch."""

_MESSAGES: Final = 0  # column of `FrameIndex.stream_keys`


class FlightRecords:
    """All frames of a flight, as columns.

    Args:
        data: bytes of a telemetry log.
    """

    def __init__(self, data: NDArray[np.uint8]) -> None:
        self._data = data
        self._messages: MessageTable = message_table(DEFINITIONS)
        self._index: FrameIndex = scan(data, self._messages, STAMP_SIZE)
        self._positions: dict[tuple[str, int, int | None], tuple[NDArray[np.void], Mapping[str, int]]] = {}

    @classmethod
    def from_tlog(cls, path: Path) -> Self:
        """Records from an existing log."""
        return cls(np.fromfile(path, dtype=np.uint8))

    @classmethod
    def of_frames(cls, frames: Iterable[bytes]) -> Self:
        """Records of some valid frames."""
        packets = list(frames)
        return cls(np.frombuffer(packet_records([0] * len(packets), packets)[0], dtype=np.uint8))

    @cached_property
    def message_counts(self) -> dict[str, int]:
        """Frames by message name, sorted by name."""
        index = self._index
        by_stream = np.bincount(index.streams, minlength=len(index.stream_keys))
        counts = np.zeros(len(self._messages.ids), dtype=np.int64)
        np.add.at(counts, index.stream_keys[:, _MESSAGES], by_stream)
        named = zip(self._messages.ids.tolist(), counts.tolist(), strict=True)
        return dict(sorted((DEFINITIONS[message_id].name, count) for message_id, count in named if count))

    def table(self, name: str, system_id: int, component_id: int | None = None) -> NDArray[np.void]:
        """All messages of a name from one system, as a structured array with the message's fields.

        Args:
            component_id: sender; None: any component of the system, one after the other.
        """
        found = definition(name)
        message = int(np.searchsorted(self._messages.ids, found.message_id))
        index = self._index
        streams = [
            number
            for number, key in enumerate(index.stream_keys.tolist())
            if key[:2] == [message, system_id] and component_id in (None, key[2])
        ]
        tables = [decode_records(self._data, index.starts[index.streams == n], found) for n in streams]
        return np.concatenate(tables) if tables else np.empty(0, dtype=record_dtype(found))

    def truth(self, system_id: int, component_id: int | None = None) -> NDArray[np.void]:
        """HIL_STATE_QUATERNION of a system: what is known of its true state, in the order of its time.

        PX4's own simulator (SIH) sends these with `time_usec` 0: states without any time are left out. So are
        places and times that no vehicle can have (`left_out`).

        Args:
            component_id: sender; None: any component of the system, one after the other.
        """
        return self._sound("HIL_STATE_QUATERNION", system_id, component_id)[0]

    def positions(self, system_id: int) -> NDArray[np.void]:
        """GLOBAL_POSITION_INT of a vehicle's autopilot, in the order of its time.

        Positions at 0, 0 are left out, which ArduPilot sends until it has one, and places and times that no
        vehicle can have (`left_out`).
        """
        return self._sound("GLOBAL_POSITION_INT", system_id, AUTOPILOT_COMPONENT)[0]

    def left_out(self, system_id: int) -> dict[str, int]:
        """Number of messages that `truth` and `positions` leave out of a vehicle, by reason."""
        return together(
            self._sound("HIL_STATE_QUATERNION", system_id, None)[1],
            self._sound("GLOBAL_POSITION_INT", system_id, AUTOPILOT_COMPONENT)[1],
        )

    def _sound(
        self, name: str, system_id: int, component_id: int | None
    ) -> tuple[NDArray[np.void], Mapping[str, int]]:
        key = name, system_id, component_id
        if key not in self._positions:
            table = self.table(name, system_id, component_id)
            if name == "HIL_STATE_QUATERNION":
                table = table if table["time_usec"].any() else table[:0]
                time_us = table["time_usec"].astype(np.int64)
            else:
                table = table[(table["lat"] != 0) | (table["lon"] != 0)]
                time_us = table["time_boot_ms"].astype(np.int64) * 1000
            found = received_positions(time_us, *place_columns(table))
            self._positions[key] = table[found.rows], found.left_out
        return self._positions[key]


def place_of(row: np.void) -> GeodeticPosition:
    """The place in one message with `lat`, `lon` (degE7) and `alt` (mm)."""
    lat, lon, alt = (float(row[name]) for name in ("lat", "lon", "alt"))
    return GeodeticPosition(lat_deg=degrees(lat), lon_deg=degrees(lon), alt_m=metres(alt))


def positions_ned_m(table: NDArray[np.void], frame: LocalFrame) -> NDArray[np.float64]:
    """Local positions (n, 3) of messages with `lat`, `lon` (degE7) and `alt` (mm)."""
    return np.column_stack(frame.ned_from_geodetic(*place_columns(table)))


class FlightRecorder:
    """Writes the frames of all connections, and the truth, to the log.

    Args:
        log: an open log.
        epoch_us: Unix time of vehicle time 0 (embedded flights), or None to stamp with `unix_time_us`.
        unix_time_us: wall clock for flights of vehicles that are not embedded.

    Attributes:
        failure: reason why the log can no longer be written. The log ends there, and recording continues in
            memory. "" without a failure.
        acts: it does not act on frames.
    """

    acts: Final = False

    def __init__(self, log: TlogWriter, *, epoch_us: int | None, unix_time_us: UnixTime) -> None:
        self.failure = ""
        self._log = log
        self._write: Callable[[int, bytes], None] = log.write
        self._epoch_us = epoch_us
        self._unix_time_us = unix_time_us
        self._unlogged: tuple[list[int], list[bytes]] = [], []

    def record(self, packet: Packet, time_us: int) -> None:
        """Log frames that were sent or received together at vehicle time `time_us`."""
        self.record_truth(time_us, packet.data)

    def record_truth(self, time_us: int, frame: bytes) -> None:
        """Log one frame of truth."""
        stamp_us = self._unix_time_us() if self._epoch_us is None else self._epoch_us + time_us
        try:
            self._write(stamp_us, frame)
        except TlogError as error:
            self._fail(error)

    def _fail(self, error: TlogError) -> None:
        self.failure = self.failure or str(error)
        self._write = self._keep_unlogged

    def _keep_unlogged(self, stamp_us: int, packet: bytes) -> None:
        times_us, packets = self._unlogged
        times_us.append(stamp_us)
        packets.append(packet)

    def flush(self) -> None:
        """Pass all data to the operating system, so that `failure` is up to date."""
        self._try(self._log.flush)

    def close(self) -> None:
        """Close the log."""
        self._try(self._log.close)

    def records(self) -> FlightRecords:
        """All frames that were recorded, including those that the log has no room for. Close it before."""
        logged = np.fromfile(self._log.path, dtype=np.uint8)
        unlogged = self._log.unwritten + packet_records(*self._unlogged)[0]
        return FlightRecords(np.concatenate([logged, np.frombuffer(unlogged, dtype=np.uint8)]))

    def _try(self, write: Callable[[], None]) -> None:
        try:
            write()
        except TlogError as error:
            self._fail(error)
