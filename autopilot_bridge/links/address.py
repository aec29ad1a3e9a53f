"""Connection strings in the forms of pymavlink and MAVSDK, as typed values. Opens nothing.

udpin:127.0.0.1:14550          listen on UDP (also udp:, udpin://, udp://)
udpout:192.168.1.2:14550       send to a UDP address (also udpout://)
udppeer:14580,127.0.0.1:14540  own UDP port and a partner to send to from the start, as PX4 does
tcp:127.0.0.1:5760             connect by TCP (also tcpout:, tcp://, tcpout://)
tcpin:127.0.0.1:5760           listen on TCP (also tcpin://)
serial:/dev/ttyACM0:115200     serial port and baud rate (also serial://, and /dev/ttyACM0,115200)
COM3,57600                     the same on Windows (also serial:COM3:57600, and \\\\.\\COM12,57600)
./ttyV0,57600                  the same of a device anywhere, such as a link to a pseudo-terminal: DEVICE,BAUD
flight.tlog                    telemetry log, replayed
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from autopilot_bridge.errors import AddressError

LOOPBACK: Final = "127.0.0.1"
DEFAULT_BAUD: Final = 115200
VEHICLE_FORMS: Final = (
    "udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:HOST:PORT (each also with ://), "
    "serial:DEVICE:BAUD or DEVICE,BAUD"
)
"""A remote address, in the same form for every kind of client."""
ACCEPTED_FORMS: Final = (
    "udpin:HOST:PORT, udpout:HOST:PORT, udppeer:HOST:PORT,HOST:PORT, tcp:HOST:PORT, tcpin:HOST:PORT "
    "(each also with ://), serial:DEVICE:BAUD, DEVICE,BAUD, or a path ending in .tlog"
)


@dataclass(frozen=True, slots=True)
class _HostPort:
    host: str
    port: int

    def _text(self) -> str:
        return _join(self.host, self.port)


class UdpServer(_HostPort):
    """Listen on a UDP port; every sender becomes a peer. Port 0: any free one."""

    __slots__ = ()

    def __str__(self) -> str:
        return f"udpin:{self._text()}"


class UdpClient(_HostPort):
    """Send to a UDP address and receive its answers."""

    __slots__ = ()

    def __str__(self) -> str:
        return f"udpout:{self._text()}"


@dataclass(frozen=True, slots=True)
class UdpPeer:
    """An own UDP port and a remote that is sent to from the start; the first sender received replaces it."""

    host: str
    port: int
    remote_host: str
    remote_port: int

    def __str__(self) -> str:
        return f"udppeer:{_join(self.host, self.port)},{_join(self.remote_host, self.remote_port)}"


class TcpClient(_HostPort):
    """Connect to a TCP server."""

    __slots__ = ()

    def __str__(self) -> str:
        return f"tcp:{self._text()}"


class TcpServer(_HostPort):
    """Listen on a TCP port for any number of clients. Port 0: any free one."""

    __slots__ = ()

    def __str__(self) -> str:
        return f"tcpin:{self._text()}"


@dataclass(frozen=True, slots=True)
class SerialPort:
    """A serial device: 8 data bits, no parity, 1 stop bit, no flow control."""

    device: str
    baud: int = DEFAULT_BAUD

    def __str__(self) -> str:
        return f"serial:{self.device}:{self.baud}"


@dataclass(frozen=True, slots=True)
class ReplayLog:
    """A telemetry log that is replayed as a read-only link."""

    path: Path

    def __str__(self) -> str:
        return str(self.path)


Address = UdpServer | UdpClient | UdpPeer | TcpClient | TcpServer | SerialPort | ReplayLog

_SERVERS: Final[dict[str, type[UdpServer | TcpServer]]] = {
    "udp": UdpServer,
    "udpin": UdpServer,
    "tcpin": TcpServer,
}
_CLIENTS: Final[dict[str, type[UdpClient | TcpClient]]] = {
    "udpout": UdpClient,
    "tcp": TcpClient,
    "tcpout": TcpClient,
}
_SCHEME: Final = re.compile(r"([A-Za-z]+):(//)?(.*)", re.DOTALL)
_DEVICE: Final = re.compile(r"/dev/.+|(\\\\\.\\)?COM\d+(,.*)?", re.IGNORECASE)


def parse_address(text: str, accepted: str = ACCEPTED_FORMS) -> Address:
    """The address in a connection string; `str()` of the result is its canonical form.

    Servers without a host listen on loopback only. `udp:` means `udpin:`, as in pymavlink and MAVSDK.

    Args:
        accepted: text of the accepted forms in an error message; all forms are parsed.

    Raises:
        AddressError: the text has none of the forms; the message names the accepted ones.
    """
    try:
        return _parsed(text)
    except _Refused as refusal:
        raise AddressError(f"connection {text!r}: {refusal}; accepted: {accepted}") from None


class _Refused(ValueError):
    """Why a text is not an address."""


def _parsed(text: str) -> Address:
    stripped = text.strip()
    if stripped.lower().endswith(".tlog"):
        return ReplayLog(Path(stripped))
    if _DEVICE.fullmatch(stripped):
        return _serial(*_split_baud(stripped, ","))
    match = _SCHEME.fullmatch(stripped)
    if match is None:
        device, comma, baud = stripped.rpartition(",")
        if comma and device:
            return _serial(device, baud or "none")
        raise _Refused("no such form")
    scheme, rest = match[1].lower(), match[3]
    if scheme == "serial":
        device, baud = _split_baud(rest, "," if "," in rest else ":")
        return _serial(device, baud)
    if scheme == "udppeer":
        local, comma, remote = rest.partition(",")
        if not comma:
            raise _Refused("the partner after the comma is missing")
        return UdpPeer(*_host_port(local, server=True), *_host_port(remote, server=False))
    if scheme in _SERVERS:
        return _SERVERS[scheme](*_host_port(rest, server=True))
    if scheme in _CLIENTS:
        return _CLIENTS[scheme](*_host_port(rest, server=False))
    raise _Refused(f"unknown kind '{scheme}:'")


def _host_port(rest: str, *, server: bool) -> tuple[str, int]:
    place = rest.strip().rstrip("/")
    host, colon, port_text = place.rpartition(":")
    if not place:
        raise _Refused("the port is missing" if server else "host and port are missing")
    if not place.isdigit() and (not port_text or not colon or place.endswith("]")):
        raise _Refused("the port is missing")
    host = host.removeprefix("[").removesuffix("]")
    if not host:
        if not server:
            raise _Refused("the host is missing")
        host = LOOPBACK
    if re.search(r"[\s,/\[\]]", host):
        raise _Refused(f"host {host!r} is not a name or an address")
    lowest = 0 if server else 1
    if not (port_text.isascii() and port_text.isdigit()) or not lowest <= int(port_text) <= 65535:
        raise _Refused(f"port {port_text!r} is not in {lowest}..65535")
    return host, int(port_text)


def _split_baud(rest: str, separator: str) -> tuple[str, str]:
    head, found, tail = rest.rpartition(separator)
    # A colon may also belong to the device ("serial:/dev/serial/by-path/pci-0000:00:14.0").
    if not found or (separator == ":" and not tail.isdigit() and tail):
        return rest, ""
    return head, tail


def _serial(device: str, baud_text: str) -> SerialPort:
    if not device or re.search(r"[\s,]", device):
        raise _Refused(f"device {device!r} is not a serial port")
    if not baud_text:
        return SerialPort(device)
    if not (baud_text.isascii() and baud_text.isdigit()) or not 1 <= int(baud_text) <= 20_000_000:
        raise _Refused(f"baud rate {baud_text!r} is not a number such as {DEFAULT_BAUD}")
    return SerialPort(device, int(baud_text))


def _join(host: str, port: int) -> str:
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
