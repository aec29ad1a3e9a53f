"""The vision process over a live stream: the messages of the pictures are sent on the vehicle's link."""

import asyncio
from contextlib import suppress
from typing import Any, Final, Generic

from autopilot_bridge.clock import TelemetryClock, run, unix_time_us
from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.links import VEHICLE_FORMS, Link, ReplayLog, open_link, parse_address
from autopilot_bridge.mavlink import Frame
from autopilot_bridge.tlog import TlogWriter
from estimators.errors import EstimatorError, VideoError
from estimators.messages import read_message
from estimators.reports.summary import COMPLETED, FAILED, INTERRUPTED
from estimators.vision.video import Picture
from missions.errors import LinkClosed
from missions.estimation.picture_source import LivePictures
from missions.estimation.rates import interval_request
from missions.estimation.vision_request import (
    Ended,
    Found,
    OnProgress,
    PictureProcess,
    VisionRequest,
    progress_of,
)
from missions.flown.camera_film import CameraFilm
from missions.flown.records import FlightRecorder
from missions.flown.run_folder import LOG_NAME, create_run_folder
from missions.process.ending import StopOnSignals
from missions.vehicle.connection import Connection
from missions.vehicle.signing import client_signing

__all__ = ["next_to_link"]

_LOOK_S: Final = 0.25
_FILM_NAME: Final = "camera.mp4"


def next_to_link(
    request: VisionRequest, pictures: PictureProcess[Any], on_progress: OnProgress | None
) -> Ended:
    assert request.connect is not None
    address = parse_address(request.connect, VEHICLE_FORMS)
    if isinstance(address, ReplayLog):
        raise EstimatorError(f"`connect` {address}: that is a log; give it as `log`, with a recording")
    link = open_link(address)
    try:
        request.on_open()
        folder = create_run_folder(request.out, "vision")
        log = TlogWriter(folder / LOG_NAME)
        recorder = FlightRecorder(log, epoch_us=None, unix_time_us=unix_time_us)
        film = CameraFilm(folder / _FILM_NAME, pictures.camera) if request.film else None
        try:
            loop = asyncio.SelectorEventLoop()
            process = _Live(request, link, pictures, recorder, film)
            with StopOnSignals(loop, process.stop):
                run(process.run(on_progress), loop)
            if film is not None:
                process.close(film)
        finally:
            recorder.close()
    finally:
        link.close()
    reason = process.reason or recorder.failure
    outcome = COMPLETED
    if reason:
        outcome = FAILED
    elif process.stopped and request.duration_s is not None:
        outcome = INTERRUPTED
    return folder, outcome, reason, {"connect": request.connect, **process.figures}


