"""The likelihood of one camera frame in a TUNNEL message, for the other vehicles of a team.

Each vehicle sends the parameters of what it observed, and keeps its own belief (Tisdale et al. 2008, equation
2). The frame's number identifies the observation, so a repeated message is recognized, and a late one can be
used. docs/mavlink/search_likelihood.md documents the payload.
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import degrees, e7
from flightsim.foundation.vectors import Quaternion

__all__ = [
    "SEARCH_LIKELIHOOD_PAYLOAD",
    "SearchLikelihood",
    "read_search_likelihood",
    "search_likelihood_message",
]

SEARCH_LIKELIHOOD_PAYLOAD: Final = 0xF518
"""Payload type; from 32768 on they are not registered (MAV_TUNNEL_PAYLOAD_TYPE)."""

_VERSION: Final = 1
_LAYOUT: Final = struct.Struct("<BBHIQiif3f4f6f2eHHf5f4f")
_MOST_WEIGHT: Final = 65_000.0  # of a half-precision number
_MOST_M2: Final = 1e8
_MOST_RAD2: Final = 10.0
_MOST_IMAGE: Final = 10.0  # image coordinates and distortion
_UNIT_NEAR: Final = 1e-3
_ROUNDING: Final = 1e-5  # of products of single-precision numbers

Pair = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchLikelihood:
    """The parameters of one frame's likelihood.

    Attributes:
        tag_id: number of the tag that is searched for.
        number: of the frame, as the camera counts.
        time_us: the sender's vehicle time of the exposure.
        lat_deg, lon_deg: place of the camera.
        height_m: of the camera above the ground, which is at the sender's home.
        q_ned_from_mount: attitude of the camera (x optical, y right, z down).
        place_m2: variances and covariance of the place: north, north-east, east, down.
        rotation_rad2: covariance of the rotation about the camera's axes: xx, xy, xz, yy, yz, zz.
        weights: factors of both in the likelihood of a detection's place.
        width_px, height_px: size of the picture.
        focal_px: focal length.
        distortion: k1, k2, p1, p2, k3 of Brown's model.
        detections: image coordinates (a, b) of at most two detections: right and down over forward.
    """

    tag_id: int
    number: int
    time_us: int
    lat_deg: float
    lon_deg: float
    height_m: float
    q_ned_from_mount: Quaternion
    place_m2: tuple[float, float, float, float]
    rotation_rad2: tuple[float, float, float, float, float, float]
    weights: Pair
    width_px: int
    height_px: int
    focal_px: float
    distortion: tuple[float, ...]
    detections: tuple[Pair, ...]


def search_likelihood_message(
    likelihood: SearchLikelihood, *, target_system: int = 0
) -> dialect.MAVLink_tunnel_message:
    """The TUNNEL message of a likelihood, to the components of one system, or of all (0). Of a quaternion x,
    y and z are sent, with w not negative.
    """
    m = likelihood
    w, *vector = m.q_ned_from_mount
    sign = -1.0 if w < 0.0 else 1.0
    pairs = [*m.detections[:2], (0.0, 0.0), (0.0, 0.0)][:2]
    payload = _LAYOUT.pack(
        _VERSION,
        min(len(m.detections), 2),
        m.tag_id,
        m.number & 0xFFFFFFFF,
        m.time_us,
        e7(m.lat_deg),
        e7(m.lon_deg),
        m.height_m,
        *(sign * value for value in vector),
        *m.place_m2,
        *m.rotation_rad2,
        *(min(weight, _MOST_WEIGHT) for weight in m.weights),
        m.width_px,
        m.height_px,
        m.focal_px,
        *m.distortion,
        *(value for pair in pairs for value in pair),
    )
    return dialect.MAVLink_tunnel_message(
        target_system, 0, SEARCH_LIKELIHOOD_PAYLOAD, len(payload), list(payload)
    )


def read_search_likelihood(payload_type: int, length: int, payload: Sequence[int]) -> SearchLikelihood | None:
    """The content of a TUNNEL message; None for other payloads and for malformed ones. It never raises.

    Args:
        payload_type, length, payload: fields of the message.
    """
    if payload_type != SEARCH_LIKELIHOOD_PAYLOAD or not _LAYOUT.size <= length <= len(payload):
        return None
    version, count, tag_id, number, time_us, lat, lon, *rest = _LAYOUT.unpack(bytes(payload[: _LAYOUT.size]))
    height_m, vector, place, rotation = rest[0], rest[1:4], rest[4:8], rest[8:14]
    weights, (width_px, height_px, focal_px), numbers = rest[14:16], rest[16:19], rest[19:28]
    if version != _VERSION or count > 2 or not (width_px and height_px):
        return None
    if not all(map(math.isfinite, (height_m, *vector, *place, *rotation, *weights, focal_px, *numbers))):
        return None
    norm = math.fsum(value * value for value in vector)
    if abs(lat) > 900_000_000 or abs(lon) > 1_800_000_000 or norm > 1.0 + _UNIT_NEAR or not focal_px > 0.0:
        return None
    if not (_covariance(*place[:3]) and place[3] >= 0.0 and min(weights) >= 1.0):
        return None
    if max(place) > _MOST_M2 or max(rotation) > _MOST_RAD2 or max(map(abs, numbers)) > _MOST_IMAGE:
        return None
    xx, xy, xz, yy, yz, zz = rotation
    if not (_covariance(xx, xy, yy) and _covariance(xx, xz, zz) and _covariance(yy, yz, zz)):
        return None
    determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    if determinant < -_ROUNDING * xx * yy * zz:
        return None
    return SearchLikelihood(
        tag_id=tag_id,
        number=number,
        time_us=time_us,
        lat_deg=degrees(lat),
        lon_deg=degrees(lon),
        height_m=height_m,
        q_ned_from_mount=(math.sqrt(max(0.0, 1.0 - norm)), vector[0], vector[1], vector[2]),
        place_m2=(place[0], place[1], place[2], place[3]),
        rotation_rad2=(rotation[0], rotation[1], rotation[2], rotation[3], rotation[4], rotation[5]),
        weights=(weights[0], weights[1]),
        width_px=width_px,
        height_px=height_px,
        focal_px=focal_px,
        distortion=tuple(numbers[:5]),
        detections=tuple((numbers[5 + 2 * k], numbers[6 + 2 * k]) for k in range(count)),
    )


def _covariance(xx: float, xy: float, yy: float) -> bool:
    """Whether the entries are those of a covariance, to the precision of single numbers."""
    return xx >= 0.0 and yy >= 0.0 and xy * xy <= xx * yy * (1.0 + _ROUNDING)
