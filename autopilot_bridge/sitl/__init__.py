"""SITL: the runner that steps worlds and autopilots together, embedded or for clients on real links."""

from autopilot_bridge.firmware.simulator import Port, default_ports
from autopilot_bridge.sitl.backend import (
    AutopilotBackend,
    BackendLinks,
    BackendMaker,
    BackendSetup,
    EmulatedBackend,
    emulated,
)
from autopilot_bridge.sitl.containment import VehicleFailure
from autopilot_bridge.sitl.server import PaceReport, SitlServer
from autopilot_bridge.sitl.signing import SigningParameters, SigningStore, UnsignedFrom
from autopilot_bridge.sitl.sitl import PacketLog, Sitl
from autopilot_bridge.sitl.vehicle import SitlVehicle
from autopilot_bridge.sitl.warm_up import compile_flight_code

__all__ = [
    "AutopilotBackend",
    "BackendLinks",
    "BackendMaker",
    "BackendSetup",
    "EmulatedBackend",
    "PaceReport",
    "PacketLog",
    "Port",
    "SigningParameters",
    "SigningStore",
    "Sitl",
    "SitlServer",
    "SitlVehicle",
    "UnsignedFrom",
    "VehicleFailure",
    "compile_flight_code",
    "default_ports",
    "emulated",
]
