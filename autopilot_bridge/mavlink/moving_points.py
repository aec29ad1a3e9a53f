"""Moving points of a camera's frames in TUNNEL messages: one or more messages per frame.

MAVLink has no message for any number of anonymous points of one frame. LANDING_TARGET reports one object, and
cannot report that a frame was searched and shows nothing that moves. docs/mavlink/moving_points.md documents
the payload.

All numbers are little-endian: version (uint8), points in this message (uint8), number of its first point
(uint8), points of the scan (uint8), scan (uint32), time (uint64, microseconds since the vehicle's boot, of
the exposure), standard deviation (float32), then for each point the tangents to the right and down (float32).
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import dialect

__all__ = [
    "MAX_POINTS",
    "MOVING_POINTS_PAYLOAD",
    "MovingPoints",
    "moving_points_messages",
    "read_moving_points",
]

MOVING_POINTS_PAYLOAD: Final = 0xF51A
"""Payload type; from 32768 on they are not registered (MAV_TUNNEL_PAYLOAD_TYPE)."""
MAX_POINTS: Final = 255

_VERSION: Final = 1
_HEAD: Final = struct.Struct("<BBBBIQf")
_POINT: Final = struct.Struct("<ff")
_PAYLOAD_SIZE: Final = 128
_POINTS_PER_MESSAGE: Final = (_PAYLOAD_SIZE - _HEAD.size) // _POINT.size
_LARGEST: Final = 20.0  # tangent of an angle in a picture

Point = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class MovingPoints:
    """One message: some points of a scan.

    Attributes:
        scan: number of the scan, from 0 at the camera's boot.
        time_us: vehicle time of the exposure.
        first: number of the first of `points` in the scan.
        total: points of the scan; the message that has the last one ends the scan.
        sigma: standard deviation of a point per axis, as a tangent.
        points: normalized image coordinates, right and down, of unit focal length.
    """

    scan: int
    time_us: int
    first: int
    total: int
    sigma: float
    points: tuple[Point, ...]

    @property
    def last(self) -> bool:
        """Whether it ends the scan."""
        return self.first + len(self.points) == self.total


def moving_points_messages(
    scan: int, time_us: int, points: Sequence[Point], sigma: float
) -> list[dialect.MAVLink_tunnel_message]:
    """The TUNNEL messages of a scan, to all systems and components; one when nothing moves.

    Args:
        scan: number of the scan, modulo 2^32.
        time_us: vehicle time of the exposure.
        points: normalized image coordinates; at most `MAX_POINTS`, further ones are left out.
        sigma: their standard deviation.
    """
    kept = points[:MAX_POINTS]
    messages = []
    for first in range(0, max(1, len(kept)), _POINTS_PER_MESSAGE):
        part = kept[first : first + _POINTS_PER_MESSAGE]
        payload = _HEAD.pack(_VERSION, len(part), first, len(kept), scan & 0xFFFFFFFF, time_us, sigma)
        payload += b"".join(_POINT.pack(*point) for point in part)
        messages.append(
            dialect.MAVLink_tunnel_message(
                0, 0, MOVING_POINTS_PAYLOAD, len(payload), list(payload.ljust(_PAYLOAD_SIZE, b"\0"))
            )
        )
    return messages


def read_moving_points(payload_type: int, length: int, payload: Sequence[int]) -> MovingPoints | None:
    """The content of a TUNNEL message; None for other payloads and for malformed ones. It never raises.

    Args:
        payload_type, length, payload: fields of the message.
    """
    if payload_type != MOVING_POINTS_PAYLOAD or not _HEAD.size <= length <= len(payload):
        return None
    data = bytes(payload[:length])
    version, count, first, total, scan, time_us, sigma = _HEAD.unpack_from(data)
    if version != _VERSION or length < _HEAD.size + count * _POINT.size or first + count > total:
        return None
    if not (math.isfinite(sigma) and sigma > 0.0) or (total and not count):
        return None
    points = tuple(_POINT.iter_unpack(data[_HEAD.size : _HEAD.size + count * _POINT.size]))
    if not all(abs(x) <= _LARGEST and abs(y) <= _LARGEST for x, y in points):  # NaN is not
        return None
    return MovingPoints(scan=scan, time_us=time_us, first=first, total=total, sigma=sigma, points=points)
