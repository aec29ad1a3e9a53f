"""The scene of a run in progress: what estimators show, for the run folder and a live viewer."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from autopilot_bridge.mavlink import Packet
from estimators.fleet import Fleet
from estimators.scene.of_estimators import EstimatorShows
from estimators.scene.recording import SUFFIX, SceneWriter
from estimators.scene.shown import Shown
from missions.vehicle.connection import Recorder
from missions.view.feed import SceneFeed
from missions.view.viewer import Viewer

__all__ = ["SceneRecorder"]

_LOOK_US: Final = 100_000
_OF_USERS: Final = (
    ArithmeticError,
    AttributeError,
    LookupError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
)
"""What a user's code may raise."""


class SceneRecorder:
    """A recorder that also looks at what is shown, and feeds a viewer.

    It only reads, on the vehicle time of what is recorded: a run has the same bytes with and without it.

    Args:
        recorder: the recorder that stores the frames.
        fleet: the estimators; None: there are none.
        log: the log that the recorder writes; the scene is stored beside it.
        view: an open viewer; None: there is none, or one that draws the run when it is over.
        warn: receives why nothing more is recorded or drawn.
    """

    def __init__(
        self,
        recorder: Recorder,
        fleet: Fleet | None,
        log: Path,
        view: Viewer | None,
        warn: Callable[[str], object],
    ) -> None:
        self._record = recorder.record
        self._acts = recorder.acts
        self._fleet = fleet
        self._feed = SceneFeed(view, log.parent.name) if view is not None and view.live else None
        self._warn = warn
        self._writer = SceneWriter(log.with_suffix(SUFFIX))
        self._estimators = None if fleet is None else EstimatorShows(fleet.name)
        self._look_us = 0
        self._failed = False

    @property
    def acts(self) -> bool:
        """As of the recorder inside."""
        return self._acts

    def record(self, packet: Packet, time_us: int) -> None:
        """Record frames, and look at what is shown."""
        self._record(packet, time_us)
        if self._feed is not None:
            self._feed.packet(packet, time_us)
        if time_us >= self._look_us and not self._failed:
            self._look(time_us)

    def record_truth(self, time_us: int, frame: bytes) -> None:
        """Record a frame of truth."""
        self.record(Packet.of_one(frame), time_us)

    def close(self) -> None:
        """The run is over: look once more, and close the file and the feed."""
        if not self._failed:
            self._look(self._look_us, last=True)
        self._writer.close()
        if self._feed is None:
            return
        self._feed.close()
        if self._feed.failure:
            self._warn(f"the viewer shows nothing from some time on: {self._feed.failure}")
        elif self._feed.dropped:
            self._warn(f"the viewer was slower than the flight: {self._feed.dropped} items were left out")

    def shown(self, time_us: int, *, last: bool) -> list[Shown]:
        """What is new beside the estimators, ten times a second.

        Args:
            time_us: of the run.
            last: the run is over.
        """
        return []

    def _look(self, time_us: int, *, last: bool = False) -> None:
        """Whatever a user's `shown` raises ends this, never the run."""
        try:
            self._look_us = time_us + _LOOK_US
            for one in (*self._of_estimators(), *self.shown(time_us, last=last)):
                self._writer.write(one)
                if self._feed is not None:
                    self._feed.show(one)
        except _OF_USERS as error:
            self._failed = True
            reason = error.strerror if isinstance(error, OSError) else f"{type(error).__name__}: {error}"
            self._warn(f"what the mission and its estimators show is not recorded further: {reason}")

    def _of_estimators(self) -> list[Shown]:
        if self._fleet is None or self._estimators is None:
            return []
        return [
            shown
            for runner in self._fleet.runners.values()
            if runner.tables
            for shown in self._estimators.look_at(runner)
        ]
