"""One trial of the study `handoff`: two aircraft fly until a track is decided for, or for 15 minutes."""

import math
from collections import deque
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.handoff.aircraft_tracks import AircraftTracks
from estimators.handoff.comparison import TrackComparison
from estimators.handoff.evidence import EvidenceComparison
from estimators.handoff.matching import MatchComparison, MatchingParameters, Residual
from estimators.handoff.process import HandoffProcess, TrackerReport, WindowParameters
from estimators.relative_pose import (
    GaussianBank,
    LevelMotion,
    ParticlePose,
    RelativePoseBelief,
    RelativePoseParameters,
)
from estimators.tracking.metrics import nees
from estimators.tracking.recursive_ransac import RansacParameters, RecursiveRansac
from flightsim.foundation.random_streams import RandomStreams
from missions.planning.orbit_guidance import OrbitGuidance, OrbitParameters
from missions.studies.handoff_pixels import PixelWorld
from missions.studies.handoff_tracker import SEARCH_ROLL_RAD, Tracker, orbit_roll
from missions.studies.handoff_world import HandoffSetting, HandoffWorld, targets_of
from missions.studies.handoff_worlds import HANDOFF_WORLDS
from missions.studies.options import TIMEOUT_S, Operator, PoseBelief
from missions.studies.worlds import NOMINAL

Array = NDArray[np.float64]
Early = tuple[float, bool]
"""Score of a track, and whether it is of the tracked target."""

_EVERY_S: Final = 0.1  # between two samples of a window
_HEADING_BIAS_RAD: Final = 0.06  # calibrated magnetometers keep a few degrees of hard iron and misalignment
_JUDGED_US: Final = 1_000_000
_DETECTED: Final = 0.8  # what the trackers expect, whatever the distance


class Comparison(StrEnum):
    """What decides."""

    PAPER = "paper"  # equations 44 to 47, T_r limits the Frobenius norm
    RMS = "rms"  # the same, T_r limits the root mean square
    EVIDENCE = "evidence"


@dataclass(frozen=True, slots=True, kw_only=True)
class HandoffCell:
    """Parameters of a trial.

    Attributes:
        operator: who designates the target.
        world: name of the true world (`HANDOFF_WORLDS`); the estimators have the parameters of the nominal
            one.
        comparison: what decides.
        window: samples of the windows (paper: 100).
        residual_m: T_r (paper: 15 m); without effect on the evidence.
        belief: what estimates the relative pose.
    """

    operator: str = Operator.ONCE.value
    world: str = NOMINAL
    comparison: str = Comparison.EVIDENCE.value
    window: int = 100
    residual_m: float = 15.0
    belief: str = PoseBelief.GAUSSIANS.value


@dataclass(frozen=True, slots=True, kw_only=True)
class Handoff:
    """Outcome of a trial.

    Attributes:
        decided, correct, wrong, timeout: a track was decided for; it is the tracked target; it is not; none
            was within 15 minutes.
        time_s: time of the decision since the start.
        converged_s: time at which the relative pose first was converged.
        score: of the track that was decided for: gamma, or its probability.
        early_score: of the best track at the first comparison of complete windows.
        early_correct: whether that track was of the tracked target.
        track_error_m: distance from it to the tracked target.
        tracker_error_m: distance from the place that the tracker reports to the target.
        resets: times that the belief about the pose started anew.
        designations: times that the tracker's operator designated the target.
        requests: times that the operator was asked; 0 of the one who watches.
        pose_nees: mean of the normalized squared error of the tracker's place by the converged pose, once a
            second; consistent at 2. None: it never converged.
        cause: of a failure.
    """

    decided: bool
    correct: bool
    wrong: bool
    timeout: bool
    time_s: float | None
    converged_s: float | None
    score: float | None
    early_score: float | None
    early_correct: bool | None
    track_error_m: float | None
    tracker_error_m: float | None
    resets: int
    designations: int
    requests: int
    pose_nees: float | None
    cause: str


