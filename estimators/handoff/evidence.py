"""Bayesian comparison of tracks: the probability that each is the target, from all pairs of tracks.

The alternative to the paper's thresholds. With e the handoff aircraft's window less the tracker's, which the
relative pose has taken to its level frame, the hypothesis that both are of one target is linear and Gaussian,

    e_n = J_n x + w_n,

with x the error of the pose (position and heading, covariance of the belief) and J_n its derivative at place
n. For two different targets there is also a distance o and a velocity v between them, with wide priors. Both
have a closed evidence (Bishop 2006, "Pattern Recognition and Machine Learning", section 3.5), so a pair has a
Bayes factor. A hypothesis about the target also estimates x; with that x the tracker's other tracks must lie
on other tracks of the handoff aircraft. They add the factors of their best assignment, in which a track may
stay alone with a factor of 1: the pattern of all targets counts, and not the target's place alone.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.handoff.comparison import TrackComparison, TrackWindows
from estimators.relative_pose.belief import PoseMode
from estimators.tracking.association import assign
from flightsim.foundation.checks import check_fields, require_positive, require_probability

Array = NDArray[np.float64]

_POSE: Final = [0, 1, 3]  # forward, right and heading of the pose's covariance


@dataclass(frozen=True, slots=True, kw_only=True)
class EvidenceParameters:
    """Noise and priors of the comparison.

    Attributes:
        sigma_m: standard deviation per axis of the difference of two windows of one target, for places that
            are `sample_s` apart.
        sample_s: time between the places of a window that count.
        pose_sigma_m, pose_sigma_rad: errors of the pose that its covariance does not contain.
        apart_m: standard deviation per axis of the distance of two targets.
        speed_m_s: the same of their relative velocity.
        absent: prior probability that no track is the target.
        decision: probability of a track that is decided for.
        hold_s: time for which it must stay above.
    """

    sigma_m: float = 2.0
    sample_s: float = 1.0
    pose_sigma_m: float = 3.0
    pose_sigma_rad: float = 0.02
    apart_m: float = 60.0
    speed_m_s: float = 2.0
    absent: float = 0.1
    decision: float = 0.99
    hold_s: float = 3.0

    def __post_init__(self) -> None:
        check_fields(
            self, require_positive, but={"absent": require_probability, "decision": require_probability}
        )


class EvidenceComparison(TrackComparison):
    """Probabilities of the tracks from their newest windows.

    Args:
        parameters: noise and priors.
    """

    def __init__(self, parameters: EvidenceParameters | None = None) -> None:
        super().__init__()
        self.parameters = parameters or EvidenceParameters()
        self._scores: dict[int, float] = {}
        self._above: tuple[int, int] | None = None  # track above the decision, and since when

    def update(self, windows: TrackWindows, pose: PoseMode) -> None:
        p = self.parameters
        self._scores = {}
        if windows.target is not None and windows.handoff:
            self._scores = self._probabilities(windows, windows.target, pose)
        best = max(self._scores, key=lambda number: self._scores[number], default=None)
        if best is None or self._scores[best] < p.decision:
            self._above = None
            return
        if self._above is None or self._above[0] != best:
            self._above = (best, windows.time_us)
        if self.decided is None and windows.time_us - self._above[1] >= 1e6 * p.hold_s:
            self.decided = best

    def _probabilities(self, windows: TrackWindows, target: Array, pose: PoseMode) -> dict[int, float]:
        p = self.parameters
        chosen = _sampled(windows.times_us, round(1e6 * p.sample_s))
        times_s = 1e-6 * (windows.times_us[chosen] - windows.time_us).astype(np.float64)
        handoff = {number: window[chosen] for number, window in windows.handoff.items()}
        others = [window[chosen] for window in windows.others.values()]
        prior: Array = pose.covariance[np.ix_(_POSE, _POSE)] + np.diag(
            [p.pose_sigma_m**2, p.pose_sigma_m**2, p.pose_sigma_rad**2]
        )
        nothing, logs = np.zeros(3), {}
        for number, window in handoff.items():
            log, mean, covariance = self._factor(window, target[chosen], pose, nothing, prior, times_s)
            rest = [other for key, other in handoff.items() if key != number]
            logs[number] = log + self._pattern(rest, others, pose, mean, covariance, times_s)
        # the prior of a track: what is left beside `absent`, shared by all
        share = math.log((1.0 - p.absent) / len(logs)) if p.absent < 1.0 else -math.inf
        absent = math.log(p.absent) if p.absent > 0.0 else -math.inf
        highest = max(absent, max(logs.values()) + share)
        values = {number: math.exp(log + share - highest) for number, log in logs.items()}
        total = sum(values.values()) + math.exp(absent - highest)
        return {number: value / total for number, value in values.items()}

    def _pattern(
        self,
        rest: list[Array],
        others: list[Array],
        pose: PoseMode,
        mean: Array,
        covariance: Array,
        times_s: Array,
    ) -> float:
        """Logarithm of the factors of the best assignment of the tracker's other tracks."""
        if not rest or not others:
            return 0.0
        factors = np.zeros((len(others), len(rest) + len(others)))  # the last columns: stays alone
        for i, other in enumerate(others):
            for k, window in enumerate(rest):
                factors[i, k] = self._factor(window, other, pose, mean, covariance, times_s)[0]
        columns = assign(-factors)
        return float(factors[np.arange(len(others)), columns].sum())

    def _factor(
        self, handoff: Array, tracker: Array, pose: PoseMode, mean: Array, covariance: Array, times_s: Array
    ) -> tuple[float, Array, Array]:
        """Logarithm of the Bayes factor of one pair, and the error of the pose if it is one target."""
        p = self.parameters
        c, s = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
        turned = tracker @ np.array([[c, -s], [s, c]])
        off = (handoff - turned - (pose.forward_m, pose.right_m)).T.ravel()  # all forward, then all right
        n = len(handoff)
        design = np.zeros((2 * n, 7))
        design[:n, 0] = design[n:, 1] = 1.0
        design[:n, 2], design[n:, 2] = turned[:, 1], -turned[:, 0]
        design[:n, 3] = design[n:, 4] = 1.0
        design[:n, 5] = design[n:, 6] = times_s
        off -= design[:, :3] @ mean
        wide = np.zeros((7, 7))
        wide[:3, :3] = covariance
        wide[3:, 3:] = np.diag(np.square([p.apart_m, p.apart_m, p.speed_m_s, p.speed_m_s]))
        same, error, left = _log_evidence(off, design[:, :3], covariance, p.sigma_m)
        different, _, _ = _log_evidence(off, design, wide, p.sigma_m)
        return same - different, mean + error, left

    @property
    def scores(self) -> Mapping[int, float]:
        return dict(self._scores)

    def reset(self) -> None:
        self._scores.clear()
        self._above = None
        self.decided = None


def _log_evidence(off: Array, design: Array, prior: Array, sigma: float) -> tuple[float, Array, Array]:
    """log N(off; 0, sigma^2 I + A P A') without the terms that any A and P have in common; mean and
    covariance of the parameters.
    """
    weight = 1.0 / (sigma * sigma)
    information = np.linalg.inv(prior) + weight * design.T @ design
    covariance: Array = np.linalg.inv(information).astype(np.float64)
    vector = weight * design.T @ off
    mean = covariance @ vector
    log = -0.5 * (
        weight * float(off @ off)
        - float(vector @ mean)
        + float(np.linalg.slogdet(prior)[1])
        + float(np.linalg.slogdet(information)[1])
    )
    return log, mean, covariance


def _sampled(times_us: NDArray[np.int64], step_us: int) -> list[int]:
    """Indices of places about one step apart, back from the newest."""
    chosen, last = [], None
    for k in range(len(times_us) - 1, -1, -1):
        if last is None or last - times_us[k] >= step_us:
            chosen.append(k)
            last = times_us[k]
    return chosen[::-1]
