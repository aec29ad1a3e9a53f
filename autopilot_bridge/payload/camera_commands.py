"""The commands of camera protocol v2, and older ones that clients still send (DO_DIGICAM_CONTROL, ...)."""

import math
from collections.abc import Callable, Mapping
from typing import Final

from autopilot_bridge.dispatch import command, on_request
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.payload.camera_actions import CameraActions
from autopilot_bridge.payload.camera_definition import CameraDefinition
from autopilot_bridge.payload.camera_storage import PHOTO_QUALITY, STORAGE_ID
from autopilot_bridge.payload.camera_video import STREAM_ID, VideoStream
from autopilot_bridge.payload.component import CommandMessage, Sender, parameters, whole

_ACCEPTED: Final = int(dialect.MAV_RESULT_ACCEPTED)
_DENIED: Final = int(dialect.MAV_RESULT_DENIED)
_FAILED: Final = int(dialect.MAV_RESULT_FAILED)
_REJECTED: Final = int(dialect.MAV_RESULT_TEMPORARILY_REJECTED)
_UNSUPPORTED: Final = int(dialect.MAV_RESULT_UNSUPPORTED)
_MODES: Final = (dialect.CAMERA_MODE_IMAGE, dialect.CAMERA_MODE_VIDEO, dialect.CAMERA_MODE_IMAGE_SURVEY)
_REPEATED_US: Final = 3_000_000  # a single photo requested again within this time is the same photo
_MAX_STATUS_HZ: Final = 50.0
_OLD_REQUESTS: Final[Mapping[int, int]] = {
    dialect.MAV_CMD_REQUEST_CAMERA_INFORMATION: dialect.MAVLINK_MSG_ID_CAMERA_INFORMATION,
    dialect.MAV_CMD_REQUEST_CAMERA_SETTINGS: dialect.MAVLINK_MSG_ID_CAMERA_SETTINGS,
    dialect.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS: dialect.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS,
    dialect.MAV_CMD_REQUEST_STORAGE_INFORMATION: dialect.MAVLINK_MSG_ID_STORAGE_INFORMATION,
}


