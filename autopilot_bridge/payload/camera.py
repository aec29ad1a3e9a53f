"""The camera as a MAVLink component: camera protocol v2, and LANDING_TARGET for the targets it detects.

Source: MAVLink camera protocol v2 (mavlink.io/en/services/camera.html) and the LANDING_TARGET message.
Detections carry angles off the optical axis; their tangents are the normalized image coordinates (Tolman et
al. 2021, equation 36). The camera has no GPS receiver: the place of a photo is the position that the
autopilot has sent.
"""

from collections.abc import Callable
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage
from autopilot_bridge.mavlink import dialect as mavlink
from autopilot_bridge.mavlink.camera_scan import CameraScan, camera_scan_message
from autopilot_bridge.payload.camera_actions import CameraActions
from autopilot_bridge.payload.camera_commands import CameraCommands
from autopilot_bridge.payload.camera_definition import CameraDefinition
from autopilot_bridge.payload.camera_messages import (
    capture_status,
    fov_status,
    information,
    landing_target,
    tracking_geo_status,
)
from flightsim.payload import Camera, CameraFrame, Gimbal

_LENS_INTERVAL_US: Final = 100_000


class CameraComponent(CameraActions):
    """Takes photos and videos, zooms, focuses, tracks detections, and reports the detected targets.

    Args:
        camera: the device.
        system_id: of the vehicle.
        send: sends packed frames.
        gimbal: the gimbal that carries it; None: fixed to the body.
        gimbal_device_id: id of that gimbal; 0: none.

    Attributes:
        definition: the camera definition file and the camera's settings.
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
            camera, system_id=system_id, send=send, gimbal=gimbal, gimbal_device_id=gimbal_device_id
        )
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
        self.definition = CameraDefinition(self)
        self._commands = CameraCommands(self, self.definition)
        self._handlers.update(self._commands.handlers)
        self._answers.update(self._commands.answers)

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
        if self.device.parameters.reader is not None and frame.searched:
            self.send(self._scan(frame))

    # inside

    def _on_message(self, message: MAVLinkMessage, sender: tuple[int, int]) -> None:
        new = self.vehicle.handle(message, sender, self._time_us)
        if (
            new
            and message.get_msgId() == mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
            and self.trigger.travelled(self.vehicle.velocity_ned_m_s, self._time_us)
        ):
            self.take_photo()
        if not new:
            self.definition.handle(message, sender, self._time_us)

    def _scan(self, frame: CameraFrame) -> MAVLinkMessage:
        parameters = self.device.parameters
        model = parameters.model
        return camera_scan_message(
            CameraScan(
                number=frame.number,
                time_us=frame.time_us,
                detections=len(frame.detections),
                width_px=model.width_px,
                height_px=model.height_px,
                focal_px=model.focal_px * self.device.zoom,
                distortion=parameters.imager.distortion.coefficients,
                mount_rad=None
                if self._gimbal is not None
                else (parameters.mount_roll_rad, parameters.mount_pitch_rad, parameters.mount_yaw_rad),
                position_frd_m=parameters.position_frd_m,
            )
        )

    def _record(self, time_us: int) -> None:
        if self.recorded_mib >= self.storage.available_mib:
            self.stop_recording()
        elif self.status_interval_us and time_us >= self._next_status_us:
            self._next_status_us += self.status_interval_us
            self.send_status()
