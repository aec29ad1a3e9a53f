"""A camera whose pictures come from elsewhere, as a component on the vehicle's link. Without I/O.

It makes of each picture the messages that a camera of the SITL with a reader sends: LANDING_TARGET for each
tag, and the end of the frame (docs/mavlink/camera_scan.md). It also watches whether pictures and attitude fit
together in time, and whether the tags' sizes fit the height.
"""

import math
from collections import Counter, deque
from typing import Any, ClassVar, Final

import numpy as np

from autopilot_bridge.mavlink import MAVLinkMessage
from autopilot_bridge.mavlink.camera_scan import (
    CAMERA_SCAN_PAYLOAD,
    CameraScan,
    camera_scan_message,
    detection_message,
)
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators import wire
from estimators.messages import Message, is_a
from estimators.vision.camera_file import CameraDescription
from estimators.vision.clock_check import ClockCheck
from estimators.vision.foreign_markers import ForeignMarkers
from estimators.vision.tag_detector import Picture, TagDetection, TagDetector
from estimators.vision.tag_parameters import TagDetectorParameters
from estimators.vision.vehicle_track import VehicleTrack, ground_place
from flightsim.foundation.vectors import rotate

__all__ = ["PictureWatch"]

_CLOCKS_APART_S: Final = 0.15
"""From here on a vehicle that turns by a radian in a second is off by the width of a small tag's view."""
_WITHOUT_SHARE: Final = 0.1
_SCALE_OFF: Final = 0.2
"""Share by which a distance is wrong; a tag on a vehicle's roof 2 m above ground is off by it from 10 m."""
_LEAST_SCALES: Final = 10
_SCALES: Final = 1000


