"""The camera as a MAVLink component: camera protocol v2, and LANDING_TARGET for the targets it detects.

Source: MAVLink camera protocol v2 (mavlink.io/en/services/camera.html) and the LANDING_TARGET message.
Detections carry angles off the optical axis; their tangents are the normalized image coordinates (Tolman et
al. 2021, equation 36). The camera has no GPS receiver: the place of a photo is the position that the
autopilot has sent.
"""

from collections.abc import Callable
from typing import Any, Final, Protocol

from autopilot_bridge.mavlink import dialect as mavlink
from autopilot_bridge.payload.camera_commands import CameraCommands
from autopilot_bridge.payload.camera_definition import CameraDefinition
from autopilot_bridge.payload.camera_lens import CameraLens
from autopilot_bridge.payload.camera_messages import (
    SENSOR_WIDTH_MM,
    capture_status,
    fov_status,
    image_captured,
    information,
    landing_target,
    photo_notes,
    tracking_geo_status,
)
from autopilot_bridge.payload.camera_storage import PHOTO_QUALITY, VIDEO_MIB_S, CameraStorage
from autopilot_bridge.payload.camera_tracking import CameraTracker
from autopilot_bridge.payload.camera_trigger import PhotoTrigger
from autopilot_bridge.payload.camera_video import VideoStream
from autopilot_bridge.payload.component import Component
from autopilot_bridge.payload.reported_vehicle import ReportedVehicle
from flightsim.foundation.vectors import Quaternion, from_euler, product
from flightsim.payload import Camera, CameraFrame, Gimbal

CAMERA_COMPONENT: Final = int(mavlink.MAV_COMP_ID_CAMERA)

_LENS_INTERVAL_US: Final = 100_000


class PictureKeeper(Protocol):
    """Makes files of the camera's photos and videos."""

    def photo(self, time_us: int, notes: dict[str, float]) -> str:
        """Store a photo; returns the name reported to clients, "" when it is not stored."""

    def start_video(self, time_us: int) -> None:
        """Begin to store a video."""

    def stop_video(self, time_us: int) -> None:
        """End the video."""


