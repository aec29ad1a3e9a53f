"""Opening of links from addresses."""

from collections.abc import Callable

from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.links.address import Address, ReplayLog, SerialPort, TcpClient, TcpServer, parse_address
from autopilot_bridge.links.link import Link
from autopilot_bridge.links.replay import ReplayLink
from autopilot_bridge.links.serial_port import SerialLink
from autopilot_bridge.links.tcp import TcpClientLink, TcpServerLink
from autopilot_bridge.links.udp import UdpLink


def open_link(
    address: Address | str,
    *,
    monotonic: Callable[[], float] = wall_time_s,
    time_us: Callable[[], int] | None = None,
) -> Link:
    """Open the link of an address (or connection string).

    Args:
        address: what to open.
        monotonic: wall clock in seconds, for silent peers and attempts to reconnect.
        time_us: the clock that paces a replay; the wall clock when not given.

    Raises:
        AddressError: the connection string is none of the accepted forms.
        LinkError: the link can't be opened; the message contains the solution.
        TlogError: the log to replay can't be read.
    """
    if isinstance(address, str):
        address = parse_address(address)
    if isinstance(address, TcpServer):
        return TcpServerLink(address, monotonic=monotonic)
    if isinstance(address, TcpClient):
        return TcpClientLink(address, monotonic=monotonic)
    if isinstance(address, SerialPort):
        return SerialLink(address, monotonic=monotonic)
    if isinstance(address, ReplayLog):
        return ReplayLink(address, time_us=time_us)
    return UdpLink(address, monotonic=monotonic)
