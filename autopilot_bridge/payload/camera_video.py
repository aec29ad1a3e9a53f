"""The camera's video stream in MAVLink messages."""

from dataclasses import dataclass

from autopilot_bridge.mavlink import MAVLinkMessage
from autopilot_bridge.mavlink import dialect as mavlink
from autopilot_bridge.payload.component import fixed_text

STREAM_ID = 1


@dataclass(slots=True)
class VideoStream:
    """One stream with a running server.

    Attributes:
        uri: RTSP address.
        width_px, height_px, rate_hz: of its pictures.
        bitrate: approximate bits per second.
        running: it delivers pictures (VIDEO_STOP_STREAMING).
    """

    uri: str
    width_px: int
    height_px: int
    rate_hz: float
    bitrate: int
    running: bool = True

    def information(self, fov_deg: float) -> MAVLinkMessage:
        """VIDEO_STREAM_INFORMATION."""
        return mavlink.MAVLink_video_stream_information_message(
            STREAM_ID,
            1,
            mavlink.VIDEO_STREAM_TYPE_RTSP,
            *self._picture(fov_deg),
            fixed_text("camera", 32),
            fixed_text(self.uri, 160),
            encoding=mavlink.VIDEO_STREAM_ENCODING_H264,
        )

    def status(self, fov_deg: float) -> MAVLinkMessage:
        """VIDEO_STREAM_STATUS."""
        return mavlink.MAVLink_video_stream_status_message(STREAM_ID, *self._picture(fov_deg))

    def _picture(self, fov_deg: float) -> tuple[int, float, int, int, int, int, int]:
        """The common fields of both messages, from the flags to the field of view."""
        flags = int(mavlink.VIDEO_STREAM_STATUS_FLAGS_RUNNING) if self.running else 0
        rotation_deg = 0
        size = (self.width_px, self.height_px)
        return (flags, self.rate_hz, *size, self.bitrate, rotation_deg, round(fov_deg))