class CameraComponent(Component):
    """Takes photos and videos, zooms, focuses, tracks detections, and reports the detected targets.

    Args:
        camera: the device.
        system_id: of the vehicle.
        send: sends packed frames.
        gimbal: the gimbal that carries it; None: fixed to the body.
        gimbal_device_id: id of that gimbal; 0: none.

    Attributes:
        stream: a video stream with a running server; None: there is none.
        keeper: makes files of photos and videos; None: photos and videos are only counted.
        mode: CAMERA_MODE.
        lens, storage, tracker, trigger, vehicle: the parts; `vehicle` is what the autopilot has reported.
        photo_quality: quality of JPEG files, up to 100.
        definition: the camera definition file and the camera's settings.
        recording_since_us: start of the running video; None: no video is being recorded.
    """

    def __init__(
        self,
        camera: Camera,
        *,
        system_id: int,
        send: Callable[[bytes], None],
        gimbal: Gimbal | None = None,
        gimbal_device_id: int = 0,
    ) -> None:
        super().__init__(
            system_id=system_id,
            component_id=CAMERA_COMPONENT,
            mav_type=mavlink.MAV_TYPE_CAMERA,
            send=send,
            rates_hz={},
        )
        self.device = camera
        self.gimbal_device_id = gimbal_device_id
        self.stream: VideoStream | None = None
        self.keeper: PictureKeeper | None = None
        self.mode = int(mavlink.CAMERA_MODE_IMAGE)
        self.lens = CameraLens(camera, sensor_width_mm=SENSOR_WIDTH_MM)
        self.storage = CameraStorage()
        self.tracker = CameraTracker(camera.parameters.model)
        self.trigger = PhotoTrigger()
        self.vehicle = ReportedVehicle(system_id)
        self.recording_since_us: int | None = None
        self.status_interval_us = 0
        self._gimbal = gimbal
        p = camera.parameters
        self._q_frd_from_mount = from_euler(p.mount_roll_rad, p.mount_pitch_rad, p.mount_yaw_rad)
        self._next_status_us = 0
        self._lens_us = 0
        self._builders.update(
            {
                mavlink.MAVLINK_MSG_ID_CAMERA_INFORMATION: lambda _: information(self),
                mavlink.MAVLINK_MSG_ID_CAMERA_SETTINGS: self._settings,
                mavlink.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS: lambda t: capture_status(self, t),
                mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION: lambda _: self.storage.message(self.time_ms),
                mavlink.MAVLINK_MSG_ID_CAMERA_FOV_STATUS: lambda t: fov_status(self, t),
                mavlink.MAVLINK_MSG_ID_CAMERA_TRACKING_IMAGE_STATUS: lambda _: self.tracker.message(),
                mavlink.MAVLINK_MSG_ID_CAMERA_TRACKING_GEO_STATUS: lambda t: tracking_geo_status(self, t),
            }
        )
        self.photo_quality = PHOTO_QUALITY
        self.definition = CameraDefinition(self)
        self._commands = CameraCommands(self)
        self._handlers.update(self._commands.handlers)
        self._answers.update(self._commands.answers)

    @property
    def time_us(self) -> int:
        """Vehicle time."""
        return self._time_us

    def step(self, time_us: int) -> None:
        """Send streams, take the photos of a series, move the lens, and send the status while something
        runs.
        """
        super().step(time_us)
        self.definition.step(time_us)
        if self.trigger.running and self.trigger.due(time_us):
            self.take_photo()
        if self.lens.moving and time_us - self._lens_us >= _LENS_INTERVAL_US:
            self.lens.move(1e-6 * min(time_us - self._lens_us, 2 * _LENS_INTERVAL_US))
            self._lens_us = time_us
            self.send_settings()
        if self.recording_since_us is not None:
            self._record(time_us)

    def update(self, frame: CameraFrame) -> None:
        """Send the detections of a frame that was delivered on this step."""
        self.tracker.update(frame)
        for detection in frame.detections:
            self.send(landing_target(detection))

    @property
    def orientation(self) -> Quaternion | None:
        """q_ned_from_mount: from the gimbal's own reference, or from the received attitude; None: not
        known.
        """
        if self._gimbal is not None:
            w, x, y, z = self._gimbal.measured_q_ned_from_gimbal.tolist()
            return w, x, y, z
        q_ned_from_frd = self.vehicle.q_ned_from_frd
        return None if q_ned_from_frd is None else product(q_ned_from_frd, self._q_frd_from_mount)

    # actions of commands

    def take_photo(self) -> bool:
        """Take a photo now; False: the card is full."""
        if self.storage.full:
            self.trigger.stop()
            self.send_status()
            return False
        name = "" if self.keeper is None else self.keeper.photo(self._time_us, photo_notes(self))
        message = image_captured(self, self._time_us, self.storage.images, name)
        self.storage.add_photo(message)
        self.send(message)
        self.send_status()
        return True

    def start_recording(self, status_hz: float) -> bool:
        """Begin a video; False: a video is already being recorded, or the card is full."""
        if self.recording_since_us is not None or self.storage.full:
            return False
        self.recording_since_us = self._lens_us = self._time_us
        self.status_interval_us = round(1e6 / status_hz) if status_hz > 0.0 else 0
        self._next_status_us = self._time_us + self.status_interval_us
        if self.keeper is not None:
            self.keeper.start_video(self._time_us)
        self.send_status()
        return True

    def stop_recording(self) -> bool:
        """End the video; False: no video is being recorded."""
        if self.recording_since_us is None:
            return False
        self.storage.used_mib += VIDEO_MIB_S * 1e-6 * (self._time_us - self.recording_since_us)
        self.recording_since_us = None
        if self.keeper is not None:
            self.keeper.stop_video(self._time_us)
        self.send_status()
        return True

    def move_lens(self) -> None:
        """A continuous zoom or focus has begun, or another property of the lens has changed."""
        self._lens_us = self._time_us
        self.send_settings()

    def send_settings(self) -> None:
        """Send CAMERA_SETTINGS."""
        self.send(self._settings(self._time_us))

    def send_status(self) -> None:
        """Send CAMERA_CAPTURE_STATUS."""
        self.send(capture_status(self, self._time_us))

    # inside

    def _on_message(self, message: Any, sender: tuple[int, int]) -> None:
        new = self.vehicle.handle(message, sender, self._time_us)
        if (
            new
            and message.get_msgId() == mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
            and self.trigger.travelled(self.vehicle.velocity_ned_m_s, self._time_us)
        ):
            self.take_photo()
        if not new:
            self.definition.handle(message, sender, self._time_us)

    def _record(self, time_us: int) -> None:
        if self.recorded_mib >= self.storage.available_mib:
            self.stop_recording()
        elif self.status_interval_us and time_us >= self._next_status_us:
            self._next_status_us += self.status_interval_us
            self.send_status()

    @property
    def recorded_mib(self) -> float:
        """Size of the video that is being recorded."""
        since_us = self.recording_since_us
        return 0.0 if since_us is None else VIDEO_MIB_S * 1e-6 * (self._time_us - since_us)

    def _settings(self, time_us: int) -> Any:
        lens = self.lens
        return mavlink.MAVLink_camera_settings_message(
            self.time_ms, self.mode, lens.zoom_percent, lens.focus_percent
        )
