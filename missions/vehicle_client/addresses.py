"""Conversion of our connection strings to those of MAVSDK."""

from pathlib import Path

from autopilot_bridge.links import (
    VEHICLE_FORMS,
    Address,
    ReplayLog,
    SerialPort,
    TcpClient,
    TcpServer,
    UdpClient,
    UdpPeer,
    UdpServer,
)
from missions.errors import PlanError


def mavsdk_url(address: Address) -> str:
    """The MAVSDK connection string for a link.

    Raises:
        PlanError: MAVSDK does not support this kind of link.
    """
    match address:
        case UdpServer():
            return f"udpin://{address.host}:{address.port}"
        case UdpClient():
            return f"udpout://{address.host}:{address.port}"
        case TcpClient():
            return f"tcpout://{address.host}:{address.port}"
        case TcpServer():
            return f"tcpin://{address.host}:{address.port}"
        case SerialPort():
            return f"serial://{Path(address.device).absolute()}:{address.baud}"
        case UdpPeer() | ReplayLog():
            raise PlanError(f"`connect` {address}: not for this command; accepted: {VEHICLE_FORMS}")
