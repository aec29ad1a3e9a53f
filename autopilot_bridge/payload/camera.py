"""The camera as a MAVLink component: camera protocol v2, and LANDING_TARGET for the targets it detects.

Source: MAVLink camera protocol v2 (mavlink.io/en/services/camera.html) and the LANDING_TARGET message.
Detections carry angles off the optical axis; their tangents are the normalized image coordinates (Tolman et
al. 2021, equation 36). The camera has no GPS receiver: the place of a photo is the position that the
autopilot has sent.
"""

from collections.abc import Callable
from typing import Final, get_args

from autopilot_bridge.dispatch import receives, streams
from autopilot_bridge.mavlink import MAVLinkMessage, dialect
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
from autopilot_bridge.payload.component import Sender
from autopilot_bridge.payload.reported_vehicle import Report
from flightsim.payload import Camera, CameraFrame

_LENS_INTERVAL_US: Final = 100_000


class CameraComponent(CameraActions):
    """Takes photos and videos, zooms, focuses, tracks detections, and reports the detected targets; arguments
    as `Component`.

    Attributes:
        definition: the camera definition file and the camera's settings.
    """

    def __init__(self, device: Camera, *, system_id: int, send: Callable[[bytes], None]) -> None:
        super().__init__(device, system_id=system_id, send=send)
        self.definition = CameraDefinition(self)
        self._add_part(self.definition)
        self._add_part(CameraCommands(self, self.definition))

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

    def update(self, reading: CameraFrame) -> None:
        """Send the detections of a frame that was delivered on this step."""
        self.tracker.update(reading)
        for detection in reading.detections:
            self.send(landing_target(detection))
        if self.device.parameters.reader is not None and reading.searched:
            self.send(self._scan(reading))

    # inside

    @streams(dialect.MAVLink_camera_information_message)
    def _information(self, time_us: int) -> MAVLinkMessage:
        return information(self)

    @streams(dialect.MAVLink_camera_capture_status_message)
    def _capture_status(self, time_us: int) -> MAVLinkMessage:
        return capture_status(self, time_us)

    @streams(dialect.MAVLink_storage_information_message)
    def _storage_information(self, time_us: int) -> MAVLinkMessage:
        return self.storage.message(self.time_ms)

    @streams(dialect.MAVLink_camera_fov_status_message)
    def _fov_status(self, time_us: int) -> MAVLinkMessage:
        return fov_status(self, time_us)

    @streams(dialect.MAVLink_camera_tracking_image_status_message)
    def _tracking_image_status(self, time_us: int) -> MAVLinkMessage:
        return self.tracker.message()

    @streams(dialect.MAVLink_camera_tracking_geo_status_message)
    def _tracking_geo_status(self, time_us: int) -> MAVLinkMessage:
        return tracking_geo_status(self, time_us)

    @receives(*get_args(Report))
    def _follow_vehicle(self, message: Report, sender: Sender, time_us: int) -> None:
        if (
            self.vehicle.handle(message, sender, time_us)
            and isinstance(message, dialect.MAVLink_global_position_int_message)
            and self.trigger.travelled(self.vehicle.velocity_ned_m_s, time_us)
        ):
            self.take_photo()

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
                if self.device.gimbal is not None
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
