"""The camera's video stream in MAVLink messages."""

from dataclasses import dataclass
from typing import Any

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
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
        return dialect.MAVLink_video_stream_information_message(
            stream_id=STREAM_ID,
            count=1,
            type=dialect.VIDEO_STREAM_TYPE_RTSP,
            **self._picture(fov_deg),
            name=fixed_text("camera", 32),
            uri=fixed_text(self.uri, 160),
            encoding=dialect.VIDEO_STREAM_ENCODING_H264,
        )

    def status(self, fov_deg: float) -> MAVLinkMessage:
        """VIDEO_STREAM_STATUS."""
        return dialect.MAVLink_video_stream_status_message(stream_id=STREAM_ID, **self._picture(fov_deg))

    def _picture(self, fov_deg: float) -> dict[str, Any]:
        """The common fields of both messages."""
        return {
            "flags": int(dialect.VIDEO_STREAM_STATUS_FLAGS_RUNNING) if self.running else 0,
            "framerate": self.rate_hz,
            "resolution_h": self.width_px,
            "resolution_v": self.height_px,
            "bitrate": self.bitrate,
            "rotation": 0,
            "hfov": round(fov_deg),
        }
