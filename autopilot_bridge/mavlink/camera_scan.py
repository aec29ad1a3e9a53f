"""The messages of a camera that searches its pictures: each detection, and the end of each frame.

LANDING_TARGET reports what was detected. It cannot report that a picture shows nothing, which a search must
know; a TUNNEL message does. docs/mavlink/camera_scan.md documents its payload.

All numbers are little-endian: version (uint8), kind (uint8), detections (uint16), number (uint32), time
(uint64, microseconds since boot, of the exposure), width and height (uint16), focal length (float32, pixels),
k1, k2, p1, p2, k3 (float32), roll, pitch and yaw of the mount (float32, rad; NaN: on a gimbal), and forward,
right and down of the camera on the vehicle (float32, m).
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import dialect
from flightsim.foundation.vectors import Vector

__all__ = [
    "CAMERA_SCAN_PAYLOAD",
    "CameraScan",
    "camera_scan_message",
    "detection_message",
    "read_camera_scan",
]

CAMERA_SCAN_PAYLOAD: Final = 0xF517
"""Payload type; from 32768 on they are not registered (MAV_TUNNEL_PAYLOAD_TYPE)."""


_MOST_TAG: Final = 255
_VERSION: Final = 1
_END_OF_FRAME: Final = 1
_LAYOUT: Final = struct.Struct("<BBHIQHHf5f3f3f")
_PAYLOAD_SIZE: Final = 128


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraScan:
    """One searched picture.

    Attributes:
        number: of the frame, from 0 at the camera's boot.
        time_us: vehicle time of its exposure; the LANDING_TARGET messages of the frame have the same.
        detections: number of those messages.
        width_px, height_px: size of the picture.
        focal_px: focal length at the present zoom; square pixels, the optical axis in the middle.
        distortion: k1, k2, p1, p2, k3 of Brown's model.
        mount_rad: roll, pitch and yaw of the camera (x optical, y right, z down) against the body; None: on a
            gimbal, which reports its attitude.
        position_frd_m: place on the vehicle.
    """

    number: int
    time_us: int
    detections: int
    width_px: int
    height_px: int
    focal_px: float
    distortion: tuple[float, ...]
    mount_rad: Vector | None
    position_frd_m: Vector


def detection_message(
    time_us: int,
    tag_id: int | None,
    *,
    angle_x_rad: float,
    angle_y_rad: float,
    distance_m: float,
    size_rad: float,
) -> dialect.MAVLink_landing_target_message:
    """LANDING_TARGET of one detection.

    Args:
        time_us: vehicle time of the exposure.
        tag_id: number of the tag, 255 for all from 255 on; None: what was detected has no tag.
        angle_x_rad, angle_y_rad: of its centre off the optical axis, right and down, each in its plane.
        distance_m: from the camera.
        size_rad: angle that its mean side covers.
    """
    return dialect.MAVLink_landing_target_message(
        time_us,
        _MOST_TAG if tag_id is None else min(tag_id, _MOST_TAG),
        dialect.MAV_FRAME_BODY_FRD,
        angle_x_rad,
        angle_y_rad,
        distance_m,
        size_rad,
        size_rad,
        0.0,
        0.0,
        0.0,
        [1.0, 0.0, 0.0, 0.0],
        dialect.LANDING_TARGET_TYPE_VISION_OTHER
        if tag_id is None
        else dialect.LANDING_TARGET_TYPE_VISION_FIDUCIAL,
        0,
    )


def camera_scan_message(scan: CameraScan) -> dialect.MAVLink_tunnel_message:
    """The TUNNEL message of a scan, to all systems and components."""
    mount_rad = (math.nan,) * 3 if scan.mount_rad is None else scan.mount_rad
    payload = _LAYOUT.pack(
        _VERSION,
        _END_OF_FRAME,
        min(scan.detections, 0xFFFF),
        scan.number & 0xFFFFFFFF,
        scan.time_us,
        scan.width_px,
        scan.height_px,
        scan.focal_px,
        *scan.distortion,
        *mount_rad,
        *scan.position_frd_m,
    )
    return dialect.MAVLink_tunnel_message(
        0, 0, CAMERA_SCAN_PAYLOAD, len(payload), list(payload.ljust(_PAYLOAD_SIZE, b"\0"))
    )


def read_camera_scan(payload_type: int, length: int, payload: Sequence[int]) -> CameraScan | None:
    """The content of a TUNNEL message; None for other payloads and for malformed ones. It never raises.

    Args:
        payload_type, length, payload: fields of the message.
    """
    if payload_type != CAMERA_SCAN_PAYLOAD or not _LAYOUT.size <= length <= len(payload):
        return None
    version, kind, detections, number, time_us, width_px, height_px, focal_px, *rest = _LAYOUT.unpack(
        bytes(payload[: _LAYOUT.size])
    )
    distortion, mount, place = tuple(rest[:5]), rest[5:8], rest[8:11]
    if version != _VERSION or kind != _END_OF_FRAME or not (width_px and height_px):
        return None
    if not (math.isfinite(focal_px) and focal_px > 0.0 and all(map(math.isfinite, (*distortion, *place)))):
        return None
    gimballed = any(map(math.isnan, mount))
    if not gimballed and not all(abs(angle) <= math.tau for angle in mount):
        return None
    return CameraScan(
        number=number,
        time_us=time_us,
        detections=detections,
        width_px=width_px,
        height_px=height_px,
        focal_px=focal_px,
        distortion=distortion,
        mount_rad=None if gimballed else (mount[0], mount[1], mount[2]),
        position_frd_m=(place[0], place[1], place[2]),
    )