class TrialFlight:
    """Both aircraft of a trial, in opposite orbits: the relative pose is easiest to observe in them.

    Args:
        world: the truth, and the measurements of it.
        tracks: of the tracker.
        operator: of the tracker.
        seed: of its operator.
        process: of the handoff aircraft.

    Attributes:
        world, process: as given.
        tracker: the tracking aircraft.
        report: its newest report.
        pose_nees: normalized squared errors of the place of the converged pose, once a second.
    """

    def __init__(
        self,
        world: HandoffWorld,
        tracks: AircraftTracks,
        process: HandoffProcess,
        operator: Operator,
        seed: int,
    ) -> None:
        self.world, self.process = world, process
        pilots = [
            OrbitGuidance(OrbitParameters(radius_m=world.setting.radius_m, direction=d)) for d in (1, -1)
        ]
        person = RandomStreams(seed).generator("handoff", "operator")
        self.tracker = Tracker(world, tracks, operator, pilots[0], person)
        self.report = TrackerReport()
        self.pose_nees: list[float] = []
        self._pilot = pilots[1]
        self._rolls = (0.0, 0.0)
        # what the tracker has sent, as old as its clock makes it; the newest last
        late = round(world.setting.clock_s * world.setting.rate_hz)
        self._sent: deque[tuple[LevelMotion, TrackerReport]] = deque(maxlen=late + 1)

    def step(self) -> None:
        """Advance by one period of the rate."""
        world, process = self.world, self.process
        world.advance(self._rolls)
        self._sent.append(self.tracker.step())
        motion, self.report = self._sent[0]
        pointing = process.target()
        frame = None if pointing is None else world.frame(HandoffWorld.HANDOFF, pointing)
        own = world.motion(HandoffWorld.HANDOFF)
        process.step(
            world.time_us,
            own,
            motion,
            self.report,
            world.measured(),
            None if frame is None else (frame.places, frame.covariances),
            world.setting.heights_m[HandoffWorld.HANDOFF],
        )
        if world.time_us % _JUDGED_US == 0:
            self._judge_pose()
        target = process.target()
        self._rolls = (
            self.tracker.roll_rad,
            SEARCH_ROLL_RAD
            if target is None
            else orbit_roll(
                self._pilot,
                world.time_us,
                target,
                (own.forward_m_s, own.right_m_s),  # equation 34
                world.roll_rad(HandoffWorld.HANDOFF),
            ),
        )

    def _judge_pose(self) -> None:
        best = self.process.pose.best if self.process.pose.converged else None
        if best is not None:
            off = (best.forward_m, best.right_m) - self.world.tracker_from_handoff()
            self.pose_nees.append(float(nees(off, best.covariance[:2, :2])))

    def best(self, comparison: TrackComparison) -> Early | None:
        """Score of the best track, and whether it is of the tracked target; None: no track has one."""
        scores = comparison.scores
        if not scores:
            return None
        number = max(scores, key=lambda key: scores[key])
        return scores[number], self.target_of(HandoffWorld.HANDOFF, number) == 0

    def target_of(self, which: int, number: int | None) -> int | None:
        """The true target of a track of an aircraft; None: it is of none."""
        tracks = self.process.tracks if which == HandoffWorld.HANDOFF else self.tracker.tracks
        found = targets_of(tracks.level(), self.world.apparent(which))
        return None if number is None else found.get(number)


