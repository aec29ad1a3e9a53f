"""Serial links (POSIX): USB, UART, and pseudo terminals."""

import os
import termios
from collections.abc import Callable
from typing import Final

import serial

from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.errors import LinkError
from autopilot_bridge.links.address import SerialPort
from autopilot_bridge.links.link import MAX_READS, LinkCounters, PeerId, SendQueue

REOPEN_INTERVAL_S: Final = 1.0
_READ_SIZE: Final = 4096
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
            self._port: serial.Serial | None = self._open()
        except (serial.SerialException, OSError, ValueError, termios.error) as error:
            raise _open_error(address, error) from error

    @property
    def bytes_per_s(self) -> float:
        """The line's capacity in one direction, bytes per second."""
        return self._address.baud / _BITS_PER_BYTE

    @property
    def connected(self) -> bool:
        """The device is present."""
        return self._port is not None

    @property
    def peers(self) -> tuple[PeerId, ...]:
        """The device, while it is present."""
        return (self._peer,) if self._port is not None else ()

    @property
    def congested(self) -> bool:
        """True while much data waits for the line."""
        return self._queue.congested

    def send(self, data: bytes, to: PeerId | None = None) -> None:
        """Send; the data are dropped while the device is not present."""
        if self._port is None:
            self.counters.dropped += 1
            self.counters.bytes_dropped += len(data)
            return
        try:
            self._queue.send(data, self._write)
        except OSError:
            self._unplugged()

    def receive(self) -> list[tuple[PeerId, bytes]]:
        """All received bytes."""
        received: list[tuple[PeerId, bytes]] = []
        if self._closed or (self._port is None and not self._reopen()):
            return received
        assert self._port is not None
        try:
            self._queue.flush(self._write)
            for _ in range(MAX_READS):
                data = os.read(self._port.fileno(), _READ_SIZE)
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
        """The device, while it is present."""
        return () if self._port is None else (self._port.fileno(),)

    def close(self) -> None:
        """Close the device permanently."""
        self._closed = True
        if self._port is not None:
            self._queue.clear()
            self._port.close()
            self._port = None

    def _open(self) -> serial.Serial:
        # `exclusive`: a second program on the same port would take part of the bytes.
        opened = serial.Serial(
            self._address.device, self._address.baud, timeout=0, write_timeout=0, exclusive=True
        )
        # With pyserial's VMIN = 0, read() returns the same for "no data" and "disconnected".
        attributes = termios.tcgetattr(opened.fileno())
        attributes[6][termios.VMIN] = 1
        termios.tcsetattr(opened.fileno(), termios.TCSANOW, attributes)
        os.set_blocking(opened.fileno(), False)
        self.counters.connects += 1
        return opened

    def _write(self, data: bytes) -> int:
        # Not pyserial's write: it loops without a pause while the line accepts nothing.
        assert self._port is not None
        return os.write(self._port.fileno(), data)

    def _unplugged(self) -> None:
        assert self._port is not None
        self.counters.errors += 1
        self.counters.disconnects += 1
        self._queue.clear()
        self._port.close()
        self._port = None
        self._last_attempt_s = self._monotonic()

    def _reopen(self) -> bool:
        if self._monotonic() - self._last_attempt_s < REOPEN_INTERVAL_S:
            return False
        self._last_attempt_s = self._monotonic()
        try:
            self._port = self._open()
        except (serial.SerialException, OSError, ValueError, termios.error):
            self.counters.errors += 1
            return False
        return True


def _open_error(address: SerialPort, error: Exception) -> LinkError:
    text = str(error)
    if "lock" in text:
        advice = "another program has it open: stop that program"
    elif not os.path.exists(address.device):
        advice = "there is no such device: check the cable, `ls /dev/tty*` lists the devices"
    elif isinstance(error, OSError) and error.errno == 13:
        advice = "not permitted: add yourself to the group that owns it (often 'dialout')"
    else:
        advice = "check the device and the baud rate"
    return LinkError(f"can't open {address}: {advice} ({text})")
