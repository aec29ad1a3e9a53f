"""A camera whose pictures come from elsewhere, as a component on the vehicle's link. Without I/O.

It makes of each picture the messages that a camera of the SITL with a reader sends: LANDING_TARGET for each
tag, and the end of the frame (docs/mavlink/camera_scan.md). It also watches whether pictures and attitude fit
together in time.
"""

import math
from collections import Counter
from typing import Any, ClassVar, Final

from autopilot_bridge.mavlink import MAVLinkMessage
from autopilot_bridge.mavlink.camera_scan import (
    CAMERA_SCAN_PAYLOAD,
    CameraScan,
    camera_scan_message,
    detection_message,
)
from estimators.messages import Message
from estimators.vision.camera_file import CameraDescription
from estimators.vision.clock_check import ClockCheck
from estimators.vision.tag_detector import Picture, TagDetection, TagDetector, TagDetectorParameters
from estimators.vision.vehicle_track import VehicleTrack

__all__ = ["PictureWatch"]

_CLOCKS_APART_S: Final = 0.15
"""From here on a vehicle that turns by a radian in a second is off by the width of a small tag's view."""
_WITHOUT_SHARE: Final = 0.1


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

    MESSAGES: ClassVar[tuple[str, ...]] = VehicleTrack.MESSAGES
    REQUESTS: ClassVar[tuple[tuple[str, int, float], ...]] = (("ATTITUDE", 1, 25.0),)
    NEEDED: ClassVar[str] = "attitude"

    def __init__(self, camera: CameraDescription, parameters: TagDetectorParameters | None = None) -> None:
        self.camera = camera
        self._detector = TagDetector(camera.geometry, parameters)
        self._track = VehicleTrack()
        self.clocks = ClockCheck(camera.mount_rad)
        self.frames = 0
        self.without_attitude = 0
        self.tags: Counter[int] = Counter()

    def handle(self, message: Message) -> None:
        """Take a message of the vehicle."""
        if message.src_component != 1:
            return
        self._track.handle(message)
        if message.name == "ATTITUDE":
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
        return messages

    def makes(self, message: Message) -> bool:
        """Whether a message is of a kind that it sends."""
        return message.name == "LANDING_TARGET" or (
            message.name == "TUNNEL" and message.payload_type == CAMERA_SCAN_PAYLOAD
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
        }

    def warnings(self) -> list[str]:
        """What is wrong with pictures and attitude."""
        found = []
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
        return found
