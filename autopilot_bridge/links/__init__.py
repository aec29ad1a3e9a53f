"""Links: bytes to and from peers over memory, UDP, TCP, serial lines and logs. Non-blocking."""

from autopilot_bridge.links.address import (
    VEHICLE_FORMS,
    Address,
    ReplayLog,
    SerialPort,
    TcpClient,
    TcpServer,
    UdpClient,
    UdpPeer,
    UdpServer,
    parse_address,
)
from autopilot_bridge.links.factory import open_link
from autopilot_bridge.links.link import Link, LinkCounters, PeerId
from autopilot_bridge.links.lossy import Impairment, LossyLink
from autopilot_bridge.links.memory import MemoryLink, memory_pair
from autopilot_bridge.links.reach import Reach, listens_to_network, open_unsigned, reach_of
from autopilot_bridge.links.replay import ReplayLink
from autopilot_bridge.links.serial_port import SerialLink
from autopilot_bridge.links.tcp import TcpClientLink, TcpServerLink
from autopilot_bridge.links.udp import UdpLink

__all__ = [
    "VEHICLE_FORMS",
    "Address",
    "Impairment",
    "Link",
    "LinkCounters",
    "LossyLink",
    "MemoryLink",
    "PeerId",
    "Reach",
    "ReplayLink",
    "ReplayLog",
    "SerialLink",
    "SerialPort",
    "TcpClient",
    "TcpClientLink",
    "TcpServer",
    "TcpServerLink",
    "UdpClient",
    "UdpLink",
    "UdpPeer",
    "UdpServer",
    "listens_to_network",
    "memory_pair",
    "open_link",
    "open_unsigned",
    "parse_address",
    "reach_of",
]
