"""The messages of a camera that searches its pictures: each detection, and the end of each frame.

LANDING_TARGET reports what was detected. It cannot report that a picture shows nothing, which a search must
know; a TUNNEL message does. docs/mavlink/camera_scan.md has the payload's table.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.tunnel import Tunnel, Wire
from flightsim.foundation.vectors import Vector

__all__ = [
    "CAMERA_SCAN",
    "CAMERA_SCAN_PAYLOAD",
    "CameraScan",
    "camera_scan_message",
    "detection_message",
    "read_camera_scan",
]

CAMERA_SCAN_PAYLOAD: Final = 0xF517

_MOST_TAG: Final = 255
_DETECTIONS: Final = Wire(
    "H", "number of LANDING_TARGET messages with the same time", send=lambda count: min(count, 0xFFFF)
)
_MOUNT: Final = Wire(
    "3f",
    "roll, pitch, yaw of the camera against the body, rad; NaN: on a gimbal, which reports its attitude",
    nan=True,
    send=lambda mount: mount or (math.nan,) * 3,
    receive=lambda angles: None if any(map(math.isnan, angles)) else angles,
)
_FOCAL: Final = Wire(
    "f",
    "pixels, at the present zoom; the pixels are square, the optical axis is in the middle",
    name="focal length",
    above=0.0,
)
_PLACE: Final = Wire("3f", "of the camera on the vehicle: forward, right, down, m", name="place")


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraScan:
    """One searched picture. The axes of the camera are x optical, y right, z down."""

    detections: Annotated[int, _DETECTIONS]
    number: Annotated[int, Wire("I", "of the frame; counts from 0 at the camera's boot", modulo=True)]
    time_us: Annotated[int, Wire("Q", "vehicle time of the exposure, microseconds since boot")]
    width_px: Annotated[int, Wire("H", "of the picture, pixels", least=1)]
    height_px: Annotated[int, Wire("H", "of the picture, pixels", least=1)]
    focal_px: Annotated[float, _FOCAL]
    distortion: Annotated[
        tuple[float, ...], Wire("5f", "k1, k2, p1, p2, k3 of Brown's model, in OpenCV's order")
    ]
    mount_rad: Annotated[Vector | None, _MOUNT]
    position_frd_m: Annotated[Vector, _PLACE]


def _possible(scan: CameraScan) -> bool:
    return scan.mount_rad is None or max(map(abs, scan.mount_rad)) <= math.tau


CAMERA_SCAN: Final = Tunnel(
    CameraScan, CAMERA_SCAN_PAYLOAD, subtype=(1, "end of a frame"), possible=_possible
)
camera_scan_message = CAMERA_SCAN.message
read_camera_scan = CAMERA_SCAN.read


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
