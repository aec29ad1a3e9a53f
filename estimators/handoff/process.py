"""The handoff aircraft's part of a handoff: relative pose, own tracks, comparison, place of the target."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.handoff.aircraft_tracks import AircraftTracks
from estimators.handoff.comparison import TrackComparison, TrackWindows
from estimators.handoff.dead_reckoning import EYE, DeadReckoning, TrackHistory
from estimators.handoff.matching import blended
from estimators.relative_pose.belief import LevelMotion, PoseMeasurement, PoseMode, RelativePoseBelief
from flightsim.foundation.checks import Positive
from flightsim.foundation.options import Options

Array = NDArray[np.float64]

_EARLY_US: Final = 1_000  # a period that is rounded to microseconds may be shorter
_OLD_US: Final = 1_000_000  # windows that end earlier are not compared
_LEAST_HEIGHT_M: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackerReport:
    """What the tracking aircraft reports of one time.

    Attributes:
        tracks: forward and right of its tracks in its level frame, by number.
        number: of the track that is its target; None: it has no track of it.
        identity: probability that this track still is the designated target.
    """

    tracks: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    number: int | None = None
    identity: float = 1.0

    @property
    def target(self) -> tuple[float, float] | None:
        """Forward and right of the target; None: it has no track of it."""
        return None if self.number is None else self.tracks.get(self.number)


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowParameters(Options):
    """The windows that are compared.

    Attributes:
        samples: number of places of a window (paper: 100).
        every_s: time between them.
    """

    samples: int = 100
    every_s: Positive = 0.1

    def check_together(self) -> None:
        if self.samples < 3:
            raise ValueError(f"samples = {self.samples} is not accepted: 3 or more are")

    @property
    def span_s(self) -> float:
        """Time from the oldest place to the newest."""
        return (self.samples - 1) * self.every_s


class HandoffProcess:
    """Everything that the handoff aircraft estimates, step by step.

    Args:
        pose: belief about the relative pose.
        tracks: own tracks; they must be kept for the span of the windows.
        comparison: decides for a track.
        windows: the windows that are compared.
        tracker: motion of the tracking aircraft that is advanced elsewhere; None: `step` advances it.

    Attributes:
        report: the newest report; None: there is none yet.
        converged_us: time at which the relative pose first was converged; None: not yet.
        decided_us: time of the decision.
    """

    def __init__(
        self,
        pose: RelativePoseBelief,
        tracks: AircraftTracks,
        comparison: TrackComparison,
        windows: WindowParameters | None = None,
        tracker: DeadReckoning | None = None,
    ) -> None:
        self.pose = pose
        self.tracks = tracks
        self.comparison = comparison
        self.windows = windows or WindowParameters()
        self.report: TrackerReport | None = None
        self.converged_us: int | None = None
        self.decided_us: int | None = None
        self._tracker = tracker or DeadReckoning()
        self._reported = TrackHistory(1.5 * self.windows.span_s + 1.0)
        self._reported_us = 0
        self._target: Array | None = None  # place of the tracker's target in the frame of its reckoning
        self._time_us: int | None = None
        self._compared_us: int | None = None

    def step(
        self,
        time_us: int,
        own: LevelMotion,
        tracker: LevelMotion,
        report: TrackerReport,
        measured: PoseMeasurement,
        frame: tuple[Array, Array] | None,
        height_m: float,
    ) -> None:
        """Process one time at which everything is known.

        Args:
            time_us: a time later than that of the last step.
            own: motion since then.
            tracker: the same of the tracking aircraft.
            report: of the tracker, of this time.
            measured: range, depth and relative heading.
            frame: places (n, 2) and covariances (n, 2, 2) of moving objects, in the present level frame;
                None: there is no frame of this time.
            height_m: own height over the ground.
        """
        dt_s = 0.0 if self._time_us is None else (time_us - self._time_us) * 1e-6
        self._time_us = time_us
        self.pose.predict(dt_s, own, tracker)
        self.pose.update(measured)
        self.tracks.move(dt_s, own)
        self._tracker.advance(dt_s, tracker)
        self.receive(time_us, report, self._tracker)
        if frame is not None:
            self.tracks.scan(time_us, *frame)
        self.compare(time_us, height_m)

    def receive(self, time_us: int, report: TrackerReport, taken: DeadReckoning) -> None:
        """Process a report.

        Args:
            time_us: time of the report; an older one than the newest is ignored.
            report: the report.
            taken: motion of the tracking aircraft at that time.
        """
        if time_us < self._reported_us:
            return
        self._reported_us, self.report = time_us, report
        places = taken.placed(np.array(list(report.tracks.values()))) if report.tracks else np.zeros((0, 2))
        placed = dict(zip(report.tracks, places, strict=True))
        self._target = None if report.number is None else placed.get(report.number)
        self._reported.add(time_us, taken, [(k, float(x), float(y)) for k, (x, y) in placed.items()])

    def compare(self, time_us: int, height_m: float) -> None:
        """Compare the tracks, if the pose is known and it is time for it.

        Args:
            time_us: present time, to which pose and both motions were moved.
            height_m: own height over the ground; NaN: not known, and nothing is compared.
        """
        best = self.pose.best if self.pose.converged else None
        if best is None or not height_m > _LEAST_HEIGHT_M:
            return
        if self.converged_us is None:
            self.converged_us = time_us
        every_us = round(1e6 * self.windows.every_s)
        if self._compared_us is not None and time_us - self._compared_us < every_us - _EARLY_US:
            return
        self._compared_us = time_us
        if not self.comparison.due(time_us):
            return
        self.comparison.update(self.track_windows(time_us, height_m, best, self.windows), best)
        if self.comparison.decided is not None and self.decided_us is None:
            self.decided_us = time_us

    def track_windows(
        self, time_us: int, height_m: float, best: PoseMode, parameters: WindowParameters
    ) -> TrackWindows:
        """The windows of all tracks at a time.

        Args:
            time_us: present time, to which pose and both motions were moved.
            height_m: own height over the ground.
            best: the relative pose.
            parameters: of the windows; the tracks must be kept for their span.
        """
        end_us = min(self.tracks.time_us, self._reported_us)
        times_us = end_us + round(1e6 * parameters.every_s) * np.arange(1 - parameters.samples, 1)
        if time_us - end_us > _OLD_US:
            times_us = times_us[:0]
        own = self._windows(self.tracks.history, self.tracks.reckoning, times_us)
        reported = self._windows(self._reported, self._tracker, times_us)
        report, none = self.report, np.zeros((0, 2))
        eyes = own.pop(EYE, none), reported.pop(EYE, none)
        target = None if report is None or report.number is None else reported.pop(report.number, None)
        return TrackWindows(
            time_us=time_us,
            times_us=times_us,
            handoff=own,
            target=target,
            eyes=eyes,
            heights_m=(height_m, max(_LEAST_HEIGHT_M, height_m - best.down_m)),
            others=reported,
            identity=1.0 if report is None else report.identity,
            doubtful=self.tracks.doubtful,
        )

    @staticmethod
    def _windows(
        history: TrackHistory, reckoning: DeadReckoning, times_us: NDArray[np.int64]
    ) -> dict[int, Array]:
        """Windows of the tracks that reach over all times, in the present level frame."""
        if not len(times_us):
            return {}
        return {
            number: reckoning.level(window)
            for number in history.numbers
            if (window := history.window(number, times_us)) is not None
        }

    def by_pose(self) -> tuple[float, float] | None:
        """Forward and right of the tracker's target in the present level frame, by report and relative pose;
        None: not known.
        """
        best = self.pose.best if self.pose.converged else None
        if best is None or self._target is None:
            return None
        (place,) = self._tracker.level(self._target[None]).tolist()
        return best.from_tracker(*place)

    def target(self) -> tuple[float, float] | None:
        """Forward and right of the target in the present level frame: by relative pose, by the track after
        the decision, and between them as the score of the best track rises (45); None: not known.
        """
        relative = self.by_pose()
        decided = self.comparison.decided
        if decided is None and (relative is None or not self.comparison.scores):
            return relative
        own = self.tracks.level()
        if decided is not None and decided in own:
            return own[decided]
        scores = {number: score for number, score in self.comparison.scores.items() if number in own}
        if relative is None or not scores:
            return relative
        number = max(scores, key=lambda key: scores[key])
        return blended(own[number], relative, scores[number])
