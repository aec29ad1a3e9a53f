"""Pictures from outside: recorded videos and live streams (FFmpeg, by PyAV), and a writer of lossless
videos.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import VideoError
from flightsim.foundation.file_content import FileError, open_file
from flightsim.foundation.packages import required

__all__ = ["Film", "TimedPicture", "frames_of", "is_stream"]

Picture = NDArray[np.uint8]

_MICROSECOND: Final = Fraction(1, 1_000_000)
_STREAMS: Final = (
    "rtsp://",
    "rtsps://",
    "rtmp://",
    "udp://",
    "rtp://",
    "srt://",
    "tcp://",
    "http://",
    "https://",
)
_LOSSLESS: Final = {"qp": "0", "preset": "ultrafast"}
_RTSP: Final = {"rtsp_transport": "tcp", "fflags": "nobuffer"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimedPicture:
    """One frame of a video.

    Attributes:
        time_us: its time in the video; a stream's begins anywhere.
        pixels: (height, width, 3), BGR.
    """

    time_us: int
    pixels: Picture


def is_stream(source: str) -> bool:
    """Whether a video is the address of a live stream, and not a file."""
    return source.lower().startswith(_STREAMS)


def frames_of(
    source: str, *, timeout_s: float | None = None, rate_hz: float | None = None
) -> Iterator[TimedPicture]:
    """The frames of a video, as they come.

    Args:
        source: a file, or the address of a stream (RTSP over TCP).
        timeout_s: of a stream, to open it and between frames.
        rate_hz: frames per second of a file without times, such as raw H.264.

    Raises:
        VideoError: it can't be opened or decoded, or has no pictures; a stream was silent for so long; its
            frames have no times and no rate is given, or they have times and a rate is given. The end of a
            file, or of a stream by its server, ends the iteration.
        MissingPackage: PyAV is not installed.
    """
    av = required("av", f"the video {source}")
    if not is_stream(source):
        try:
            open_file(source).close()  # FFmpeg waits for a pipe, and says less of what is no video
        except FileError as error:
            raise VideoError(f"can't open the video {source}: {error.reason}") from None
    options = dict(_RTSP) if source.lower().startswith("rtsp") else {}
    try:
        container = av.open(source, options=options, timeout=timeout_s, metadata_errors="ignore")
    except (av.error.FFmpegError, OSError) as error:
        raise VideoError(f"can't open the video {source}: {error.strerror or error}") from error
    with container:
        if not container.streams.video:
            raise VideoError(f"{source} has no video in it")
        stream = container.streams.video[0]
        timed = untimed = 0
        try:
            for frame in container.decode(stream):
                if frame.pts is not None and frame.time_base is not None:
                    time_us = round(frame.pts * frame.time_base * 1_000_000)
                    timed += 1
                elif rate_hz is not None:
                    time_us = round(untimed * 1e6 / rate_hz)
                    untimed += 1
                else:
                    untimed += 1
                    continue
                if timed and rate_hz is not None:
                    raise VideoError(f"the frames of {source} have times of their own; leave out the rate")
                pixels = np.asarray(frame.to_ndarray(format="bgr24"), dtype=np.uint8)
                yield TimedPicture(time_us=time_us, pixels=pixels)
            if untimed and not timed and rate_hz is None:
                raise VideoError(
                    f"{source} has {untimed} pictures and no times (a raw stream without a container); give "
                    "its frames per second with `rate`"
                )
        except av.error.EOFError:
            return
        except (av.error.FFmpegError, OSError) as error:
            raise VideoError(f"the video {source} broke off: {error.strerror or error}") from error


class Film:
    """Writes a lossless video (H.264 without quantization, in MP4): its frames are those written, to the bit.

    Args:
        path: the file; it must not exist.
        width_px, height_px: of the pictures.

    Raises:
        VideoError: the file exists, or can't be created.
        MissingPackage: PyAV is not installed.
    """

    def __init__(self, path: Path, *, width_px: int, height_px: int) -> None:
        self._path = path
        self._av = required("av", f"the video {path}")
        try:
            self._file = path.open("xb")
        except OSError as error:
            raise VideoError(f"can't create the video {path}: {error.strerror}") from error
        self._container: Any = self._av.open(self._file, "w", format="mp4")
        stream = self._container.add_stream("libx264rgb", rate=30)
        stream.width, stream.height, stream.pix_fmt = width_px, height_px, "bgr24"
        stream.codec_context.time_base = _MICROSECOND
        stream.codec_context.options = dict(_LOSSLESS)
        self._stream = stream
        self.frames = 0

    def write(self, time_us: int, picture: Picture) -> None:
        """Add a picture (height, width, 3), BGR; times increase, from 0.

        Raises:
            VideoError: the file can't be written.
        """
        frame = self._av.VideoFrame.from_ndarray(picture, format="bgr24")
        frame.pts, frame.time_base = time_us, _MICROSECOND
        with self._reporting():
            for packet in self._stream.encode(frame):
                self._container.mux(packet)
        self.frames += 1

    def close(self) -> None:
        """Finish the file; a second call does nothing.

        Raises:
            VideoError: its end can't be written.
        """
        if self._file.closed:
            return
        with self._reporting(), self._file, self._container:
            if self.frames:
                for packet in self._stream.encode(None):
                    self._container.mux(packet)

    @contextmanager
    def _reporting(self) -> Iterator[None]:
        try:
            yield
        except (self._av.error.FFmpegError, OSError) as error:
            raise VideoError(
                f"can't write the video {self._path}: {error.strerror}; check the disk"
            ) from error

    def __enter__(self) -> "Film":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
