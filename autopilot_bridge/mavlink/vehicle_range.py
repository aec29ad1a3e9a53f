"""Ranges between vehicles in TUNNEL messages: one message per measured vehicle.

MAVLink has no message for the distance to another vehicle. DISTANCE_SENSOR is for obstacles in a direction of
the body, and has no field for a vehicle's identity. docs/mavlink/vehicle_range.md documents the payload.

All numbers are little-endian: version (uint8), system id of the measured vehicle (uint8), number (uint16),
standard deviation (float32), time (uint64, microseconds since the boot of the measuring vehicle), range
(float32).
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import dialect

__all__ = ["VEHICLE_RANGE_PAYLOAD", "VehicleRange", "range_message", "read_range_payload"]

VEHICLE_RANGE_PAYLOAD: Final = 0xF519
"""Payload type; from 32768 on they are not registered (MAV_TUNNEL_PAYLOAD_TYPE)."""

_VERSION: Final = 1
_CONTENT: Final = struct.Struct("<BBHfQf")
_PAYLOAD_SIZE: Final = 128


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleRange:
    """One measured range.

    Attributes:
        to_system: system id of the measured vehicle, 1..255.
        number: counts the measurements of the sensor, modulo 2^16; a gap shows lost ones.
        time_us: vehicle time of the measurement.
        range_m: slant range, m.
        sigma_m: its standard deviation, m.
    """

    to_system: int
    number: int
    time_us: int
    range_m: float
    sigma_m: float


def range_message(measured: VehicleRange) -> dialect.MAVLink_tunnel_message:
    """The TUNNEL message of a range, to all systems and components."""
    payload = _CONTENT.pack(
        _VERSION,
        measured.to_system,
        measured.number & 0xFFFF,
        measured.sigma_m,
        measured.time_us,
        measured.range_m,
    )
    return dialect.MAVLink_tunnel_message(
        0, 0, VEHICLE_RANGE_PAYLOAD, len(payload), list(payload.ljust(_PAYLOAD_SIZE, b"\0"))
    )


def read_range_payload(payload_type: int, length: int, payload: Sequence[int]) -> VehicleRange | None:
    """The content of a TUNNEL message; None for other payloads and for malformed ones. It never raises.

    Args:
        payload_type, length, payload: fields of the message.
    """
    if payload_type != VEHICLE_RANGE_PAYLOAD or not _CONTENT.size <= length <= len(payload):
        return None
    version, system, number, sigma_m, time_us, range_m = _CONTENT.unpack_from(bytes(payload[:length]))
    if version != _VERSION or not system:
        return None
    if not (math.isfinite(range_m + sigma_m) and range_m >= 0.0 and sigma_m > 0.0):
        return None
    return VehicleRange(to_system=system, number=number, time_us=time_us, range_m=range_m, sigma_m=sigma_m)
