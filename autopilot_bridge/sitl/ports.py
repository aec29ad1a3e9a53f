"""Where clients of each firmware look for its SITL (docs/firmware/px4.md and ardupilot.md, section 1)."""

from dataclasses import dataclass
from typing import Final

from autopilot_bridge.links import Address, TcpServer, UdpPeer

LOOPBACK: Final = "127.0.0.1"
_PX4_LAST_ONBOARD: Final = 9
_ARDUPILOT_SERIAL_PORTS: Final = (5760, 5762, 5763)


@dataclass(frozen=True, slots=True)
class Port:
    """One link of a vehicle: its address, and the streams that run on it ("onboard" or "gcs")."""

    address: Address
    role: str


def default_ports(flavour: str, index: int) -> tuple[Port, ...]:
    """The links of vehicle `index` (0, 1, ...).

    PX4 sends to UDP 14540 + index (at most 14549) for onboard computers and to 14550 for the ground station,
    from 14580 + index and 18570 + index. ArduPilot listens on TCP 5760, 5762 and 5763, each + 10 index.
    """
    if flavour == "ardupilot":
        return tuple(Port(TcpServer(LOOPBACK, port + 10 * index), "gcs") for port in _ARDUPILOT_SERIAL_PORTS)
    onboard = 14540 + min(index, _PX4_LAST_ONBOARD)
    return (
        Port(UdpPeer(LOOPBACK, 14580 + index, LOOPBACK, onboard), "onboard"),
        Port(UdpPeer(LOOPBACK, 18570 + index, LOOPBACK, 14550), "gcs"),
    )
