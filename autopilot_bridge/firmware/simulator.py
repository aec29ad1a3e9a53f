"""What a SITL of each firmware has by default: its links, its GPS receiver, how it starts.

Source: docs/firmware/px4.md and ardupilot.md, section 1.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from autopilot_bridge.links import Address, TcpServer, UdpPeer
from flightsim.sensors import FIX_AFTER_10_S, FIX_AT_BOOT, RTK_FIX_AFTER_10_S, GpsFixStage

LOOPBACK: Final = "127.0.0.1"
_PX4_LAST_ONBOARD: Final = 9
_ARDUPILOT_SERIAL_PORTS: Final = (5760, 5762, 5763)


@dataclass(frozen=True, slots=True)
class Port:
    """One link of a vehicle: its address, and the streams that run on it ("onboard" or "gcs")."""

    address: Address
    role: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorDefaults:
    """The SITL of one firmware.

    Attributes:
        ports: the links of vehicle `index` (0, 1, ...), where its clients look for it.
        fix_timelines: how a GPS receiver of a kind ("standalone", "differential") starts.
        system_id_of_instance: the system id follows the instance.
        waits_for_client: the simulation starts when a client is on the first link.
        streams_on_request: a link carries only the streams that were requested on it.
    """

    ports: Callable[[int], tuple[Port, ...]]
    fix_timelines: Mapping[str, tuple[GpsFixStage, ...]]
    system_id_of_instance: bool
    waits_for_client: bool
    streams_on_request: bool


def _px4_ports(index: int) -> tuple[Port, ...]:
    onboard = 14540 + min(index, _PX4_LAST_ONBOARD)
    return (
        Port(UdpPeer(LOOPBACK, 14580 + index, LOOPBACK, onboard), "onboard"),
        Port(UdpPeer(LOOPBACK, 18570 + index, LOOPBACK, 14550), "gcs"),
    )


def _ardupilot_ports(index: int) -> tuple[Port, ...]:
    return tuple(Port(TcpServer(LOOPBACK, port + 10 * index), "gcs") for port in _ARDUPILOT_SERIAL_PORTS)


_SIMULATORS: Final[Mapping[str, SimulatorDefaults]] = MappingProxyType(
    {
        "px4": SimulatorDefaults(
            ports=_px4_ports,
            fix_timelines={"standalone": FIX_AT_BOOT, "differential": FIX_AT_BOOT},
            system_id_of_instance=True,
            waits_for_client=False,
            streams_on_request=False,
        ),
        "ardupilot": SimulatorDefaults(
            ports=_ardupilot_ports,
            fix_timelines={"standalone": FIX_AFTER_10_S, "differential": RTK_FIX_AFTER_10_S},
            system_id_of_instance=False,
            waits_for_client=True,
            streams_on_request=True,
        ),
    }
)


def simulator_defaults(flavour: str) -> SimulatorDefaults:
    """The SITL of a flavour.

    Raises:
        ValueError: there is no such flavour; the message lists the names.
    """
    defaults = _SIMULATORS.get(flavour)
    if defaults is None:
        raise ValueError(f"no autopilot flavour {flavour!r}; accepted: {', '.join(_SIMULATORS)}")
    return defaults


def default_ports(flavour: str, index: int) -> tuple[Port, ...]:
    """The links of vehicle `index` (0, 1, ...).

    PX4 sends to UDP 14540 + index (at most 14549) for onboard computers and to 14550 for the ground station,
    from 14580 + index and 18570 + index. ArduPilot listens on TCP 5760, 5762 and 5763, each + 10 index.
    """
    return simulator_defaults(flavour).ports(index)
