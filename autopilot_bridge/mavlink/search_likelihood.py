"""The likelihood of one camera frame in a TUNNEL message, for the other vehicles of a team.

Each vehicle sends the parameters of what it observed, and keeps its own belief (Tisdale et al. 2008, equation
2). The frame's number identifies the observation, so a repeated message is recognized, and a late one can be
used. docs/mavlink/search_likelihood.md has the payload's table.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Final

from autopilot_bridge.mavlink.tunnel import Many, Tunnel, Wire
from autopilot_bridge.mavlink.wire_units import degrees, e7
from flightsim.foundation.vectors import Quaternion, Vector

__all__ = [
    "MOST_IMAGE",
    "SEARCH_LIKELIHOOD",
    "SEARCH_LIKELIHOOD_PAYLOAD",
    "SearchLikelihood",
    "read_search_likelihood",
    "search_likelihood_message",
]

SEARCH_LIKELIHOOD_PAYLOAD: Final = 0xF51F

_MOST_ROOT: Final = 65_000.0  # of half-precision numbers
_MOST_M2: Final = 1e8
_MOST_RAD2: Final = 10.0
MOST_IMAGE: Final = 10.0
"""Bound of image coordinates and distortion."""
_UNIT_NEAR: Final = 1e-3
_ROUNDING: Final = 1e-5  # of products of single-precision numbers

Pair = tuple[float, float]
Root = tuple[float, float, float]


def _angle(text: str, most_deg: float) -> Wire:
    return Wire("i", text, least=-e7(most_deg), most=e7(most_deg), send=e7, receive=degrees)


def _vector_of(q: Quaternion) -> Vector:
    """x, y and z of the attitude whose w is not negative."""
    w, x, y, z = q
    return (-x, -y, -z) if w < 0.0 else (x, y, z)


def _quaternion_of(vector: Vector) -> Quaternion:
    norm = math.fsum(value * value for value in vector)
    return (math.sqrt(max(0.0, 1.0 - norm)), *vector)


_ATTITUDE: Final = Wire(
    "3f",
    "of the camera's attitude, NED from camera axes (x optical, y right, z down), w >= 0",
    name="x, y, z",
    send=_vector_of,
    receive=_quaternion_of,
)
_PLACE: Final = Wire(
    "4f", "variances and covariance of the place: north, north-east, east, down, m^2", most=_MOST_M2
)
_ROTATION: Final = Wire(
    "6f", "covariance of the rotation about the camera's axes: xx, xy, xz, yy, yz, zz, rad^2", most=_MOST_RAD2
)
_ROOTS: Final = Wire(
    "6e",
    "of each detection the lower triangle L (11, 21, 22) of its information L L' about the target's image "
    "coordinates",
    send=lambda roots: [min(max(number, -_MOST_ROOT), _MOST_ROOT) for root in roots for number in root],
    receive=lambda numbers: (numbers[:3], numbers[3:]),
)
_DISTORTION: Final = Wire("5e", "k1, k2, p1, p2, k3 of Brown's model", least=-MOST_IMAGE, most=MOST_IMAGE)
_DETECTION: Final = Wire(
    "2f",
    "image coordinates that detection i stands for, without distortion: right and down over forward",
    name="a, b",
    least=-MOST_IMAGE,
    most=MOST_IMAGE,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchLikelihood:
    """The parameters of one frame's likelihood."""

    tag_id: Annotated[int, Wire("H", "number of the tag that is searched for", name="tag")]
    number: Annotated[int, Wire("I", "of the frame, as the camera counts", modulo=True)]
    time_us: Annotated[int, Wire("Q", "the sender's vehicle time of the exposure, microseconds since boot")]
    lat_deg: Annotated[float, _angle("latitude of the camera, degE7", 90.0)]
    lon_deg: Annotated[float, _angle("longitude of the camera, degE7", 180.0)]
    height_m: Annotated[float, Wire("f", "of the camera above the ground, which is at the sender's home, m")]
    q_ned_from_mount: Annotated[Quaternion, _ATTITUDE]
    place_m2: Annotated[tuple[float, float, float, float], _PLACE]
    rotation_rad2: Annotated[tuple[float, float, float, float, float, float], _ROTATION]
    width_px: Annotated[int, Wire("H", "of the picture, pixels", least=1)]
    height_px: Annotated[int, Wire("H", "of the picture, pixels", least=1)]
    focal_px: Annotated[float, Wire("f", "pixels", name="focal length", above=0.0)]
    distortion: Annotated[tuple[float, ...], _DISTORTION]
    roots: Annotated[tuple[Root, Root], _ROOTS]
    detections: Annotated[
        tuple[Pair, ...], Many(_DETECTION, "detections of the target in the frame: 0, 1 or 2", capacity=2)
    ]


def _possible(m: SearchLikelihood) -> bool:
    _, *vector = m.q_ned_from_mount
    xx, xy, xz, yy, yz, zz = m.rotation_rad2
    determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    return (
        math.fsum(value * value for value in vector) <= 1.0 + _UNIT_NEAR
        and _covariance(*m.place_m2[:3])
        and m.place_m2[3] >= 0.0
        and _covariance(xx, xy, yy)
        and _covariance(xx, xz, zz)
        and _covariance(yy, yz, zz)
        and determinant >= -_ROUNDING * xx * yy * zz
        and all(first >= 0.0 and last >= 0.0 for first, _, last in m.roots)
    )


def _covariance(xx: float, xy: float, yy: float) -> bool:
    """Whether the entries are those of a covariance, to the precision of single numbers."""
    return xx >= 0.0 and yy >= 0.0 and xy * xy <= xx * yy * (1.0 + _ROUNDING)


SEARCH_LIKELIHOOD: Final = Tunnel(SearchLikelihood, SEARCH_LIKELIHOOD_PAYLOAD, possible=_possible)
search_likelihood_message = SEARCH_LIKELIHOOD.message
read_search_likelihood = SEARCH_LIKELIHOOD.read
