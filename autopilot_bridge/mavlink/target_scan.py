"""Scans of a target sensor in TUNNEL messages: one message per detection, and one at the end of each scan.

MAVLink has no message for the range and bearing of any number of objects in one scan. OBSTACLE_DISTANCE and
LANDING_TARGET have other meanings, and neither can report that a scan was empty. docs/mavlink/target_scan.md
has the payloads' tables.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.tunnel import Tunnel, Wire

__all__ = [
    "MAX_DETECTIONS",
    "SCAN_END",
    "TARGET_DETECTION",
    "TARGET_SCAN_PAYLOAD",
    "ScanEnd",
    "TargetDetection",
    "read_scan_payload",
    "scan_messages",
]

TARGET_SCAN_PAYLOAD: Final = 0xF516
MAX_DETECTIONS: Final = 1000

_SCAN: Final = Wire("I", "number of the scan; counts from 0 at the sensor's boot", modulo=True)
_TIME: Final = Wire("Q", "vehicle time of the scan, microseconds since boot")
_BEARING: Final = Wire(
    "f", "clockwise from the nose, rad, in the horizontal plane", least=-math.tau, most=math.tau
)


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetDetection:
    """One detection of a scan; the order of detections has no meaning."""

    number: Annotated[int, Wire("H", "of the detection in its scan, from 0", most=MAX_DETECTIONS)]
    scan: Annotated[int, _SCAN]
    time_us: Annotated[int, _TIME]
    range_m: Annotated[float, Wire("f", "horizontal distance, m", least=0.0)]
    bearing_rad: Annotated[float, _BEARING]


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanEnd:
    """The end of a scan, which is also sent when nothing was detected."""

    detections: Annotated[int, Wire("H", "number of detections of the scan", most=MAX_DETECTIONS)]
    scan: Annotated[int, _SCAN]
    time_us: Annotated[int, _TIME]


TARGET_DETECTION: Final = Tunnel(TargetDetection, TARGET_SCAN_PAYLOAD, subtype=(1, "detection"))
SCAN_END: Final = Tunnel(ScanEnd, TARGET_SCAN_PAYLOAD, subtype=(2, "end of scan"))


def scan_messages(
    scan: int, time_us: int, detections: Sequence[tuple[float, float]]
) -> list[dialect.MAVLink_tunnel_message]:
    """The TUNNEL messages of a scan, to all systems and components.

    Args:
        scan: number of the scan, modulo 2^32.
        time_us: vehicle time of the scan.
        detections: range (m) and bearing (rad) of each; at most `MAX_DETECTIONS`, further ones are left out.
    """
    sent = detections[:MAX_DETECTIONS]
    found = [
        TargetDetection(scan=scan, time_us=time_us, number=number, range_m=range_m, bearing_rad=bearing_rad)
        for number, (range_m, bearing_rad) in enumerate(sent)
    ]
    end = ScanEnd(scan=scan, time_us=time_us, detections=len(sent))
    return [*map(TARGET_DETECTION.message, found), SCAN_END.message(end)]


def read_scan_payload(
    payload_type: int, length: int, payload: Sequence[int]
) -> TargetDetection | ScanEnd | None:
    """The content of a TUNNEL message; None for other payloads and for malformed ones. It never raises.

    Args:
        payload_type, length, payload: fields of the message.
    """
    wire = payload_type, length, payload
    return TARGET_DETECTION.read(*wire) or SCAN_END.read(*wire)
