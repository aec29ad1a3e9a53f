"""A serial line of pseudo terminals that carries no more than a real one: 10 bits a byte, both ways, and some
latency; the plug can be pulled and put in again.
"""

import contextlib
import os
import select
import threading
import time
import tty
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

BITS_PER_BYTE: Final = 10
BUFFER_BYTES: Final = 65536
"""What a driver takes before the writer has to wait."""
_TICK_S: Final = 0.002
Taps = tuple[Callable[[bytes], None], Callable[[bytes], None]]


@dataclass
class Direction:
    """One way of the line.

    Attributes:
        carried_bytes: so far.
        longest_wait_s: of a byte that waited for the line to carry those before it, by the wall clock.
        tap: called with what is given to the line.
    """

    bytes_per_s: float
    latency_s: float
    carried_bytes: int = 0
    longest_wait_s: float = 0.0
    tap: Callable[[bytes], None] | None = None
    _queue: deque[tuple[float, bytes]] = field(default_factory=deque)
    _queued_bytes: int = 0
    _budget: float = 0.0

    @property
    def full(self) -> bool:
        return self._queued_bytes >= BUFFER_BYTES

    def put(self, data: bytes, now_s: float) -> None:
        self._queue.append((now_s + self.latency_s, data))
        self._queued_bytes += len(data)
        if self.tap is not None:
            self.tap(data)

    def take(self, now_s: float, elapsed_s: float) -> bytes:
        """What arrives now."""
        self._budget = min(
            self._budget + elapsed_s * self.bytes_per_s, max(1.0, (elapsed_s + _TICK_S) * self.bytes_per_s)
        )
        out = bytearray()
        while self._queue and self._queue[0][0] <= now_s and self._budget >= 1.0:
            due_s, data = self._queue.popleft()
            self.longest_wait_s = max(self.longest_wait_s, now_s - due_s)
            taken = min(len(data), int(self._budget))
            out += data[:taken]
            self._budget -= taken
            if taken < len(data):
                self._queue.appendleft((due_s, data[taken:]))
        self._queued_bytes -= len(out)
        self.carried_bytes += len(out)
        return bytes(out)

    def clear(self) -> None:
        self._queue.clear()
        self._queued_bytes = 0


class SerialLine:
    """Two devices joined like the ends of a null-modem cable.

    Args:
        folder: the devices' names appear in it, and stay the same when the plug is put in again.
        baud: of wall time.
        latency_s: one way.
        taps: called with what the first and the second end have given to the line.

    Attributes:
        down: what the first end sends; up: what the second sends.
    """

    def __init__(
        self, folder: Path, baud: int, *, latency_s: float = 0.005, taps: Taps | None = None
    ) -> None:
        self.baud = baud
        self.names = (folder / "ttyVehicle", folder / "ttyGround")
        rate = baud / BITS_PER_BYTE
        self.down, self.up = Direction(rate, latency_s), Direction(rate, latency_s)
        if taps is not None:
            self.down.tap, self.up.tap = taps
        self._lock = threading.Lock()
        self._masters: list[int] = []
        self._slaves: list[int] = []
        self._stopped = threading.Event()
        self._worker = threading.Thread(target=self._pump, daemon=True)
        self.plug()
        self._worker.start()

    @property
    def vehicle(self) -> str:
        """Connection string of the vehicle's end."""
        return f"serial:{self.names[0]}:{self.baud}"

    @property
    def ground(self) -> str:
        """Connection string of the other end."""
        return f"serial:{self.names[1]}:{self.baud}"

    def plug(self) -> None:
        """Put the plugs in: the devices appear."""
        pairs = [os.openpty(), os.openpty()]
        for (master, slave), name in zip(pairs, self.names, strict=True):
            tty.setraw(slave)
            os.set_blocking(master, False)
            name.unlink(missing_ok=True)
            name.symlink_to(os.ttyname(slave))
        with self._lock:
            self._masters = [master for master, _ in pairs]
            self._slaves = [slave for _, slave in pairs]

    def unplug(self) -> None:
        """Pull the plugs: the devices are gone, and what was on the way is lost."""
        with self._lock:
            descriptors = [*self._masters, *self._slaves]
            self._masters, self._slaves = [], []
            for name in self.names:
                name.unlink(missing_ok=True)
            for descriptor in descriptors:
                os.close(descriptor)
            self.down.clear()
            self.up.clear()

    def close(self) -> None:
        self._stopped.set()
        self._worker.join()
        self.unplug()

    def _pump(self) -> None:
        last_s = time.monotonic()
        while not self._stopped.wait(_TICK_S):
            now_s = time.monotonic()
            elapsed_s, last_s = now_s - last_s, now_s
            with self._lock:
                if self._masters:
                    vehicle, ground = self._masters
                    self._move(vehicle, ground, self.down, now_s, elapsed_s)
                    self._move(ground, vehicle, self.up, now_s, elapsed_s)

    @staticmethod
    def _move(source: int, sink: int, way: Direction, now_s: float, elapsed_s: float) -> None:
        # both devices are held open here as well: no end ever looks hung up while the plugs are in
        if not way.full and select.select([source], [], [], 0.0)[0]:
            with contextlib.suppress(BlockingIOError):
                way.put(os.read(source, 65536), now_s)
        arrived = way.take(now_s, elapsed_s)
        if arrived:
            with contextlib.suppress(BlockingIOError):  # no reader there: lost, as on a cable
                os.write(sink, arrived)


@contextmanager
def serial_line(
    folder: Path, baud: int, *, latency_s: float = 0.005, taps: Taps | None = None
) -> Iterator[SerialLine]:
    """A plugged line, closed at the end."""
    folder.mkdir(parents=True, exist_ok=True)
    line = SerialLine(folder, baud, latency_s=latency_s, taps=taps)
    try:
        yield line
    finally:
        line.close()
