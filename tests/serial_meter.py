"""How long bytes would wait for a line, counted in the vehicle's own time.

On a busy machine a simulated vehicle stops now and then and catches up. In the wall clock it then sends more
than a line carries, which a vehicle never would; by its own time stamps it does not.
"""

from typing import Final

from autopilot_bridge.mavlink import Frame, FrameParser
from tests.serial_line import BITS_PER_BYTE

AUTOPILOT: Final = 1
_TIMESTAMPED: Final = {30: 0, 31: 0, 32: 0, 33: 0}
"""Message id: where its time_boot_ms is (ATTITUDE, ATTITUDE_QUATERNION, the positions)."""
_POSITION: Final = 33
_AIRBORNE_MM: Final = 3000
_LARGEST_STEP_S: Final = 1.0
"""More than that between two stamps: nothing is known of the time between, and the line was not busy."""


class Backlog:
    """What one way of the line has been given and has not carried.

    Attributes:
        longest_wait_s: of vehicle time, that a byte waited for those before it.
    """

    def __init__(self, bytes_per_s: float) -> None:
        self._rate = bytes_per_s
        self._bytes = 0.0
        self.longest_wait_s = 0.0

    def pass_time(self, seconds: float) -> None:
        self._bytes = max(0.0, self._bytes - seconds * self._rate)

    def add(self, size: int) -> None:
        self.longest_wait_s = max(self.longest_wait_s, self._bytes / self._rate)
        self._bytes += size


class LineMeter:
    """Reads what the vehicle and the ground give to a line.

    Args:
        baud: of vehicle time.

    Attributes:
        down, up: the two ways.
        vehicle_s: vehicle time over which there were stamps.
        longest_gap_s: between two stamps: how long the line was out.
        down_bytes, up_bytes: given to the line in that time.
        airborne_s: the part of it since the vehicle was first more than 3 m above home.
    """

    def __init__(self, baud: int) -> None:
        self.down, self.up = Backlog(baud / BITS_PER_BYTE), Backlog(baud / BITS_PER_BYTE)
        self.vehicle_s = self.longest_gap_s = 0.0
        self.down_bytes = self.up_bytes = 0
        self._left_ground_s: float | None = None
        self._parser = FrameParser()
        self._time_ms: int | None = None

    @property
    def airborne_s(self) -> float:
        return 0.0 if self._left_ground_s is None else self.vehicle_s - self._left_ground_s

    def take_down(self, data: bytes) -> None:
        """Bytes of the vehicle."""
        for frame in self._parser.feed(data):
            if frame.component_id == AUTOPILOT and frame.message_id in _TIMESTAMPED:
                self._look_at_the_clock(frame)
            if self._time_ms is not None:
                self.down.add(len(frame.raw))
                self.down_bytes += len(frame.raw)

    def take_up(self, data: bytes) -> None:
        """Bytes of the ground."""
        if self._time_ms is not None:
            self.up.add(len(data))
            self.up_bytes += len(data)

    def _look_at_the_clock(self, frame: Frame) -> None:
        offset = _TIMESTAMPED[frame.message_id]
        now_ms = int.from_bytes(frame.payload[offset : offset + 4].ljust(4, b"\0"), "little")
        if self._time_ms is not None:
            elapsed_s = max(0, now_ms - self._time_ms) * 1e-3
            self.longest_gap_s = max(self.longest_gap_s, elapsed_s)
            self.down.pass_time(elapsed_s)
            self.up.pass_time(elapsed_s)
            if elapsed_s <= _LARGEST_STEP_S:
                self.vehicle_s += elapsed_s
        self._time_ms = max(now_ms, self._time_ms or 0)
        if frame.message_id == _POSITION and self._left_ground_s is None:
            height_mm = int.from_bytes(frame.payload[16:20].ljust(4, b"\0"), "little", signed=True)
            if height_mm > _AIRBORNE_MM:
                self._left_ground_s = self.vehicle_s
