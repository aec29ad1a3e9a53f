"""Pictures of a live stream, in a thread of their own: the newest one waits, older ones are dropped."""

import asyncio
import threading
from collections import deque
from collections.abc import Callable
from typing import Final

from estimators.errors import VideoError
from estimators.vision.video import Picture, TimedPicture, frames_of

__all__ = ["LivePictures", "StreamClock"]

_RETRY_S: Final = 1.0
_ARRIVALS: Final = 100
_REAL_TIME: Final = (0.9, 1.1)


class StreamClock:
    """The vehicle time of a stream's pictures, from the times of their arrival.

    A network delays each picture by another time, and the stream's own times don't have these delays: the
    least difference of both, of the last hundred pictures, belongs to the picture with the least delay. In a
    simulation that is faster than real time the arrival counts, because the stream's clock has another rate.
    """

    def __init__(self) -> None:
        self._differences_us: deque[int] = deque(maxlen=_ARRIVALS)

    def exposed_us(self, arrived_us: int, stream_us: int, *, latency_s: float, rate: float = 1.0) -> int:
        """Vehicle time of an exposure.

        Args:
            arrived_us: vehicle time of the picture's arrival.
            stream_us: its time in the stream.
            latency_s: from the exposure to the arrival, at least.
            rate: vehicle seconds per second.
        """
        if not _REAL_TIME[0] <= rate <= _REAL_TIME[1]:
            self._differences_us.clear()
            return max(0, arrived_us - round(latency_s * 1e6))
        self._differences_us.append(arrived_us - stream_us)
        return max(0, stream_us + min(self._differences_us) - round(latency_s * 1e6))


class LivePictures:
    """Reads a stream until it is closed. A stream that ends, or is silent, is opened again.

    Args:
        source: address of the stream.
        now_us: vehicle time now; None: not known yet, and pictures are dropped.
        rate: returns the vehicle seconds per second.
        latency_s: from the exposure to the arrival.
        timeout_s: silence after which a stream counts as broken off.

    Attributes:
        received: number of pictures.
        dropped: number of those that were not searched, because newer ones had arrived.
        breaks: how often the stream ended or could not be opened.
        failure: why it did so the last time; "": it has not.
        broken: no picture has arrived since then.
    """

    def __init__(
        self,
        source: str,
        *,
        now_us: Callable[[], int | None],
        rate: Callable[[], float],
        latency_s: float,
        timeout_s: float,
    ) -> None:
        self._source, self._now_us, self._rate = source, now_us, rate
        self._latency_s, self._timeout_s = latency_s, timeout_s
        self._loop = asyncio.get_running_loop()
        self._arrived = asyncio.Event()
        self._newest: tuple[int, Picture] | None = None
        self._ended = threading.Event()
        self.received = self.dropped = self.breaks = 0
        self.failure, self.broken = "", False
        self._thread = threading.Thread(target=self._read, name="pictures", daemon=True)
        self._thread.start()

    async def next(self) -> tuple[int, Picture]:
        """Vehicle time of the exposure of the newest picture, and the picture (height, width, 3), BGR."""
        while self._newest is None:
            self._arrived.clear()
            await self._arrived.wait()
        newest, self._newest = self._newest, None
        return newest

    def close(self) -> None:
        """Stop reading."""
        self._ended.set()

    def _read(self) -> None:
        while not self._ended.is_set():
            clock = StreamClock()
            try:
                for picture in frames_of(self._source, timeout_s=self._timeout_s):
                    if self._ended.is_set():
                        return
                    self._take(picture, clock)
                self.failure = f"the video {self._source} has ended"
            except VideoError as error:
                self.failure = str(error)
            self.breaks += 1
            self.broken = True
            self._ended.wait(_RETRY_S)

    def _take(self, picture: TimedPicture, clock: StreamClock) -> None:
        now_us = self._now_us()
        if now_us is None:
            return
        exposed_us = clock.exposed_us(now_us, picture.time_us, latency_s=self._latency_s, rate=self._rate())
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._put, exposed_us, picture.pixels)

    def _put(self, exposed_us: int, pixels: Picture) -> None:
        self.received += 1
        self.broken = False
        self.dropped += self._newest is not None
        self._newest = (exposed_us, pixels)
        self._arrived.set()