@dataclass(frozen=True, slots=True, kw_only=True)
class HandoffTrial:
    """The trial: a function of its cell and its seed.

    Args:
        setting: targets, aircraft and sensors of the nominal world.
        timeout_s: time without a decision that is a failure.
        pixels: frames are rendered and searched (`PixelWorld`).
    """

    setting: HandoffSetting = field(default_factory=HandoffSetting)
    timeout_s: float = TIMEOUT_S
    pixels: bool = False

    def __call__(self, cell: HandoffCell, seed: int) -> Handoff:
        comparison = comparison_of(cell)
        flight = self.flight(cell, seed, comparison)
        early: Early | None = None
        while flight.world.time_us < 1e6 * self.timeout_s and comparison.decided is None:
            flight.step()
            early = early or flight.best(comparison)
        return outcome_of(flight, comparison, early)

    def flight(
        self, cell: HandoffCell, seed: int, comparison: TrackComparison, world: HandoffWorld | None = None
    ) -> TrialFlight:
        """The flight at its start, with the windows of a cell; `world` None: that of the cell."""
        windows = WindowParameters(samples=cell.window, every_s=max(_EVERY_S, 1.0 / self.setting.rate_hz))
        keep_s = 1.5 * windows.span_s + 1.0
        tracks = [AircraftTracks(self._ransac(seed, which), keep_s) for which in range(2)]
        process = HandoffProcess(self._belief(cell, seed), tracks[1], comparison, windows)
        return TrialFlight(
            world or self._world(cell, seed), tracks[0], process, Operator(cell.operator), seed
        )

    def _world(self, cell: HandoffCell, seed: int) -> HandoffWorld:
        true = HANDOFF_WORLDS[cell.world].setting.over(self.setting)
        if not self.pixels:
            return HandoffWorld(true, seed)

        return PixelWorld(true, seed)

    def _ransac(self, seed: int, which: int) -> RecursiveRansac:
        s = self.setting
        rate = s.rate_hz
        return RecursiveRansac(
            RansacParameters(
                noise_density=0.5,
                gate_squared=13.8,
                clutter_per_m2=max(s.false_points, 0.1) / 40_000.0,
                window=round(2.0 * rate),
                good_age=round(1.0 * rate),
                lost_after=round(4.0 * rate),
                inlier_m=4.0,
                speed_max_m_s=2.0 * s.walk_m_s[1] + 1.5 * s.wind_m_s + 2.0,
                seed_support=round(0.6 * rate),
                detected=_DETECTED,
                seed=2 * seed + which,
            )
        )

    def _belief(self, cell: HandoffCell, seed: int) -> RelativePoseBelief:
        s = self.setting
        parameters = RelativePoseParameters(
            range_sigma_m=s.range_sigma_m,
            height_sigma_m=math.sqrt(2.0) * s.height_sigma_m,
            heading_sigma_rad=math.sqrt(2.0) * s.heading_sigma_rad,
            heading_bias_rad=_HEADING_BIAS_RAD,
            seed=seed,
        )
        return (
            ParticlePose(parameters)
            if PoseBelief(cell.belief) is PoseBelief.PARTICLES
            else GaussianBank(parameters)
        )


def comparison_of(cell: HandoffCell) -> TrackComparison:
    """What decides."""
    kind = Comparison(cell.comparison)
    if kind is Comparison.EVIDENCE:
        return EvidenceComparison()
    residual = Residual.FROBENIUS if kind is Comparison.PAPER else Residual.RMS
    return MatchComparison(MatchingParameters(residual=residual, residual_m=cell.residual_m))


def outcome_of(flight: TrialFlight, comparison: TrackComparison, early: Early | None) -> Handoff:
    """The outcome, when a comparison has just decided, or time is over.

    Args:
        flight: the flight at this time.
        comparison: what decides.
        early: score of the best track at the first comparison, and whether it was right.
    """
    world, process, report = flight.world, flight.process, flight.report
    number = comparison.decided
    track_error_m = tracker_error_m = score = None
    correct, cause = False, "" if process.converged_us is not None else "pose never converged"
    if report.target is not None:
        true = world.seen_from(HandoffWorld.TRACKER, world.targets[:1])[0]
        tracker_error_m = math.dist(true, report.target)
        if flight.target_of(HandoffWorld.TRACKER, report.number) != 0:
            mistaken = flight.tracker.person.mistaken
            cause = "operator pointed at another target" if mistaken else "tracker on another target"
    if number is not None:
        score = comparison.scores.get(number)
        target = flight.target_of(HandoffWorld.HANDOFF, number)
        place = process.tracks.level().get(number)
        if place is not None:
            true = world.seen_from(HandoffWorld.HANDOFF, world.targets[:1])[0]
            track_error_m = math.dist(true, place)
        correct = target == 0
        if correct:
            cause = ""
        elif not cause:
            cause = "a track of no target" if target is None else "another target"
    elif not cause:
        cause = "no decision"
    return Handoff(
        decided=number is not None,
        correct=correct,
        wrong=number is not None and not correct,
        timeout=number is None,
        time_s=None if number is None else world.time_us * 1e-6,
        converged_s=None if process.converged_us is None else process.converged_us * 1e-6,
        score=score,
        early_score=None if early is None else early[0],
        early_correct=None if early is None else early[1],
        track_error_m=track_error_m,
        tracker_error_m=tracker_error_m,
        resets=process.pose.resets,
        designations=flight.tracker.designation.count,
        requests=flight.tracker.person.asked,
        pose_nees=float(np.mean(flight.pose_nees)) if flight.pose_nees else None,
        cause=cause,
    )
