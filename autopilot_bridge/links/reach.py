"""Who can get at a link."""

import ipaddress
from enum import StrEnum
from typing import Final

from autopilot_bridge.links.address import Address, ReplayLog, SerialPort, TcpServer, UdpPeer, UdpServer

_LOCAL_NAMES: Final = frozenset({"localhost", "ip6-localhost"})


class Reach(StrEnum):
    """Who can get at a link.

    Attributes:
        PROCESS: only parts of this process (memory).
        CABLE: who has the cable (serial, USB), or a radio at its end.
        MACHINE: programs of this machine (loopback).
        NETWORK: whoever is on the network.
    """

    PROCESS = "process"
    CABLE = "cable"
    MACHINE = "machine"
    NETWORK = "network"


def reach_of(address: Address) -> Reach:
    """Who can get at a link of this address. Names other than "localhost" count as the network."""
    if isinstance(address, SerialPort | ReplayLog):
        return Reach.CABLE
    return Reach.MACHINE if _is_loopback(address.host) else Reach.NETWORK


def listens_to_network(address: Address) -> bool:
    """Anybody on the network can send to the link, not only the one it was opened to."""
    return isinstance(address, UdpServer | UdpPeer | TcpServer) and reach_of(address) is Reach.NETWORK


def open_unsigned(address: Address | str) -> str:
    """The warning for a link that is open to a network and takes unsigned frames."""
    return (
        f"{address} is open to the network and unsigned: whoever can send there can fly the vehicle; "
        "give --signing-key FILE, or listen on 127.0.0.1"
    )


def _is_loopback(host: str) -> bool:
    if host.lower() in _LOCAL_NAMES:
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
