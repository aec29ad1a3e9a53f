"""What a vision process is asked for, and what it reports."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Protocol, TypeVar

from autopilot_bridge.mavlink import MAVLinkMessage, SigningKey
from autopilot_bridge.mavlink.components import CAMERA_COMPONENTS, MOVING_POINT_COMPONENT
from estimators.errors import EstimatorError
from estimators.handoff.motion_watch import MotionWatchParameters
from estimators.messages import Message
from estimators.vision import CameraDescription, TagDetectorParameters
from estimators.vision.video import Picture, is_stream
from missions.estimation.options import VisionOptions

Found = TypeVar("Found")


class PictureProcess(Protocol[Found]):
    """Searches the pictures of one camera, and is a component on the vehicle's link. Without I/O.

    Attributes:
        MESSAGES: names of the vehicle's messages that it takes.
        REQUESTS: name, component and rate in Hz of those that it needs.
        NEEDED: the first of these, in words.
        camera: description of the camera.
        frames: number of searched pictures.
    """

    MESSAGES: ClassVar[tuple[str, ...]]
    REQUESTS: ClassVar[tuple[tuple[str, int, float], ...]]
    NEEDED: ClassVar[str]
    camera: CameraDescription
    frames: int

    @property
    def found(self) -> int:
        """Number of detections."""

    def handle(self, message: Message) -> None:
        """Take a message of the vehicle."""

    def detect(self, exposed_us: int, picture: Picture) -> Found:
        """Search a picture."""

    def messages(self, exposed_us: int, found: Found) -> list[MAVLinkMessage]:
        """The messages of a searched picture."""

    def makes(self, message: Message) -> bool:
        """Whether a message is of a kind that it sends."""

    def figures(self) -> dict[str, Any]:
        """Entries of `summary.json`."""

    def warnings(self) -> list[str]:
        """What is wrong with its input."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionRequest(VisionOptions):
    """The settings of a vision process.

    Attributes:
        video: address of a stream, or the file of a recording.
        camera: file that describes the camera.
        connect: connection string of the vehicle's link; of a stream.
        log: the vehicle's log; of a recording.
        detector: parameters of the detector: of tags, or of what moves.
        film: keep the searched pictures of a stream as lossless video in the run folder.
        out: run folder; None: the next `runs/vision-<n>`.
        command: the command line, for the summary.
        signing_key: shared with the vehicle; None: unsigned.
        on_open: called once the link is open.

    Raises:
        EstimatorError, PlanError: a value is not possible.
    """

    video: str
    camera: Path
    connect: str | None = None
    log: Path | None = None
    detector: TagDetectorParameters | MotionWatchParameters = field(default_factory=TagDetectorParameters)
    film: bool = False
    out: Path | None = None
    command: str = ""
    signing_key: SigningKey | None = None
    on_open: Callable[[], object] = lambda: None

    def check_together(self) -> None:
        if (self.connect is None) == (self.log is None):
            raise EstimatorError("give `connect` for a stream, or `log` for a recording, and not both")
        if is_stream(self.video) != (self.connect is not None):
            needed = "`connect`, the vehicle's link" if is_stream(self.video) else "`log`, the vehicle's log"
            raise EstimatorError(f"the video {self.video} needs {needed}")
        if self.rate_hz is not None and self.log is None:
            raise EstimatorError("`rate` is that of a recording; a stream has times")
        if self.film and self.log is not None:
            raise EstimatorError("`film` keeps the pictures of a stream; a recording is there already")
        if self.component_id is not None and self.component_id not in self._components:
            accepted = " to ".join(
                str(number) for number in sorted({self._components[0], self._components[-1]})
            )
            raise EstimatorError(f"component id {self.component_id} is not a camera's; give {accepted}")

    @property
    def _components(self) -> range:
        """The component ids of cameras of this kind."""
        if isinstance(self.detector, TagDetectorParameters):
            return CAMERA_COMPONENTS
        return range(MOVING_POINT_COMPONENT, MOVING_POINT_COMPONENT + 1)

    @property
    def component(self) -> int:
        """The component id."""
        return self._components[0] if self.component_id is None else self.component_id


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

Ended = tuple[Path, str, str, dict[str, Any]]
"""Run folder, outcome, reason, and further entries of the summary."""


def progress_of(pictures: PictureProcess[Any], time_us: int, trouble: str = "") -> VisionProgress:
    """The progress of a run at a time."""
    return VisionProgress(
        time_s=time_us * 1e-6, frames=pictures.frames, detections=pictures.found, trouble=trouble
    )
