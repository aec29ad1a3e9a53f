"""An open serial device as `SerialLink` reads and writes it, in the way of each operating system."""

import os
import sys
from typing import Protocol

import serial

from autopilot_bridge.links.address import SerialPort

_READ_BYTES = 4096
_BUFFER_BYTES = 1 << 16  # Windows' own buffer; 4096 bytes are 44 ms at 921600 baud


class SerialLine(Protocol):
    """An open serial device. What fails raises OSError: the device is gone."""

    def read(self) -> bytes:
        """The received bytes, some of them at least; none at all: it hung up.

        Raises:
            BlockingIOError: nothing was received.
        """
        ...

    def write(self, data: bytes) -> int:
        """Write as much as the line accepts now, and return the number of bytes.

        Raises:
            BlockingIOError: it accepts nothing now.
        """
        ...

    def filenos(self) -> tuple[int, ...]:
        """The descriptor to watch for reading; none where a serial port has none."""
        ...

    def close(self) -> None: ...


class PolledLine:
    """A line by pyserial alone, which must be polled: Windows has no descriptors of serial ports to watch."""

    def __init__(self, address: SerialPort) -> None:
        self._port = _opened(address)
        if sys.platform == "win32":
            self._port.set_buffer_size(rx_size=_BUFFER_BYTES, tx_size=_BUFFER_BYTES)

    def read(self) -> bytes:
        waiting: int = self._port.in_waiting
        if not waiting:
            raise BlockingIOError
        data: bytes = self._port.read(min(waiting, _READ_BYTES))
        return data

    def write(self, data: bytes) -> int:
        if self._port.out_waiting:  # pyserial would reuse the buffer that Windows still sends
            raise BlockingIOError
        return int(self._port.write(data) or 0)

    def filenos(self) -> tuple[int, ...]:
        return ()

    def close(self) -> None:
        self._port.close()


def _opened(address: SerialPort) -> serial.Serial:
    # `exclusive`: a second program on the same port would take part of the bytes.
    return serial.Serial(address.device, address.baud, timeout=0, write_timeout=0, exclusive=True)


if sys.platform == "win32":
    open_line = PolledLine
else:
    import termios

    class DescriptorLine:
        """A line by its file descriptor (POSIX): USB, UART, and pseudo-terminals."""

        def __init__(self, address: SerialPort) -> None:
            try:
                self._port = _opened(address)
                # With pyserial's VMIN = 0, read() returns the same for "no data" and "disconnected".
                attributes = termios.tcgetattr(self._port.fileno())
                attributes[6][termios.VMIN] = 1
                termios.tcsetattr(self._port.fileno(), termios.TCSANOW, attributes)
            except termios.error as error:
                raise OSError(*error.args) from error
            os.set_blocking(self._port.fileno(), False)

        def read(self) -> bytes:
            return os.read(self._port.fileno(), _READ_BYTES)

        def write(self, data: bytes) -> int:
            # Not pyserial's write: it loops without a pause while the line accepts nothing.
            return os.write(self._port.fileno(), data)

        def filenos(self) -> tuple[int, ...]:
            return (self._port.fileno(),)

        def close(self) -> None:
            self._port.close()

    open_line = DescriptorLine
