"""The handoff aircraft's part of a handoff: relative pose, own tracks, comparison, place of the target."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimators.handoff.aircraft_tracks import AircraftTracks
from estimators.handoff.comparison import TrackComparison, TrackWindows
from estimators.handoff.dead_reckoning import DeadReckoning, TrackHistory
from estimators.handoff.matching import blended
from estimators.relative_pose.belief import LevelMotion, PoseMeasurement, RelativePoseBelief
from flightsim.foundation.checks import require_positive

Array = NDArray[np.float64]

_TARGET = 0  # number of the target in the history of the tracker's tracks; its other tracks follow


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackerReport:
    """What the tracking aircraft reports of one time.

    Attributes:
        motion: its motion.
        target: forward and right of its target in its level frame; None: it has no track of it.
        others: the same of its other tracks, by number from 1.
        identity: probability that the target still is the designated one.
    """

    motion: LevelMotion
    target: tuple[float, float] | None = None
    others: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    identity: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowParameters:
    """The windows that are compared.

    Attributes:
        samples: number of places of a window (paper: 100).
        every_s: time between them.
    """

    samples: int = 100
    every_s: float = 0.1

    def __post_init__(self) -> None:
        require_positive(every_s=self.every_s)
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

    Attributes:
        converged_us: time at which the relative pose first was converged; None: not yet.
        decided_us: time of the decision.
    """

    def __init__(
        self,
        pose: RelativePoseBelief,
        tracks: AircraftTracks,
        comparison: TrackComparison,
        windows: WindowParameters | None = None,
    ) -> None:
        self.pose = pose
        self.tracks = tracks
        self.comparison = comparison
        self.windows = windows or WindowParameters()
        self.converged_us: int | None = None
        self.decided_us: int | None = None
        self._tracker = DeadReckoning()
        self._reported = TrackHistory(1.5 * self.windows.span_s + 1.0)
        self._report: TrackerReport | None = None
        self._time_us: int | None = None
        self._compared_us: int | None = None

    def step(
        self,
        time_us: int,
        own: LevelMotion,
        report: TrackerReport,
        measured: PoseMeasurement,
        frame: tuple[Array, Array] | None,
    ) -> None:
        """Process one time.

        Args:
            time_us: a time later than that of the last step.
            own: motion since then.
            report: of the tracker, of this time.
            measured: range, depth and relative heading.
            frame: places (n, 2) and covariances (n, 2, 2) of moving objects, in the present level frame;
                None: there is no frame of this time.
        """
        dt_s = 0.0 if self._time_us is None else (time_us - self._time_us) * 1e-6
        self._time_us, self._report = time_us, report
        self.pose.predict(dt_s, own, report.motion)
        self.pose.update(measured)
        self.tracks.move(dt_s, own)
        self._tracker.advance(dt_s, report.motion)
        if report.target is not None:
            seen = {_TARGET: report.target, **report.others}
            places = self._tracker.placed(np.array(list(seen.values()))).tolist()
            self._reported.add(time_us, [(k, *place) for k, place in zip(seen, places, strict=True)])
        if frame is not None:
            self.tracks.scan(time_us, *frame)
        if self.pose.converged and self.converged_us is None:
            self.converged_us = time_us
        every_us = round(1e6 * self.windows.every_s)
        if self.pose.converged and (self._compared_us is None or time_us - self._compared_us >= every_us):
            self._compare(time_us, every_us)

    def _compare(self, time_us: int, every_us: int) -> None:
        best = self.pose.best
        assert best is not None  # converged
        self._compared_us = time_us
        times_us = time_us + every_us * np.arange(1 - self.windows.samples, 1)
        own = {
            number: self.tracks.reckoning.level(window)
            for number in self.tracks.places
            if (window := self.tracks.history.window(number, times_us)) is not None
        }
        reported = {
            number: self._tracker.level(window)
            for number in self._reported.numbers
            if (window := self._reported.window(number, times_us)) is not None
        }
        target = reported.pop(_TARGET, None)
        self.comparison.update(
            TrackWindows(
                time_us=time_us,
                times_us=times_us,
                handoff=own,
                target=target,
                others=reported,
                identity=1.0 if self._report is None else self._report.identity,
            ),
            best,
        )
        if self.comparison.decided is not None and self.decided_us is None:
            self.decided_us = time_us

    def target(self) -> tuple[float, float] | None:
        """Forward and right of the target in the present level frame: by relative pose, by the track after
        the decision, and between them as the score of the best track rises (45); None: not known.
        """
        best = self.pose.best
        relative = None
        if self.pose.converged and best is not None and self._report is not None and self._report.target:
            relative = best.from_tracker(*self._report.target)
        own = self.tracks.level()
        decided = self.comparison.decided
        if decided is not None and decided in own:
            return own[decided]
        scores = {number: score for number, score in self.comparison.scores.items() if number in own}
        if relative is None or not scores:
            return relative
        number = max(scores, key=lambda key: scores[key])
        return blended(own[number], relative, scores[number])
