"""The vision process: pictures of a live stream next to a link, or of a video next to its log, become the
messages of a camera that reads tags.
"""

import asyncio
import math
import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from autopilot_bridge.clock import TelemetryClock, run, unix_time_us
from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.links import VEHICLE_FORMS, Link, ReplayLog, open_link, parse_address
from autopilot_bridge.mavlink import Frame, FrameEncoder, SigningKey
from autopilot_bridge.mavlink.camera_scan import CAMERA_COMPONENTS, CAMERA_SCAN_PAYLOAD
from autopilot_bridge.tlog import TlogReader, TlogWriter
from estimators.errors import EstimatorError, LogError
from estimators.messages import read_message
from estimators.vehicle_time import VehicleTime, stamp_field
from estimators.vision import PictureWatch, TagDetection, TagDetectorParameters, load_camera
from estimators.vision.video import TimedPicture, VideoError, frames_of, is_stream
from missions.errors import LinkClosed
from missions.estimation.picture_source import LivePictures
from missions.estimation.rates import interval_request
from missions.runs.ending import end_signals
from missions.runs.records import FlightRecorder
from missions.runs.run_folder import LOG_NAME, create_run_folder, write_summary
from missions.runs.signing import client_signing
from missions.vehicle.connection import Connection

__all__ = ["COMPLETED", "FAILED", "INTERRUPTED", "VisionProgress", "VisionRequest", "VisionResult", "watch"]

COMPLETED, FAILED, INTERRUPTED = "completed", "failed", "interrupted"
SILENCE_S: Final = 10.0
_AUTOPILOT: Final = 1
_ATTITUDE_HZ: Final = 25.0
_LOOK_S: Final = 0.25
_WATCHED: Final = ("ATTITUDE", "LOCAL_POSITION_NED")


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionRequest:
    """The settings of a vision process.

    Attributes:
        video: address of a stream, or the file of a recording.
        camera: file that describes the camera.
        connect: connection string of the vehicle's link; of a stream.
        log: the vehicle's log; of a recording.
        detector: parameters of the detector.
        system_id: of the vehicle; None: the first autopilot received.
        component_id: of the camera that the process is.
        duration_s: vehicle time since the vehicle was first received; None: until it is stopped.
        silence_s: wall time without a message of the vehicle, or without a first picture, after which the run
            fails.
        out: run folder; None: the next `runs/vision-<n>`.
        command: the command line, for the summary.
        signing_key: shared with the vehicle; None: unsigned.
        on_open: called once the link is open.

    Raises:
        EstimatorError: a value is not possible.
    """

    video: str
    camera: Path
    connect: str | None = None
    log: Path | None = None
    detector: TagDetectorParameters = field(default_factory=TagDetectorParameters)
    system_id: int | None = None
    component_id: int = CAMERA_COMPONENTS[0]
    duration_s: float | None = None
    silence_s: float = SILENCE_S
    out: Path | None = None
    command: str = ""
    signing_key: SigningKey | None = None
    on_open: Callable[[], object] = lambda: None

    def __post_init__(self) -> None:
        if (self.connect is None) == (self.log is None):
            raise EstimatorError("give `connect` for a stream, or `log` for a recording, and not both")
        if is_stream(self.video) != (self.connect is not None):
            needed = "`connect`, the vehicle's link" if is_stream(self.video) else "`log`, the vehicle's log"
            raise EstimatorError(f"the video {self.video} needs {needed}")
        if self.component_id not in CAMERA_COMPONENTS:
            raise EstimatorError(
                f"component id {self.component_id} is not a camera's; "
                f"give {CAMERA_COMPONENTS[0]} to {CAMERA_COMPONENTS[-1]}"
            )
        for name, value in (("duration_s", self.duration_s), ("silence_s", self.silence_s)):
            if value is not None and not 0.0 < value < math.inf:
                raise EstimatorError(f"{name} {value:g} is not accepted; give seconds, above 0")


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionProgress:
    """Progress of the run, for display.

    Attributes:
        time_s: vehicle time since the vehicle was first received, or of the newest picture of a recording.
        frames: number of searched pictures.
        detections: number of detections in them.
        trouble: what is wrong now; "": nothing.
    """

    time_s: float
    frames: int
    detections: int
    trouble: str


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionResult:
    """The result of a run.

    Attributes:
        outcome: `COMPLETED`, `FAILED` or `INTERRUPTED`.
        reason: why it failed; "" otherwise.
        folder: run folder, with flight.tlog and summary.json.
        summary: content of summary.json.
    """

    outcome: str
    reason: str
    folder: Path
    summary: dict[str, Any]


