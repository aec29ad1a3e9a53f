"""Encoding of pictures to H.264 with FFmpeg (PyAV): as RTP packets for streams, as MP4 for recordings."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

import av
import numpy as np
from av.video.frame import PictureType
from numpy.typing import NDArray

Picture = NDArray[np.uint8]

RTP_CLOCK_HZ: Final = 90_000
PAYLOAD_TYPE: Final = 96
_PACKET_BYTES: Final = 1400
_MICROSECOND: Final = Fraction(1, 1_000_000)
_TICK: Final = Fraction(1, RTP_CLOCK_HZ)
_OPTIONS: Final = {"preset": "ultrafast", "tune": "zerolatency", "crf": "22", "forced-idr": "1"}


class RtpEncoder:
    """An RTP packet stream in progress (RFC 6184), with RTCP sender reports between the packets.

    Args:
        width_px, height_px: of the pictures; even numbers.
        rate_hz: approximate number of pictures per second.
        send: called with (packet, whether it is RTCP).
    """

    def __init__(
        self, *, width_px: int, height_px: int, rate_hz: float, send: Callable[[bytes, bool], None]
    ) -> None:
        self._send = send
        self._container: Any = av.open(
            self,  # FFmpeg needs only `write`
            "w",
            format="rtp",
            container_options={"packetsize": str(_PACKET_BYTES)},
            buffer_size=_PACKET_BYTES,
        )
        self._stream = _video_stream(self._container, width_px, height_px, rate_hz, _TICK)

    def write(self, packet: bytes) -> int:
        """Called by FFmpeg, which uses this object as a file: one call for each packet."""
        data = bytes(packet)
        # payload types 72..76 are ambiguous with RTCP (RFC 5761, section 4); ours is 96
        self._send(data, 64 <= data[1] & 0x7F <= 95)
        return len(data)

    def encode(self, picture: Picture, *, ticks: int, key: bool) -> None:
        """Send one picture; `ticks` of 90 kHz increase. A decoder can begin at a key picture."""
        for packet in self._stream.encode(_frame(picture, ticks, _TICK, key)):
            self._container.mux(packet)

    def close(self) -> None:
        """End the stream."""
        self._container.close()


class Recording:
    """An MP4 file that is readable up to its last fragment, even if the process is killed or the disk is
    full.

    Attributes:
        path: the file.

    Raises:
        OSError: the file can't be created, or exists.
    """

    def __init__(self, path: Path, *, width_px: int, height_px: int, rate_hz: float) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("xb")
        self._container: Any = av.open(
            self._file, "w", format="mp4", options={"movflags": "frag_keyframe+empty_moov+default_base_moof"}
        )
        self._stream = _video_stream(self._container, width_px, height_px, rate_hz, _MICROSECOND)
        self._start_us: int | None = None

    def write(self, picture: Picture, *, time_us: int) -> None:
        """Add a picture of a vehicle time; times increase.

        Raises:
            OSError: the file can't be written.
        """
        if self._start_us is None:
            self._start_us = time_us
        for packet in self._stream.encode(_frame(picture, time_us - self._start_us, _MICROSECOND, False)):
            self._container.mux(packet)

    def close(self) -> None:
        """Finish the file, and close it in any case.

        Raises:
            OSError: its end can't be written.
        """
        with self._file, self._container:
            if self._start_us is not None:
                for packet in self._stream.encode(None):
                    self._container.mux(packet)


def _video_stream(container: Any, width_px: int, height_px: int, rate_hz: float, unit: Fraction) -> Any:
    stream = container.add_stream("libx264", rate=max(1, round(rate_hz)))
    stream.width, stream.height, stream.pix_fmt = width_px, height_px, "yuv420p"
    context = stream.codec_context
    context.time_base = unit
    context.gop_size = max(1, round(rate_hz))  # a key picture each second
    context.options = dict(_OPTIONS)
    return stream


def _frame(picture: Picture, ticks: int, unit: Fraction, key: bool) -> av.VideoFrame:
    frame = av.VideoFrame.from_ndarray(picture, format="bgr24")
    frame.pts = ticks
    frame.time_base = unit
    if key:
        frame.pict_type = PictureType.I
    return frame
