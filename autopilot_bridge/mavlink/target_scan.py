"""Scans of a target sensor in TUNNEL messages: one message per detection, and one at the end of each scan.

MAVLink has no message for the range and bearing of any number of objects in one scan. OBSTACLE_DISTANCE and
LANDING_TARGET have other meanings, and neither can report that a scan was empty. docs/mavlink/target_scan.md
documents the payload.

All numbers are little-endian. Both kinds begin with version (uint8), kind (uint8), number (uint16), scan
(uint32) and time (uint64, microseconds since the vehicle's boot). A detection continues with range (float32)
and bearing (float32).
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import dialect

__all__ = [
    "MAX_DETECTIONS",
    "TARGET_SCAN_PAYLOAD",
    "ScanEnd",
    "TargetDetection",
    "read_scan_payload",
    "scan_messages",
]

TARGET_SCAN_PAYLOAD: Final = 0xF516
"""Payload type; from 32768 on they are not registered (MAV_TUNNEL_PAYLOAD_TYPE)."""
MAX_DETECTIONS: Final = 1000

_VERSION: Final = 1
_DETECTION: Final = 1
_END: Final = 2
_HEAD: Final = struct.Struct("<BBHIQ")
_PLACE: Final = struct.Struct("<ff")
_PAYLOAD_SIZE: Final = 128


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetDetection:
    """One detection of a scan.

    Attributes:
        scan: number of the scan.
        time_us: vehicle time at which the scan was taken.
        number: number of the detection in the scan, from 0; the order has no meaning.
        range_m: horizontal distance from the vehicle.
        bearing_rad: direction in the horizontal plane, clockwise from the nose.
    """

    scan: int
    time_us: int
    number: int
    range_m: float
    bearing_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanEnd:
    """The end of a scan, which is also sent when nothing was detected.

    Attributes:
        scan: number of the scan.
        time_us: vehicle time at which the scan was taken.
        detections: number of its detections.
    """

    scan: int
    time_us: int
    detections: int


def scan_messages(
    scan: int, time_us: int, detections: Sequence[tuple[float, float]]
) -> list[dialect.MAVLink_tunnel_message]:
    """The TUNNEL messages of a scan, to all systems and components.

    Args:
        scan: number of the scan, modulo 2^32.
        time_us: vehicle time of the scan.
        detections: range (m) and bearing (rad) of each; at most `MAX_DETECTIONS`, further ones are left out.
    """
    kept = detections[:MAX_DETECTIONS]
    payloads = [
        _HEAD.pack(_VERSION, _DETECTION, number, scan & 0xFFFFFFFF, time_us) + _PLACE.pack(*place)
        for number, place in enumerate(kept)
    ]
    payloads.append(_HEAD.pack(_VERSION, _END, len(kept), scan & 0xFFFFFFFF, time_us))
    return [
        dialect.MAVLink_tunnel_message(
            0, 0, TARGET_SCAN_PAYLOAD, len(payload), list(payload.ljust(_PAYLOAD_SIZE, b"\0"))
        )
        for payload in payloads
    ]


def read_scan_payload(
    payload_type: int, length: int, payload: Sequence[int]
) -> TargetDetection | ScanEnd | None:
    """The content of a TUNNEL message; None for other payloads and for malformed ones. It never raises.

    Args:
        payload_type, length, payload: fields of the message.
    """
    if payload_type != TARGET_SCAN_PAYLOAD or not _HEAD.size <= length <= len(payload):
        return None
    data = bytes(payload[:length])
    version, kind, number, scan, time_us = _HEAD.unpack_from(data)
    if version != _VERSION or number > MAX_DETECTIONS:
        return None
    if kind == _END:
        return ScanEnd(scan=scan, time_us=time_us, detections=number)
    if kind != _DETECTION or length < _HEAD.size + _PLACE.size:
        return None
    range_m, bearing_rad = _PLACE.unpack_from(data, _HEAD.size)
    if not (math.isfinite(range_m) and range_m >= 0.0 and abs(bearing_rad) <= math.tau):
        return None
    return TargetDetection(
        scan=scan, time_us=time_us, number=number, range_m=range_m, bearing_rad=bearing_rad
    )