class _Live(Generic[Found]):
    """One run on an open link."""

    def __init__(
        self,
        request: VisionRequest,
        link: Link,
        pictures: PictureProcess[Found],
        recorder: FlightRecorder,
        film: CameraFilm | None,
    ) -> None:
        self._request, self._watch, self._film = request, pictures, film
        self._filmed_us = -1
        self._clock = TelemetryClock()
        self._connection = Connection(
            link,
            self._clock,
            recorder,
            identity=(request.system_id or 1, request.component),
            vehicle_system_id=request.system_id,
            signing=client_signing(request.signing_key),
        )
        self._stop = asyncio.Event()
        self._vehicle: int | None = None
        self._received = 0
        self._needed = pictures.REQUESTS[0][0]
        self.stopped = False
        self.reason = ""
        self.figures: dict[str, Any] = {}

    def stop(self) -> None:
        """Request the end of the run."""
        self.stopped = True
        self._stop.set()

    async def run(self, on_progress: OnProgress | None) -> None:
        """Run until the duration is over, the link is silent, there is no video, or the user stops it."""
        request, clock = self._request, self._clock
        stops = [self._connection.listen(name, self._take) for name in self._watch.MESSAGES]
        async with self._connection:
            live = LivePictures(
                request.video,
                now_us=lambda: None if clock.vehicle_time_us is None else clock.stamp_us,
                rate=lambda: clock.rate,
                latency_s=self._watch.camera.latency_s,
                timeout_s=request.silence_s,
            )
            searching = asyncio.get_running_loop().create_task(self._search(live))
            try:
                await self._supervise(live, searching, on_progress)
            finally:
                live.close()
                searching.cancel()
                await asyncio.gather(searching, return_exceptions=True)
                for stop in stops:
                    stop()
        self.figures = {
            "pictures_received": live.received,
            "pictures_dropped": live.dropped,
            "video_breaks": live.breaks,
        }

    async def _supervise(
        self, live: LivePictures, searching: "asyncio.Task[None]", on_progress: OnProgress | None
    ) -> None:
        request, clock = self._request, self._clock
        begun_s = received_s = wall_time_s()
        count, first_us = 0, None
        while not self.stopped:
            self._meet()
            if self._received != count:
                count, received_s = self._received, wall_time_s()
            if first_us is None and clock.vehicle_time_us is not None:
                first_us = clock.time_us
            if searching.done():
                self.reason = str(searching.exception() or "the search of the pictures has ended")
                return
            if wall_time_s() - received_s > request.silence_s:
                self.reason = (
                    f"no {self._watch.NEEDED} was received on {request.connect} for {request.silence_s:g} s; "
                    "is the vehicle on, and sending there?"
                )
                return
            if first_us is None and wall_time_s() - begun_s > 2.0 * request.silence_s:
                self.reason = (
                    f"no time of the vehicle was received on {request.connect}, by which pictures are "
                    "placed; let it send ATTITUDE or SYSTEM_TIME"
                )
                return
            if (
                not live.received
                and first_us is not None
                and wall_time_s() - begun_s > 2.0 * request.silence_s
            ):
                why = f" ({live.failure})" if live.failure else ""
                self.reason = f"no picture was received from {request.video}{why}"
                return
            since_us = 0 if first_us is None else clock.time_us - first_us
            if on_progress is not None:
                on_progress(progress_of(self._watch, since_us, live.failure if live.broken else ""))
            if request.duration_s is not None and since_us >= request.duration_s * 1e6:
                return
            with suppress(TimeoutError):
                await asyncio.wait_for(self._stop.wait(), _LOOK_S)

    def _meet(self) -> None:
        """Take the vehicle's system id, and request its messages, once it is known."""
        if self._vehicle is not None:
            return
        known = self._connection.autopilots_received
        wanted = self._request.system_id
        if wanted is None and known:
            wanted = known[0]
        if wanted in known and wanted is not None:
            self._vehicle = wanted
            self._connection.speak_as(wanted, self._request.component)
            for name, component_id, rate_hz in self._watch.REQUESTS:
                self._connection.send(interval_request(wanted, name, rate_hz, component_id))

    def _take(self, frame: Frame) -> None:
        if self._vehicle in (None, frame.system_id):
            message = read_message(frame)
            self._received += message.name == self._needed
            self._watch.handle(message)

    async def _search(self, live: LivePictures) -> None:
        loop = asyncio.get_running_loop()
        while True:
            exposed_us, picture = await live.next()
            if self._vehicle is None:
                continue
            found = await loop.run_in_executor(None, self._detect, exposed_us, picture)
            for message in self._watch.messages(exposed_us, found):
                with suppress(LinkClosed):
                    self._connection.send(message)

    def _detect(self, exposed_us: int, picture: Picture) -> Found:
        """Search a picture, and keep it."""
        found = self._watch.detect(exposed_us, picture)
        if self._film is not None and exposed_us > self._filmed_us:
            self._filmed_us = exposed_us
            self._film.write(exposed_us, picture)
        return found

    def close(self, film: CameraFilm) -> None:
        """Finish the film."""
        try:
            film.close()
        except VideoError as error:
            self.reason = self.reason or str(error)
