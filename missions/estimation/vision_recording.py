"""The vision process over a recorded video: its log is copied, with the messages of the pictures."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Generic

from autopilot_bridge.mavlink import FrameEncoder
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.tlog import TlogReader, TlogWriter
from estimators.errors import EstimatorError, VideoError
from estimators.messages import read_message
from estimators.reports.summary import COMPLETED, FAILED
from estimators.vehicle_time import VehicleTime, stamp_field
from estimators.vision.video import TimedPicture, frames_of
from missions.estimation.vision_request import (
    Ended,
    Found,
    OnProgress,
    PictureProcess,
    VisionRequest,
    progress_of,
)
from missions.flown.run_folder import LOG_NAME, create_run_folder

__all__ = ["over_log"]


def over_log(
    request: VisionRequest, log: Path, pictures: PictureProcess[Any], on_progress: OnProgress | None
) -> Ended:
    """Copy the log, with the messages of the pictures at the times at which they would have been sent."""
    reader = TlogReader(log)
    system_id = request.system_id or _first_autopilot(reader)
    film = _Recording(request.video, pictures, request.rate_hz)
    folder = create_run_folder(request.out, "vision")
    own = (system_id, request.component)
    encoder = FrameEncoder(*own)
    times, begin_us = VehicleTime(), None
    with TlogWriter(folder / LOG_NAME) as copy:
        for stamp_us, frame in reader:
            definition, sender = frame.definition, (frame.system_id, frame.component_id)
            if (
                sender == (system_id, AUTOPILOT_COMPONENT)
                and stamp_field(definition.name, definition.field_names) is not None
            ):
                now_us = times.stamp(read_message(frame))
                if begin_us is None:
                    begin_us = now_us
                for exposed_us, found in film.searched(begin_us, now_us):
                    for item in pictures.messages(exposed_us, found):
                        copy.write(stamp_us, encoder.encode(item))
                    if on_progress is not None:
                        on_progress(progress_of(pictures, exposed_us))
            if frame.system_id == system_id and definition.name in pictures.MESSAGES:
                pictures.handle(read_message(frame))
            if sender != own or not pictures.makes(read_message(frame)):
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


class _Recording(Generic[Found]):
    """The pictures of a recorded video, in step with a log.

    Attributes:
        first_us: vehicle time of the first picture.
        before: number of pictures from before the log's begin.
    """

    def __init__(self, video: str, pictures: PictureProcess[Found], rate_hz: float | None) -> None:
        self._pictures = pictures
        self._latency_us = round(pictures.camera.latency_s * 1e6)
        self._frames = frames_of(video, rate_hz=rate_hz)
        first = next(self._frames, None)
        if first is None:
            raise VideoError(f"{video} has no picture in it")
        pictures.camera.geometry.check_size(first.pixels)
        self._next: TimedPicture | None = first
        self.first_us = pictures.camera.start_us
        # the times of a video may begin anywhere: cut files, and cameras that count from their boot
        self._offset_us = self.first_us - first.time_us
        self.before = 0

    def searched(self, begin_us: int, now_us: int) -> Iterator[tuple[int, Found]]:
        """Vehicle times of the exposures, and what was found, of the pictures that are received before a
        time.

        Args:
            begin_us: of the log; what was received before it is left out.
            now_us: the time.
        """
        while self._next is not None:
            exposed_us = self._offset_us + self._next.time_us
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
        if frame.component_id == AUTOPILOT_COMPONENT:
            return frame.system_id
    raise EstimatorError(f"{reader.path} has no message of an autopilot; give the log of a vehicle")