OnProgress = Callable[[VisionProgress], None]


def watch(request: VisionRequest, on_progress: OnProgress | None = None) -> VisionResult:
    """Search the pictures of a video. Blocks until it is done.

    Of a stream, the messages are sent on the link; of a recording, they are put into a copy of its log, in
    place of those that a camera with the same component id has sent in flight. Either way flight.tlog in the
    run folder has what `flightstack replay` needs.

    Raises:
        EstimatorError: the camera's file, the video or the log is of no use.
        PlanError: the run folder can't be made.
        BridgeError: the link can't be opened.
    """
    pictures = PictureWatch(load_camera(request.camera), request.detector)
    begun_s = wall_time_s()
    if request.log is not None:
        folder, outcome, reason, more = _over_log(request, request.log, pictures, on_progress)
    else:
        folder, outcome, reason, more = _live(request, pictures, on_progress)
    difference = pictures.clocks.difference()
    summary: dict[str, Any] = {
        "outcome": outcome,
        "reason": reason,
        "video": request.video,
        "frames": pictures.frames,
        "frames_without_attitude": pictures.without_attitude,
        "detections": sum(pictures.tags.values()),
        "tags": {str(tag): count for tag, count in sorted(pictures.tags.items())},
        "clocks_apart_s": None if difference is None else round(difference.apart_s, 3),
        "warnings": pictures.warnings(),
        **more,
        "wall_time_s": round(wall_time_s() - begun_s, 3),
        "command": request.command,
    }
    write_summary(folder, summary)
    return VisionResult(outcome=outcome, reason=reason, folder=folder, summary=summary)


Ended = tuple[Path, str, str, dict[str, Any]]


# a recording with its log


def _over_log(
    request: VisionRequest, log: Path, pictures: PictureWatch, on_progress: OnProgress | None
) -> Ended:
    """Copy the log, with the messages of the pictures at the times at which they would have been sent."""
    try:
        reader = TlogReader(log)
        system_id = request.system_id or _first_autopilot(reader)
    except LogError as error:
        raise EstimatorError(str(error)) from error
    film = _Recording(request.video, pictures)
    folder = create_run_folder(request.out, "vision")
    encoder = FrameEncoder(system_id, request.component_id)
    times, begin_us = VehicleTime(), None
    with TlogWriter(folder / LOG_NAME) as copy:
        for stamp_us, frame in reader:
            definition = frame.definition
            if (frame.system_id, frame.component_id) == (system_id, _AUTOPILOT) and stamp_field(
                definition.name, definition.field_names
            ) is not None:
                message = read_message(frame)
                now_us = times.stamp(message)
                if begin_us is None:
                    begin_us = now_us
                for exposed_us, found in film.searched(begin_us, now_us):
                    for item in pictures.messages(exposed_us, found):
                        copy.write(stamp_us, encoder.encode(item))
                    if on_progress is not None:
                        on_progress(_progress(pictures, exposed_us))
                pictures.handle(message)
            if not _replaced(frame, system_id, request.component_id):
                copy.write(stamp_us, frame.raw)
    reason = ""
    if not pictures.frames:
        reason = (
            f"no picture of {request.video} lies in the time of {log}: the first one is of "
            f"{film.first_us * 1e-6:.2f} s of vehicle time, and the log begins at "
            f"{(begin_us or 0) * 1e-6:.2f} s; "
            f"correct start_us in {request.camera}"
        )
    more = {"log": str(log), "frames_before_the_log": film.before, "frames_after_the_log": film.rest()}
    return folder, FAILED if reason else COMPLETED, reason, more


class _Recording:
    """The pictures of a recorded video, in step with a log.

    Attributes:
        first_us: vehicle time of the first picture.
        before: number of pictures from before the log's begin.
    """

    def __init__(self, video: str, pictures: PictureWatch) -> None:
        self._pictures = pictures
        self._start_us = pictures.camera.start_us
        self._latency_us = round(pictures.camera.latency_s * 1e6)
        self._frames = frames_of(video)
        first = next(self._frames, None)
        if first is None:
            raise VideoError(f"{video} has no picture in it")
        pictures.check_size(first.pixels)
        self._next: TimedPicture | None = first
        self.first_us = self._start_us + first.time_us
        self.before = 0

    def searched(self, begin_us: int, now_us: int) -> Iterator[tuple[int, tuple[TagDetection, ...]]]:
        """Vehicle times of the exposures, and the tags, of the pictures that are received before a time.

        Args:
            begin_us: of the log; what was received before it is left out.
            now_us: the time.
        """
        while self._next is not None:
            exposed_us = self._start_us + self._next.time_us
            received_us = exposed_us + self._latency_us
            if received_us >= now_us:
                return
            if received_us < begin_us:
                self.before += 1
            else:
                yield exposed_us, self._pictures.detect(exposed_us, self._next.pixels)
            self._next = next(self._frames, None)

    def rest(self) -> int:
        """Number of pictures that were not searched yet."""
        return 0 if self._next is None else 1 + sum(1 for _ in self._frames)


