"""The state of the camera component, which its messages report."""

from collections.abc import Callable
from typing import Final, Protocol

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.components import CAMERA_COMPONENT
from autopilot_bridge.payload.camera_lens import CameraLens
from autopilot_bridge.payload.camera_storage import PHOTO_QUALITY, VIDEO_MIB_S, CameraStorage
from autopilot_bridge.payload.camera_tracking import CameraTracker
from autopilot_bridge.payload.camera_trigger import PhotoTrigger
from autopilot_bridge.payload.camera_video import VideoStream
from autopilot_bridge.payload.component import Component
from autopilot_bridge.payload.reported_vehicle import ReportedVehicle
from flightsim.foundation.vectors import Quaternion, from_euler, product
from flightsim.payload import Camera

SENSOR_WIDTH_MM: Final = 6.0  # a 1/2.3-inch sensor; with the field of view it gives the focal length


class PictureKeeper(Protocol):
    """Makes files of the camera's photos and videos."""

    def photo(self, time_us: int, notes: dict[str, float]) -> str:
        """Store a photo; returns the name reported to clients, "" when it is not stored."""

    def start_video(self, time_us: int) -> None:
        """Begin to store a video."""

    def stop_video(self, time_us: int) -> None:
        """End the video."""


class CameraState(Component[Camera]):
    """The camera device and the parts of its component; arguments as `Component`.

    Attributes:
        stream: a video stream with a running server; None: there is none.
        keeper: makes files of photos and videos; None: photos and videos are only counted.
        mode: CAMERA_MODE.
        lens, storage, tracker, trigger, vehicle: the parts; `vehicle` is what the autopilot has reported.
        photo_quality: quality of JPEG files, up to 100.
        recording_since_us: start of the running video; None: no video is being recorded.
    """

    component_id = CAMERA_COMPONENT
    mav_type = dialect.MAV_TYPE_CAMERA

    def __init__(self, device: Camera, *, system_id: int, send: Callable[[bytes], None]) -> None:
        super().__init__(device, system_id=system_id, send=send)
        self.stream: VideoStream | None = None
        self.keeper: PictureKeeper | None = None
        self.mode = int(dialect.CAMERA_MODE_IMAGE)
        self.lens = CameraLens(device, sensor_width_mm=SENSOR_WIDTH_MM)
        self.storage = CameraStorage()
        self.tracker = CameraTracker(device.parameters.model)
        self.trigger = PhotoTrigger()
        self.vehicle = ReportedVehicle(system_id)
        self.recording_since_us: int | None = None
        self.status_interval_us = 0
        p = device.parameters
        self._q_frd_from_mount = from_euler(p.mount_roll_rad, p.mount_pitch_rad, p.mount_yaw_rad)
        self._next_status_us = 0
        self._lens_us = 0
        self.photo_quality = PHOTO_QUALITY

    @property
    def time_us(self) -> int:
        """Vehicle time."""
        return self._time_us

    @property
    def recorded_mib(self) -> float:
        """Size of the video that is being recorded."""
        since_us = self.recording_since_us
        return 0.0 if since_us is None else VIDEO_MIB_S * 1e-6 * (self._time_us - since_us)

    @property
    def orientation(self) -> Quaternion | None:
        """q_ned_from_mount: from the gimbal's own reference, or from the received attitude; None: not
        known.
        """
        if self.device.gimbal is not None:
            w, x, y, z = self.device.gimbal.measured_q_ned_from_gimbal.tolist()
            return w, x, y, z
        q_ned_from_frd = self.vehicle.q_ned_from_frd
        return None if q_ned_from_frd is None else product(q_ned_from_frd, self._q_frd_from_mount)
