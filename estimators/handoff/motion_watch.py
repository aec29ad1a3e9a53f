"""What moves in the pictures of a gimbal's camera, as a component on the vehicle's link. Without I/O.

It makes of each picture the messages that a moving-point camera sends (docs/mavlink/moving_points.md), from
the picture and from messages that the vehicle has sent before its exposure. So the points are the same when a
picture is searched at its exposure, and when it is searched later, over a log.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import MAVLinkMessage
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.moving_points import MOVING_POINTS_PAYLOAD, moving_points_messages
from estimators import wire
from estimators.attitude.air import pressure_pa
from estimators.handoff.sight import GroundHeight, armed_of
from estimators.messages import Message, is_a
from estimators.tracking.line_of_sight import GimbalAttitude, gimbal_attitude
from estimators.vision import (
    CameraDescription,
    CameraGeometry,
    CameraPose,
    FrameDifferenceDetector,
    FrameDifferenceParameters,
    VideoFrame,
)
from estimators.vision.ground_points import CameraAxes
from flightsim.foundation.atmosphere import pressure_altitude_m
from flightsim.foundation.vectors import ImagePoint, rotate

__all__ = ["MotionWatch", "MotionWatchParameters"]

T = TypeVar("T")
Points = tuple[ImagePoint, ...]

_LEAST_HEIGHT_M: Final = 5.0  # a camera that is lower has no ground in view that it could be compared with
_STALE_US: Final = 500_000
_REBOOT_US: Final = 1_000_000
_MILLISECOND_US: Final = 1000
_WITHOUT_SHARE: Final = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionWatchParameters:
    """Parameters of the front end.

    Attributes:
        differences: of the detector.
        ground_altitude_m: pressure altitude of the ground; None: that before the vehicle is armed.
    """

    differences: FrameDifferenceParameters = field(default_factory=FrameDifferenceParameters)
    ground_altitude_m: float | None = None

    def sigma(self, camera: CameraGeometry) -> float:
        """Standard deviation of a point per axis, as a tangent."""
        return self.differences.objects.centre_px / camera.focal_px[0]


class _Past(Generic[T]):
    """Values of the last seconds, by times in whole milliseconds."""

    def __init__(self) -> None:
        self._values: deque[tuple[int, T]] = deque(maxlen=256)

    def add(self, time_us: int, value: T) -> None:
        if self._values and time_us <= self._values[-1][0]:
            if time_us > self._values[-1][0] - _REBOOT_US:
                return  # late or repeated
            self._values.clear()
        self._values.append((time_us, value))

    def before(self, time_us: int) -> T | None:
        """The newest value that was certainly sent before a time; None: there is none from shortly before."""
        for sent_us, value in reversed(tuple(self._values)):
            if sent_us + _MILLISECOND_US <= time_us:
                return value if time_us - sent_us <= _STALE_US else None
        return None


class MotionWatch:
    """Searches pictures for what moves on the ground.

    Args:
        camera: description of the camera; its mount has no effect.
        parameters: None: the defaults.

    Attributes:
        camera: as given.
        detector: finds what moves.
        frames: number of pictures.
        without_pose: number of those before which the vehicle has not reported its gimbal and its height.
        low: number of those from near the ground.
        found: number of points.
    """

    MESSAGES: ClassVar[tuple[str, ...]] = ("GIMBAL_DEVICE_ATTITUDE_STATUS", "SCALED_PRESSURE", "HEARTBEAT")
    REQUESTS: ClassVar[tuple[tuple[str, int, float], ...]] = (
        ("GIMBAL_DEVICE_ATTITUDE_STATUS", 154, 25.0),
        ("SCALED_PRESSURE", 1, 20.0),
    )
    NEEDED: ClassVar[str] = "attitude of the gimbal"

    def __init__(self, camera: CameraDescription, parameters: MotionWatchParameters | None = None) -> None:
        self.camera = camera
        p = parameters or MotionWatchParameters()
        self._sigma = p.sigma(camera.geometry)
        self.detector = FrameDifferenceDetector(camera.geometry, p.differences)
        self._gimbal: _Past[GimbalAttitude] = _Past()
        self._altitude_m: _Past[float] = _Past()
        self._newest_m = np.nan
        self._ground = GroundHeight(p.ground_altitude_m)
        self.frames = self.without_pose = self.low = self.found = 0
        self._number = 0

    def handle(self, message: Message) -> None:
        """Take a message of the vehicle."""
        if is_a(message, wire.GIMBAL_DEVICE_ATTITUDE_STATUS):
            attitude = gimbal_attitude(message)
            if attitude is not None:
                self._gimbal.add(attitude.time_us, attitude)
        elif message.src_component != AUTOPILOT_COMPONENT:
            return
        elif is_a(message, wire.SCALED_PRESSURE):
            pascal = pressure_pa(message.press_abs) if np.isfinite(message.press_abs) else None
            if pascal is not None:
                self._newest_m = pressure_altitude_m(pascal)
                self._altitude_m.add(message.time_boot_ms * _MILLISECOND_US, self._newest_m)
        elif is_a(message, wire.HEARTBEAT):
            self._ground.armed(armed_of(message), self._newest_m)

    def detect(self, exposed_us: int, picture: NDArray[np.uint8]) -> Points | None:
        """The moving points in a picture (height, width, 3), BGR, from left to right; None: it says nothing
        about them, or is from near the ground.

        Args:
            exposed_us: vehicle time of the exposure; pictures come in this order.
            picture: the picture.

        Raises:
            EstimatorError: it has another size than the camera's pictures.
        """
        self.camera.geometry.check_size(picture)
        self.frames += 1
        gimbal, altitude_m = self._gimbal.before(exposed_us), self._altitude_m.before(exposed_us)
        height_m = np.nan if altitude_m is None else altitude_m - self._ground.ground_m
        if gimbal is None or not height_m >= _LEAST_HEIGHT_M:
            if gimbal is None or np.isnan(height_m):
                self.without_pose += 1
            else:
                self.low += 1
            self.detector.reset()
            return None
        pose = CameraPose(axes=_axes(gimbal), height_m=height_m)
        objects = self.detector.detect(VideoFrame(time_us=exposed_us, pixels=picture, pose=pose))
        if objects is None:
            return None
        self.found += len(objects)
        return tuple(sorted((x, y) for x, y in objects.rays.tolist()))

    def messages(self, exposed_us: int, points: Points | None) -> list[MAVLinkMessage]:
        """The messages of one picture; none if it was not searched. Pictures are numbered in the order of
        these calls.
        """
        number = self._number
        self._number += 1
        return [] if points is None else [*moving_points_messages(number, exposed_us, points, self._sigma)]

    def makes(self, message: Message) -> bool:
        """Whether a message is of a kind that it sends."""
        return is_a(message, wire.TUNNEL) and message.payload_type == MOVING_POINTS_PAYLOAD

    def figures(self) -> dict[str, Any]:
        """Entries of `summary.json`."""
        return {
            "frames": self.frames,
            "frames_without_pose": self.without_pose,
            "frames_near_the_ground": self.low,
            "detections": self.found,
            "front_end": self.detector.counts.as_dict(),
        }

    def warnings(self) -> list[str]:
        """What is wrong with pictures and poses."""
        if self.without_pose <= _WITHOUT_SHARE * self.frames:
            return []
        return [
            f"{self.without_pose} of {self.frames} pictures have no attitude of the gimbal, or no height, "
            "from shortly before their exposure, and no use; check start_us and latency_s in the camera's "
            "file, and the rates of GIMBAL_DEVICE_ATTITUDE_STATUS and SCALED_PRESSURE; where the vehicle is "
            "in the air at the begin, give `ground_altitude_m`"
        ]


def _axes(gimbal: GimbalAttitude) -> CameraAxes:
    """The camera's axes in a level frame; its forward does not count."""
    right, down, along = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
    return CameraAxes(axes=np.array([rotate(gimbal.q, axis) for axis in (right, down, along)]))