class PictureWatch:
    """Searches pictures for tags.

    Args:
        camera: description of the camera.
        parameters: of the detector; None: the defaults.

    Attributes:
        camera: as given.
        frames: number of searched pictures.
        without_attitude: number of those near whose exposure the vehicle reported no attitude.
        tags: number of detections by the number of the tag.
        clocks: compares the rotation in the pictures with the attitude.
    """

    MESSAGES: ClassVar[tuple[str, ...]] = ("ATTITUDE", "GLOBAL_POSITION_INT")
    REQUESTS: ClassVar[tuple[tuple[str, int, float], ...]] = (
        ("ATTITUDE", 1, 25.0),
        ("GLOBAL_POSITION_INT", 1, 10.0),
    )
    NEEDED: ClassVar[str] = "attitude"

    def __init__(self, camera: CameraDescription, parameters: TagDetectorParameters | None = None) -> None:
        self.camera = camera
        self._detector = TagDetector(camera.geometry, parameters)
        self._foreign = ForeignMarkers()
        self._track = VehicleTrack()
        self.clocks = ClockCheck(camera.mount_rad)
        self.frames = 0
        self.without_attitude = 0
        self.tags: Counter[int] = Counter()
        self._scales: deque[float] = deque(maxlen=_SCALES)

    def handle(self, message: Message) -> None:
        """Take a message of the vehicle."""
        if message.src_component != AUTOPILOT_COMPONENT:
            return
        if is_a(message, wire.GLOBAL_POSITION_INT):  # the distance of a tag needs the height only
            self._track.place(message.time_boot_ms * 1000, (0.0, 0.0, -1e-3 * message.relative_alt))
            return
        if is_a(message, wire.ATTITUDE):
            self._track.handle(message)
            angles = (message.roll, message.pitch, message.yaw)
            if all(map(math.isfinite, angles)):
                self.clocks.take_attitude(message.time_boot_ms * 1000, *angles)

    @property
    def found(self) -> int:
        """Number of detections."""
        return sum(self.tags.values())

    def detect(self, exposed_us: int, picture: Picture) -> tuple[TagDetection, ...]:
        """The tags in a picture (height, width, 3), BGR.

        Raises:
            EstimatorError: it has another size than the camera's pictures.
        """
        found = self._detector.detect(picture)
        if not found:
            self._foreign.look(picture)
        self.clocks.take_picture(exposed_us, picture)
        return found

    def messages(self, exposed_us: int, detections: tuple[TagDetection, ...]) -> list[MAVLinkMessage]:
        """The messages of one searched picture, at the time at which they are sent. Pictures are numbered in
        the order of these calls.

        Args:
            exposed_us: vehicle time of the exposure.
            detections: the tags in it.
        """
        self.tags.update(found.tag_id for found in detections)
        self.without_attitude += self._track.attitude_at(exposed_us) is None
        messages: list[MAVLinkMessage] = [
            detection_message(
                exposed_us,
                found.tag_id,
                angle_x_rad=found.angle_x_rad,
                angle_y_rad=found.angle_y_rad,
                distance_m=found.distance_m,
                size_rad=found.size_rad,
            )
            for found in detections
        ]
        camera, geometry = self.camera, self.camera.geometry
        scan = CameraScan(
            number=self.frames,
            time_us=exposed_us,
            detections=len(detections),
            width_px=geometry.width_px,
            height_px=geometry.height_px,
            focal_px=0.5 * (geometry.focal_px[0] + geometry.focal_px[1]),
            distortion=geometry.distortion or (0.0,) * 5,
            mount_rad=camera.mount_rad,
            position_frd_m=camera.position_frd_m,
        )
        self.frames += 1
        messages.append(camera_scan_message(scan))
        self._compare_with_height(scan, detections)
        return messages

    def _compare_with_height(self, scan: CameraScan, detections: tuple[TagDetection, ...]) -> None:
        """Compare the distances of tags by their size with those of their places on level ground."""
        pose = self._track.at(scan.time_us)
        if pose is None:
            return
        eye = np.add(pose.pos_ned_m, rotate(pose.q_ned_from_frd, scan.position_frd_m))
        for found in detections:
            place = ground_place(pose, scan, found.angle_x_rad, found.angle_y_rad)
            if place is not None:
                self._scales.append(found.distance_m / math.dist((*place, 0.0), eye))

    @property
    def scale(self) -> float | None:
        """Median of the tags' distances by their size, as shares of those by the vehicle's height; None: too
        few are known. A wrong focal length or size of the tags makes it another than 1.
        """
        return float(np.median(self._scales)) if len(self._scales) >= _LEAST_SCALES else None

    def makes(self, message: Message) -> bool:
        """Whether a message is of a kind that it sends."""
        return message.name == "LANDING_TARGET" or (
            is_a(message, wire.TUNNEL) and message.payload_type == CAMERA_SCAN_PAYLOAD
        )

    def figures(self) -> dict[str, Any]:
        """Entries of `summary.json`."""
        difference = self.clocks.difference()
        return {
            "frames": self.frames,
            "frames_without_attitude": self.without_attitude,
            "detections": self.found,
            "tags": {str(tag): count for tag, count in sorted(self.tags.items())},
            "clocks_apart_s": None if difference is None else round(difference.apart_s, 3),
            "distance_by_size": None if self.scale is None else round(self.scale, 3),
        }

    def warnings(self) -> list[str]:
        """What is wrong with pictures and attitude."""
        found = []
        if not self.tags and (foreign := self._foreign.warning()):
            found.append(foreign)
        if self.without_attitude > _WITHOUT_SHARE * self.frames:
            found.append(
                f"{self.without_attitude} of {self.frames} pictures have no attitude near their exposure, "
                "and no use; check start_us and latency_s in the camera's file, and the rate of ATTITUDE"
            )
        difference = self.clocks.difference()
        if difference is not None and abs(difference.apart_s) >= _CLOCKS_APART_S:
            found.append(
                f"the clocks of pictures and attitude are {abs(difference.apart_s):.2f} s apart: the "
                f"pictures count as exposed {'before' if difference.apart_s > 0.0 else 'after'} they were; "
                "correct latency_s of a stream, or start_us of a recording, in the camera's file"
            )
        scale = self.scale
        if scale is not None and not 1.0 - _SCALE_OFF < scale < 1.0 + _SCALE_OFF:
            found.append(
                f"the tags' distances by their size are {scale:.2f} times those by the vehicle's height; "
                "check focal_px in the camera's file, the size of the tags, and that they lie at home's level"
            )
        return found