def _first_autopilot(reader: TlogReader) -> int:
    for _, frame in reader:
        if frame.component_id == _AUTOPILOT:
            return frame.system_id
    raise EstimatorError(f"{reader.path} has no message of an autopilot; give the log of a vehicle")


def _replaced(frame: Frame, system_id: int, component_id: int) -> bool:
    """Whether a frame is a detection, or the end of a picture, of the camera that the process stands for."""
    if (frame.system_id, frame.component_id) != (system_id, component_id):
        return False
    name = frame.definition.name
    return name == "LANDING_TARGET" or (
        name == "TUNNEL" and read_message(frame).payload_type == CAMERA_SCAN_PAYLOAD
    )


def _progress(pictures: PictureWatch, time_us: int, trouble: str = "") -> VisionProgress:
    return VisionProgress(
        time_s=time_us * 1e-6, frames=pictures.frames, detections=sum(pictures.tags.values()), trouble=trouble
    )


# a live stream


def _live(request: VisionRequest, pictures: PictureWatch, on_progress: OnProgress | None) -> Ended:
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
        try:
            loop = asyncio.new_event_loop()
            process = _Live(request, link, pictures, recorder)
            for number in end_signals(signal.SIGINT, signal.SIGTERM):
                loop.add_signal_handler(number, process.stop)
            run(process.run(on_progress), loop)
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


class _Live:
    """One run on an open link."""

    def __init__(
        self, request: VisionRequest, link: Link, pictures: PictureWatch, recorder: FlightRecorder
    ) -> None:
        self._request, self._watch = request, pictures
        self._clock = TelemetryClock()
        self._connection = Connection(
            link,
            self._clock,
            recorder,
            identity=(request.system_id or 1, request.component_id),
            vehicle_system_id=request.system_id,
            signing=client_signing(request.signing_key),
        )
        self._stop = asyncio.Event()
        self._vehicle: int | None = None
        self._received = 0
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
        stops = [self._connection.listen(name, self._take) for name in _WATCHED]
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
        begun_s = heard_s = wall_time_s()
        count, first_us = 0, None
        while not self.stopped:
            self._meet()
            if self._received != count:
                count, heard_s = self._received, wall_time_s()
            if first_us is None and clock.vehicle_time_us is not None:
                first_us = clock.time_us
            if searching.done():
                self.reason = str(searching.exception() or "the search of the pictures has ended")
                return
            if wall_time_s() - heard_s > request.silence_s:
                self.reason = (
                    f"no attitude was received on {request.connect} for {request.silence_s:g} s; "
                    "is the vehicle on, and sending there?"
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
                on_progress(_progress(self._watch, since_us, live.failure if live.broken else ""))
            if request.duration_s is not None and since_us >= request.duration_s * 1e6:
                return
            with suppress(TimeoutError):
                await asyncio.wait_for(self._stop.wait(), _LOOK_S)

    def _meet(self) -> None:
        """Take the vehicle's system id, and request its attitude, once it is known."""
        if self._vehicle is not None:
            return
        known = self._connection.autopilots_received
        wanted = self._request.system_id
        if wanted is None and known:
            wanted = known[0]
        if wanted in known and wanted is not None:
            self._vehicle = wanted
            self._connection.speak_as(wanted, self._request.component_id)
            self._connection.send(interval_request(wanted, "ATTITUDE", _ATTITUDE_HZ))

    def _take(self, frame: Frame) -> None:
        if frame.component_id == _AUTOPILOT and self._vehicle in (None, frame.system_id):
            self._received += 1
            self._watch.handle(read_message(frame))

    async def _search(self, live: LivePictures) -> None:
        loop = asyncio.get_running_loop()
        while True:
            exposed_us, picture = await live.next()
            if self._vehicle is None:
                continue
            found = await loop.run_in_executor(None, self._watch.detect, exposed_us, picture)
            for message in self._watch.messages(exposed_us, found):
                with suppress(LinkClosed):
                    self._connection.send(message)
