"""The camera as a MAVLink component: basics of camera protocol v2, and LANDING_TARGET for what it detects.

Source: MAVLink camera protocol v2 (mavlink.io/en/services/camera.html) and the LANDING_TARGET message.
Detections carry angles off the optical axis; their tangents are the normalized image coordinates (seed 004,
equation 36).
"""

import math
from collections.abc import Callable
from typing import Any, Final

from autopilot_bridge.mavlink import dialect as mavlink
from autopilot_bridge.payload.component import Component, fixed_text, whole
from flightsim.payload import Camera, CameraFrame, Detection

CAMERA_COMPONENT: Final = int(mavlink.MAV_COMP_ID_CAMERA)

_SENSOR_WIDTH_MM: Final = 6.0  # a 1/2.3-inch sensor; with the field of view it gives the focal length
_MODE_IMAGE: Final = 0
_CAPACITY_MIB: Final = 32_768.0
_IMAGE_MIB: Final = 4.0
_NO_NUMBER: Final = 255
_UNKNOWN_POSITION: Final = 0
_ACCEPTED: Final = int(mavlink.MAV_RESULT_ACCEPTED)
_DENIED: Final = int(mavlink.MAV_RESULT_DENIED)
_MIN_INTERVAL_S: Final = 0.1


class CameraComponent(Component):
    """Tells what the detector found, and takes still pictures (it counts them; nothing is rendered here).

    Args:
        camera: the device.
        gimbal_device_id: of the gimbal it hangs on; 0: none.
    """

    def __init__(
        self, camera: Camera, *, system_id: int, send: Callable[[bytes], None], gimbal_device_id: int = 0
    ) -> None:
        super().__init__(
            system_id=system_id,
            component_id=CAMERA_COMPONENT,
            mav_type=mavlink.MAV_TYPE_CAMERA,
            send=send,
            rates_hz={},
        )
        self._model = camera.parameters.model
        self._gimbal_device_id = gimbal_device_id
        self._images = 0
        self._pictures_left = 0
        self._interval_us = 0
        self._next_picture_us = 0
        self._builders.update(
            {
                mavlink.MAVLINK_MSG_ID_CAMERA_INFORMATION: self._information,
                mavlink.MAVLINK_MSG_ID_CAMERA_SETTINGS: self._settings,
                mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION: self._storage,
                mavlink.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS: self._capture_status,
            }
        )
        self._handlers.update(
            {
                mavlink.MAV_CMD_IMAGE_START_CAPTURE: self._on_start_capture,
                mavlink.MAV_CMD_IMAGE_STOP_CAPTURE: self._on_stop_capture,
                mavlink.MAV_CMD_SET_CAMERA_MODE: self._on_set_mode,
                mavlink.MAV_CMD_STORAGE_FORMAT: self._on_format,
            }
        )

    def step(self, time_us: int) -> None:
        """Streams, and pictures of a running series."""
        super().step(time_us)
        if self._pictures_left and time_us >= self._next_picture_us:
            self._next_picture_us += self._interval_us
            if self._pictures_left > 0:
                self._pictures_left -= 1
            self._take_picture()

    def tell(self, frame: CameraFrame) -> None:
        """Send the detections of a frame that was delivered on this step."""
        for detection in frame.detections:
            self.send(_landing_target(detection))

    def _on_message(self, message: Any, sender: tuple[int, int]) -> None:
        """Nothing but commands concerns it."""

    def _on_start_capture(self, message: Any, sender: tuple[int, int]) -> int | None:
        """IMAGE_START_CAPTURE: p2 interval s, p3 how many, 0 for ever."""
        interval_s, count = message.param2, whole(message.param3, -1)
        if count < 0 or (count != 1 and not interval_s >= _MIN_INTERVAL_S) or interval_s == math.inf:
            return _DENIED
        self._interval_us = round(interval_s * 1e6) if count != 1 else 0
        self._pictures_left = count or -1
        self._next_picture_us = self._time_us
        return _ACCEPTED

    def _on_stop_capture(self, message: Any, sender: tuple[int, int]) -> int | None:
        self._pictures_left = 0
        return _ACCEPTED

    def _on_set_mode(self, message: Any, sender: tuple[int, int]) -> int | None:
        return _ACCEPTED if whole(message.param2, -1) == _MODE_IMAGE else _DENIED

    def _on_format(self, message: Any, sender: tuple[int, int]) -> int | None:
        if whole(message.param2, 0) == 1:
            self._images = 0
        return _ACCEPTED

    def _take_picture(self) -> None:
        index, self._images = self._images, self._images + 1
        # the camera has no receiver of its own: the place is the autopilot's to tell
        self.send(
            mavlink.MAVLink_camera_image_captured_message(
                self.time_ms,
                0,
                0,
                _UNKNOWN_POSITION,
                _UNKNOWN_POSITION,
                _UNKNOWN_POSITION,
                _UNKNOWN_POSITION,
                [math.nan] * 4,
                index,
                1,
                b"",
            )
        )

    def _information(self, time_us: int) -> Any:
        model = self._model
        focal_length_mm = 0.5 * _SENSOR_WIDTH_MM / math.tan(0.5 * model.horizontal_fov_rad)
        return mavlink.MAVLink_camera_information_message(
            self.time_ms,
            fixed_text("flightstack", 32),
            fixed_text("simulated camera", 32),
            0x01000000,
            focal_length_mm,
            _SENSOR_WIDTH_MM,
            _SENSOR_WIDTH_MM * model.height_px / model.width_px,
            model.width_px,
            model.height_px,
            0,
            mavlink.CAMERA_CAP_FLAGS_CAPTURE_IMAGE,
            0,
            b"",
            gimbal_device_id=self._gimbal_device_id,
        )

    def _settings(self, time_us: int) -> Any:
        return mavlink.MAVLink_camera_settings_message(self.time_ms, _MODE_IMAGE)

    def _storage(self, time_us: int) -> Any:
        used_mib = min(self._images * _IMAGE_MIB, _CAPACITY_MIB)
        return mavlink.MAVLink_storage_information_message(
            self.time_ms,
            1,
            1,
            mavlink.STORAGE_STATUS_READY,
            _CAPACITY_MIB,
            used_mib,
            _CAPACITY_MIB - used_mib,
            0.0,
            0.0,
        )

    def _capture_status(self, time_us: int) -> Any:
        series = self._pictures_left != 0
        return mavlink.MAVLink_camera_capture_status_message(
            self.time_ms,
            3 if series else 0,  # interval set and capture in progress
            0,
            1e-6 * self._interval_us if series else 0.0,
            0,
            max(0.0, _CAPACITY_MIB - self._images * _IMAGE_MIB),
            self._images,
        )


def _landing_target(detection: Detection) -> Any:
    tagged = detection.target_id >= 0
    return mavlink.MAVLink_landing_target_message(
        detection.time_us,
        detection.target_id if 0 <= detection.target_id < _NO_NUMBER else _NO_NUMBER,
        mavlink.MAV_FRAME_BODY_FRD,
        detection.angle_x_rad,
        detection.angle_y_rad,
        detection.distance_m,
        detection.size_rad,
        detection.size_rad,
        0.0,
        0.0,
        0.0,
        [1.0, 0.0, 0.0, 0.0],
        mavlink.LANDING_TARGET_TYPE_VISION_FIDUCIAL if tagged else mavlink.LANDING_TARGET_TYPE_VISION_OTHER,
        0,
    )
