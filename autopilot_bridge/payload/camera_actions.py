"""What commands make the camera component do: photos, videos, and the reports of them."""

from autopilot_bridge.dispatch import streams
from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.payload.camera_messages import capture_status, image_captured, photo_notes
from autopilot_bridge.payload.camera_state import CameraState
from autopilot_bridge.payload.camera_storage import VIDEO_MIB_S


class CameraActions(CameraState):
    """A camera that takes photos and videos and moves its lens; arguments as `CameraState`."""

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

    @streams(dialect.MAVLink_camera_settings_message)
    def _settings(self, time_us: int) -> MAVLinkMessage:
        return dialect.MAVLink_camera_settings_message(
            time_boot_ms=self.time_ms,
            mode_id=self.mode,
            zoomLevel=self.lens.zoom_percent,
            focusLevel=self.lens.focus_percent,
        )
