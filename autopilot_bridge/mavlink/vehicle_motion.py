"""Motion of an aircraft without GPS in TUNNEL messages, for another aircraft.

MAVLink's messages of velocity are against the ground. HIGHRES_IMU has all that is needed, at 50 Hz and more,
and each lost one is a lost piece of the way. So here are sums since the start: what is between two messages
is known from these two, however many were lost. docs/mavlink/handoff.md documents the payload.

All numbers are little-endian: version (uint8), system id of the sender (uint8), number (uint16), time
(uint64, microseconds since the sender's boot), way forward, right and down against the air, and turn, since
the start (float64, m and rad), velocity forward, right and down (float32, m/s), yaw rate (float32, rad/s),
magnetic heading (float32, rad), pressure altitude (float32, m); NaN for a heading or an altitude that is not
known.
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import dialect

__all__ = ["VEHICLE_MOTION_PAYLOAD", "VehicleMotion", "motion_message", "read_motion_payload"]

VEHICLE_MOTION_PAYLOAD: Final = 0xF51E
"""Payload type; from 32768 on they are not registered (MAV_TUNNEL_PAYLOAD_TYPE)."""

_VERSION: Final = 1
_CONTENT: Final = struct.Struct("<BBHQ4d6f")
_PAYLOAD_SIZE: Final = 128

Four = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleMotion:
    """Motion of one aircraft, in its level frame.

    Attributes:
        system: system id of the aircraft, 1 to 255: its onboard computer may have another one.
        number: counts the messages, modulo 2^16.
        time_us: vehicle time of the sender.
        sums: way forward, right and down against the air, each in the level frame of its time, m, and turn,
            rad; since the start.
        rates: their present rates: velocity against the air, whose norm is the true airspeed, m/s, and yaw
            rate, rad/s.
        heading_rad: magnetic heading; NaN: not known.
        height_m: pressure altitude; NaN: not known.
    """

    system: int
    number: int
    time_us: int
    sums: Four
    rates: Four
    heading_rad: float
    height_m: float


def motion_message(motion: VehicleMotion) -> dialect.MAVLink_tunnel_message:
    """The TUNNEL message of a motion, to all systems and components."""
    payload = _CONTENT.pack(
        *(_VERSION, motion.system, motion.number & 0xFFFF, motion.time_us),
        *(*motion.sums, *motion.rates, motion.heading_rad, motion.height_m),
    )
    return dialect.MAVLink_tunnel_message(
        0, 0, VEHICLE_MOTION_PAYLOAD, len(payload), list(payload.ljust(_PAYLOAD_SIZE, b"\0"))
    )


def read_motion_payload(payload_type: int, length: int, payload: Sequence[int]) -> VehicleMotion | None:
    """The content of a TUNNEL message; None for other payloads and for malformed ones. It never raises.

    Args:
        payload_type, length, payload: fields of the message.
    """
    if payload_type != VEHICLE_MOTION_PAYLOAD or not _CONTENT.size <= length <= len(payload):
        return None
    version, system, number, time_us, *values = _CONTENT.unpack_from(bytes(payload[:length]))
    if version != _VERSION or not system or not all(map(math.isfinite, values[:8])):
        return None
    if any(map(math.isinf, values[8:])):
        return None
    return VehicleMotion(
        system=system,
        number=number,
        time_us=time_us,
        sums=tuple(values[:4]),
        rates=tuple(values[4:8]),
        heading_rad=values[8],
        height_m=values[9],
    )
