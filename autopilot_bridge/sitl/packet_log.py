"""The log of a SITL (.tlog): packets as sent by the vehicles, split into frames when the log is flushed."""

from pathlib import Path

from autopilot_bridge.errors import TlogError
from autopilot_bridge.telemetry.packet_records import packet_records
from autopilot_bridge.tlog import FLUSH_BYTES, FLUSH_INTERVAL_US, TlogWriter


class PacketLog(TlogWriter):
    """A log that records our channels; see `TlogWriter`.

    Attributes:
        records: number of frames handed to the operating system.
    """

    __slots__ = ("_packets", "_times_us")

    def __init__(self, path: Path | str) -> None:
        super().__init__(path)
        self._times_us: list[int] = []
        self._packets: list[bytes] = []

    def write_packet(self, time_us: int, packet: bytes) -> None:
        """Append the frames of a packet that one of our channels has sent.

        Args:
            time_us: microseconds of the Unix epoch.
            packet: one or more consecutive frames.

        Raises:
            TlogError: a packet since the last flush does not end with a frame (the packets before it are
            written), the log is closed, or the disk is full.
        """
        self._times_us.append(time_us)
        self._packets.append(packet)
        self._kept += len(packet)
        if self._kept >= FLUSH_BYTES or not 0 <= time_us - self._flushed_us < FLUSH_INTERVAL_US:
            self._flushed_us = time_us
            self.flush()

    def write(self, time_us: int, frame: bytes) -> None:
        """Append one frame, after the packets before it."""
        self.write_packet(time_us, frame)

    def flush(self) -> None:
        """Write everything to the operating system.

        Raises:
            TlogError: a packet does not end with a frame, the log is closed, or the disk is full.
        """
        wrong = self._take_apart() if self._packets else ""
        super().flush()
        if wrong:
            raise TlogError(wrong)

    def _take_apart(self) -> str:
        """Split the packets into records; returns the error, or an empty text."""
        data, count, wrong = packet_records(self._times_us, self._packets)
        self._times_us.clear()
        self._packets.clear()
        self._buffer += data
        self.records += count
        return wrong
