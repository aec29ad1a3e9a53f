"""Serial links: USB, UART, and pseudo-terminals."""

import os
import sys
from collections.abc import Callable
from typing import Final

from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.errors import LinkError
from autopilot_bridge.links.address import SerialPort
from autopilot_bridge.links.link import MAX_READS, LinkCounters, PeerId, SendQueue
from autopilot_bridge.links.serial_line import SerialLine, open_line

REOPEN_INTERVAL_S: Final = 1.0
_BITS_PER_BYTE: Final = 10  # start bit, eight data bits, stop bit
_BACKLOG_S: Final = 0.5  # older data are dropped
_LEAST_BACKLOG_BYTES: Final = 4096  # enough for the answers on a slow line


class SerialLink:
    """A serial device. When it is unplugged, `receive` tries to open it again, at most once a second.

    Args:
        address: device and baud rate.
        monotonic: wall clock in seconds, for the time between attempts.

    Raises:
        LinkError: no such device, no permission, in use, or an impossible baud rate.
    """

    def __init__(self, address: SerialPort, *, monotonic: Callable[[], float] = wall_time_s) -> None:
        self._address = address
        self._monotonic = monotonic
        self._last_attempt_s = monotonic()
        self._peer: PeerId = (address.device, 0)
        self._closed = False
        self.description = str(address)
        self.counters = LinkCounters()
        self._queue = SendQueue(
            self.counters, max(_LEAST_BACKLOG_BYTES, round(_BACKLOG_S * self.bytes_per_s))
        )
        try:
            self._line: SerialLine | None = self._open()
        except (OSError, ValueError) as error:
            raise _open_error(address, error) from error

    @property
    def bytes_per_s(self) -> float:
        """The line's capacity in one direction, bytes per second."""
        return self._address.baud / _BITS_PER_BYTE

    @property
    def connected(self) -> bool:
        """The device is present."""
        return self._line is not None

    @property
    def peers(self) -> tuple[PeerId, ...]:
        """The device, while it is present."""
        return (self._peer,) if self._line is not None else ()

    @property
    def congested(self) -> bool:
        """True while much data waits for the line."""
        return self._queue.congested

    def send(self, data: bytes, to: PeerId | None = None) -> None:
        """Send; the data are dropped while the device is not present."""
        if self._line is None:
            self.counters.dropped += 1
            self.counters.bytes_dropped += len(data)
            return
        try:
            self._queue.send(data, self._line.write)
        except OSError:
            self._unplugged()

    def receive(self) -> list[tuple[PeerId, bytes]]:
        """All received bytes."""
        received: list[tuple[PeerId, bytes]] = []
        if self._closed or (self._line is None and not self._reopen()):
            return received
        assert self._line is not None
        try:
            self._queue.flush(self._line.write)
            for _ in range(MAX_READS):
                data = self._line.read()
                if not data:  # hung up
                    self._unplugged()
                    break
                self.counters.reads += 1
                self.counters.bytes_in += len(data)
                received.append((self._peer, data))
        except (BlockingIOError, InterruptedError):
            pass
        except OSError:
            self._unplugged()
        return received

    def filenos(self) -> tuple[int, ...]:
        """The device, while it is present and can be watched."""
        return () if self._line is None else self._line.filenos()

    def close(self) -> None:
        """Close the device permanently."""
        self._closed = True
        if self._line is not None:
            self._queue.clear()
            self._line.close()
            self._line = None

    def _open(self) -> SerialLine:
        opened = open_line(self._address)
        self.counters.connects += 1
        return opened

    def _unplugged(self) -> None:
        assert self._line is not None
        self.counters.errors += 1
        self.counters.disconnects += 1
        self._queue.clear()
        self._line.close()
        self._line = None
        self._last_attempt_s = self._monotonic()

    def _reopen(self) -> bool:
        if self._monotonic() - self._last_attempt_s < REOPEN_INTERVAL_S:
            return False
        self._last_attempt_s = self._monotonic()
        try:
            self._line = self._open()
        except (OSError, ValueError):
            self.counters.errors += 1
            return False
        return True


def _open_error(address: SerialPort, error: Exception) -> LinkError:
    text = str(error)
    if sys.platform == "win32":  # pyserial's text has the error's name, and COM3 is no path
        in_use, missing = "PermissionError" in text, "FileNotFoundError" in text
    else:
        in_use, missing = "lock" in text, not os.path.exists(address.device)
    if in_use:
        advice = "another program has it open: stop that program"
    elif missing:
        advice = "there is no such device: check the cable, `python -m serial.tools.list_ports` lists them"
    elif isinstance(error, OSError) and error.errno == 13:
        advice = "not permitted: add yourself to the group that owns it (often 'dialout')"
    else:
        advice = "check the device and the baud rate"
    return LinkError(f"can't open {address}: {advice} ({text})")
