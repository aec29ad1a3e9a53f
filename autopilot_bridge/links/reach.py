"""Which processes can reach a link."""

import ipaddress
from enum import StrEnum
from typing import Final

from autopilot_bridge.links.address import Address, ReplayLog, SerialPort, TcpServer, UdpPeer, UdpServer

_LOCAL_NAMES: Final = frozenset({"localhost", "ip6-localhost"})


class Reach(StrEnum):
    """Which processes can reach a link.

    Attributes:
        PROCESS: only parts of this process (memory).
        CABLE: devices at the cable (serial, USB), or at a radio at its end.
        MACHINE: programs of this machine (loopback).
        NETWORK: all hosts of the network.
    """

    PROCESS = "process"
    CABLE = "cable"
    MACHINE = "machine"
    NETWORK = "network"


def reach_of(address: Address) -> Reach:
    """The reach of a link with this address. Names other than "localhost" count as the network."""
    if isinstance(address, SerialPort | ReplayLog):
        return Reach.CABLE
    return Reach.MACHINE if _is_loopback(address.host) else Reach.NETWORK


def listens_to_network(address: Address) -> bool:
    """Every host of the network can send to the link, not only the one it was opened to."""
    return isinstance(address, UdpServer | UdpPeer | TcpServer) and reach_of(address) is Reach.NETWORK


def open_unsigned(address: Address | str) -> str:
    """The warning for a link that is open to a network and accepts unsigned frames."""
    return (
        f"{address} is open to the network and unsigned: whoever can send there can fly the vehicle; "
        "give `signing_key` FILE, or listen on 127.0.0.1"
    )


def _is_loopback(host: str) -> bool:
    if host.lower() in _LOCAL_NAMES:
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