class CameraCommands:
    """Executes the commands for a camera component, and the requests that have parameters of their own."""

    def __init__(self, camera: CameraActions, definition: CameraDefinition) -> None:
        self._camera = camera
        self._definition = definition
        self._newest_single: tuple[Sender, int, int] | None = None  # sender, sequence number, time

    # photos and videos

    @command(dialect.MAV_CMD_IMAGE_START_CAPTURE)
    def _start_capture(self, message: CommandMessage, sender: Sender) -> int | None:
        """p1 camera, p2 interval s, p3 number of photos (0: unlimited), p4 sequence number of a single
        photo.
        """
        camera = self._camera
        _, interval_s, count_value, sequence_value, *_ = parameters(message)
        count, sequence = whole(count_value, -1), whole(sequence_value, 0)
        if count < 0:
            return _DENIED
        if camera.storage.full:
            return _FAILED
        if count != 1:
            if not camera.trigger.start(interval_s, count, camera.time_us):
                return _DENIED
            camera.send_status()
            return _ACCEPTED
        single = (sender, sequence, camera.time_us)
        if sequence > 0 and self._is_repeated(single):
            return _ACCEPTED
        self._newest_single = single
        return _ACCEPTED if camera.take_photo() else _FAILED

    def _is_repeated(self, single: tuple[Sender, int, int]) -> bool:
        """The command was sent again because its acknowledgement was lost."""
        last = self._newest_single
        return last is not None and last[:2] == single[:2] and single[2] - last[2] < _REPEATED_US

    @command(dialect.MAV_CMD_IMAGE_STOP_CAPTURE)
    def _stop_capture(self, message: CommandMessage, sender: Sender) -> int | None:
        self._camera.trigger.stop()
        self._camera.send_status()
        return _ACCEPTED

    @command(dialect.MAV_CMD_VIDEO_START_CAPTURE)
    def _start_video(self, message: CommandMessage, sender: Sender) -> int | None:
        """p1 stream (0: all), p2 rate of the status messages during the video, Hz."""
        stream, status_hz, *_ = parameters(message)
        if whole(stream, -1) not in (0, STREAM_ID) or not 0.0 <= status_hz <= _MAX_STATUS_HZ:
            return _DENIED
        if self._camera.recording_since_us is not None:
            return _REJECTED
        return _ACCEPTED if self._camera.start_recording(status_hz) else _FAILED

    @command(dialect.MAV_CMD_VIDEO_STOP_CAPTURE)
    def _stop_video(self, message: CommandMessage, sender: Sender) -> int | None:
        if whole(message.param1, -1) not in (0, STREAM_ID):
            return _DENIED
        self._camera.stop_recording()
        return _ACCEPTED

    @command(dialect.MAV_CMD_DO_TRIGGER_CONTROL)
    def _trigger_control(self, message: CommandMessage, sender: Sender) -> int | None:
        """p1 enable (1, 0, -1: unchanged), p2 reset the sequence (1), p3 pause (1, 0, -1: unchanged)."""
        enable, reset, pause = (whole(value, -1) for value in parameters(message)[:3])
        if enable not in (-1, 0, 1) or reset not in (-1, 0, 1) or pause not in (-1, 0, 1):
            return _DENIED
        trigger = self._camera.trigger
        if enable != -1:
            trigger.enabled = bool(enable)
        if pause != -1:
            trigger.paused = bool(pause)
        if reset == 1:
            self._newest_single = None
        return _ACCEPTED

    @command(dialect.MAV_CMD_DO_SET_CAM_TRIGG_DIST)
    def _trigger_distance(self, message: CommandMessage, sender: Sender) -> int | None:
        """p1 metres between photos (0: off, -1: unchanged), p3 one photo at once (1)."""
        distance_m, _, at_once, *_ = parameters(message)
        if distance_m != -1.0 and not self._camera.trigger.set_distance(distance_m):
            return _DENIED
        if whole(at_once, 0) == 1:
            self._camera.take_photo()
        return _ACCEPTED

    @command(dialect.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL)
    def _trigger_interval(self, message: CommandMessage, sender: Sender) -> int | None:
        """p1 milliseconds between photos (0: off, -1: unchanged)."""
        if message.param1 == -1.0:
            return _ACCEPTED
        accepted = self._camera.trigger.set_cycle(1e-3 * message.param1, self._camera.time_us)
        return _ACCEPTED if accepted else _DENIED

    @command(dialect.MAV_CMD_DO_DIGICAM_CONTROL)
    def _digicam(self, message: CommandMessage, sender: Sender) -> int | None:
        """DO_DIGICAM_CONTROL: p3 zoom step, p4 focus lock, p5 shoot (1)."""
        values = parameters(message)
        step, shoot = values[2], whole(values[4], 0)
        if math.isfinite(step) and step != 0.0 and self._camera.lens.zoom(dialect.ZOOM_TYPE_STEP, step):
            self._camera.move_lens()
        if shoot == 1 and not self._camera.take_photo():
            return _FAILED
        return _ACCEPTED

    # settings

    @command(dialect.MAV_CMD_SET_CAMERA_MODE)
    def _set_mode(self, message: CommandMessage, sender: Sender) -> int | None:
        mode = whole(message.param2, -1)
        if mode not in _MODES:
            return _DENIED
        self._camera.mode = mode
        self._camera.send_settings()
        self._definition.report("CAM_MODE")
        return _ACCEPTED

    @command(dialect.MAV_CMD_SET_CAMERA_ZOOM)
    def _zoom(self, message: CommandMessage, sender: Sender) -> int | None:
        lens = self._camera.lens
        return self._drive_lens(message, lens.zoom if lens.has_zoom else None)

    @command(dialect.MAV_CMD_SET_CAMERA_FOCUS)
    def _focus(self, message: CommandMessage, sender: Sender) -> int | None:
        lens = self._camera.lens
        return self._drive_lens(message, lens.focus if lens.has_focus else None)

    def _drive_lens(self, message: CommandMessage, drive: Callable[[int, float], bool] | None) -> int:
        """p1 kind of the value, p2 value."""
        if drive is None:
            return _UNSUPPORTED
        if not drive(whole(message.param1, -1), message.param2):
            return _DENIED
        self._camera.move_lens()
        return _ACCEPTED

    @command(dialect.MAV_CMD_RESET_CAMERA_SETTINGS)
    def _reset(self, message: CommandMessage, sender: Sender) -> int | None:
        if whole(message.param1, 0) != 1:
            return _DENIED
        self._camera.mode = int(dialect.CAMERA_MODE_IMAGE)
        self._camera.lens.reset()
        self._camera.photo_quality = PHOTO_QUALITY
        self._camera.send_settings()
        return _ACCEPTED

    @command(dialect.MAV_CMD_STORAGE_FORMAT)
    def _format(self, message: CommandMessage, sender: Sender) -> int | None:
        """p1 storage, p2 format (1), p3 count photos from 0 again (1)."""
        camera = self._camera
        storage, format_it, reset_log, *_ = (whole(value, -1) for value in parameters(message))
        if storage not in (0, STORAGE_ID) or format_it != 1:
            return _DENIED
        if camera.recording_since_us is not None or camera.trigger.series:
            return _REJECTED
        camera.storage.format(reset_log=reset_log == 1)
        camera.send(camera.storage.message(camera.time_ms))
        camera.send_status()
        return _ACCEPTED

    # the stream

    @command(dialect.MAV_CMD_VIDEO_START_STREAMING)
    def _start_streaming(self, message: CommandMessage, sender: Sender) -> int | None:
        return self._set_streaming(message.param1, True)

    @command(dialect.MAV_CMD_VIDEO_STOP_STREAMING)
    def _stop_streaming(self, message: CommandMessage, sender: Sender) -> int | None:
        return self._set_streaming(message.param1, False)

    def _set_streaming(self, number: float, running: bool) -> int:
        def switch(stream: VideoStream, fov_deg: float) -> None:
            stream.running = running
            self._camera.send(stream.status(fov_deg))

        return self._with_stream(number, switch)

    @on_request(dialect.MAVLink_video_stream_information_message)
    def _send_stream(self, number: float) -> int:
        return self._with_stream(number, lambda stream, fov: self._camera.send(stream.information(fov)))

    @on_request(dialect.MAVLink_video_stream_status_message)
    def _send_stream_status(self, number: float) -> int:
        def report(stream: VideoStream, fov_deg: float) -> None:
            # MAVSDK 4.1 requests only the status, but reads the address only from the information
            self._camera.send(stream.information(fov_deg))
            self._camera.send(stream.status(fov_deg))

        return self._with_stream(number, report)

    def _with_stream(self, number: float, act: Callable[[VideoStream, float], None]) -> int:
        """Apply a function to the stream of a number (0: all) and the field of view, degrees."""
        stream = self._camera.stream
        if stream is None:
            return _UNSUPPORTED
        if whole(number, -1) not in (0, STREAM_ID):
            return _DENIED
        act(stream, math.degrees(self._camera.lens.fov_rad[0]))
        return _ACCEPTED

    # tracking

    @command(dialect.MAV_CMD_CAMERA_TRACK_POINT)
    def _track_point(self, message: CommandMessage, sender: Sender) -> int | None:
        x, y, radius, *_ = parameters(message)
        return self._tracked(self._camera.tracker.follow_point(x, y, radius))

    @command(dialect.MAV_CMD_CAMERA_TRACK_RECTANGLE)
    def _track_rectangle(self, message: CommandMessage, sender: Sender) -> int | None:
        return self._tracked(self._camera.tracker.follow_rectangle(*parameters(message)[:4]))

    def _tracked(self, tracks: bool) -> int:
        self._camera.send(self._camera.tracker.message())
        return _ACCEPTED if tracks else _FAILED

    @command(dialect.MAV_CMD_CAMERA_STOP_TRACKING)
    def _stop_tracking(self, message: CommandMessage, sender: Sender) -> int | None:
        self._camera.tracker.stop()
        self._camera.send(self._camera.tracker.message())
        return _ACCEPTED

    # data requested again

    @command(dialect.MAV_CMD_REQUEST_CAMERA_IMAGE_CAPTURE)
    def _old_photo(self, message: CommandMessage, sender: Sender) -> int | None:
        return self._send_photo(message.param1)

    @on_request(dialect.MAVLink_camera_image_captured_message)
    def _send_photo(self, index: float) -> int:
        """CAMERA_IMAGE_CAPTURED of a photo by its index; -1: the newest."""
        storage, number = self._camera.storage, whole(index, -2)
        message = storage.log.get(storage.images - 1 if number == -1 else number)
        if message is None:
            return _DENIED
        self._camera.send(message)
        return _ACCEPTED

    @on_request(dialect.MAVLink_storage_information_message)
    def _send_storage(self, number: float) -> int:
        if whole(number, -1) not in (0, STORAGE_ID):
            return _DENIED
        self._camera.send(self._camera.storage.message(self._camera.time_ms))
        return _ACCEPTED

    @command(*_OLD_REQUESTS)
    def _old_request(self, message: CommandMessage, sender: Sender) -> int | None:
        """Commands that are older than REQUEST_MESSAGE."""
        return self._camera.request(_OLD_REQUESTS[message.command])

    @command(dialect.MAV_CMD_REQUEST_VIDEO_STREAM_INFORMATION)
    def _old_stream_information(self, message: CommandMessage, sender: Sender) -> int | None:
        return self._send_stream(message.param1)

    @command(dialect.MAV_CMD_REQUEST_VIDEO_STREAM_STATUS)
    def _old_stream_status(self, message: CommandMessage, sender: Sender) -> int | None:
        return self._send_stream_status(message.param1)
