"""Bayesian comparison of tracks: the probability that each is the target, from all pairs of tracks.

The alternative to the paper's thresholds. With e the handoff aircraft's window less the tracker's, which the
relative pose has taken to its level frame, the hypothesis that both are of one target is linear and Gaussian,

    e_n = J_n x + w_n,

with x the error that all pairs have in common (place and heading of the pose, drift between both dead
reckonings) and J_n its derivative at place n. w_n has a white part and one that changes slowly: errors of
roll and pitch, which move a track for seconds. For two different targets there is also a distance and a
velocity between them, with wide priors. Both have a closed evidence (Bishop 2006, "Pattern Recognition and
Machine Learning", section 3.5), so a pair has a Bayes factor.

A hypothesis says which track is the target, or that none is. Under each the tracker's other tracks are
joined to other tracks of the handoff aircraft, the best pair first, each pair with the x that the pairs
before it leave, as long as its factor is above 1: the pattern of all targets counts, for "none" too. The
pose's prior is a mixture: a belief that has converged to a wrong place is improbable, and not impossible.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.handoff.comparison import TrackComparison, TrackWindows
from estimators.relative_pose.belief import PoseMode
from flightsim.foundation.checks import check_fields, require_positive, require_probability

Array = NDArray[np.float64]

_POSE: Final = [0, 1, 3]  # forward, right and heading of the pose's covariance
_PLACE, _DRIFT = slice(0, 2), slice(3, 5)  # parts of x; its third element is the heading


@dataclass(frozen=True, slots=True, kw_only=True)
class EvidenceParameters:
    """Noise and priors of the comparison.

    Attributes:
        every_s: time between comparisons.
        sample_s: time between the places of a window that count.
        sigma_m: standard deviation per axis of the white part of the difference of two windows of one target.
        slow_sigma_m, slow_s: standard deviation per axis of its slow part, and the correlation time. An
            error of 0.012 rad of roll or pitch moves a place by 3 m in the study.
        pose_sigma_m, pose_sigma_rad: errors of the pose that its covariance does not contain.
        drift_m_s: standard deviation per axis of the velocity between both dead reckonings.
        wrong: prior probability that the pose has converged to a wrong place.
        wrong_sigma_m, wrong_sigma_rad: errors of such a pose.
        apart_m: standard deviation per axis of the distance of two targets.
        speed_m_s: the same of their relative velocity.
        absent: prior probability that no track is the target.
        decision: probability of a track that is decided for.
        hold_s: time for which it must stay above.
    """

    every_s: float = 0.5
    sample_s: float = 1.0
    sigma_m: float = 1.0
    slow_sigma_m: float = 4.0
    slow_s: float = 5.0
    pose_sigma_m: float = 3.0
    pose_sigma_rad: float = 0.02
    drift_m_s: float = 0.3
    wrong: float = 0.05
    wrong_sigma_m: float = 40.0
    wrong_sigma_rad: float = 0.1
    apart_m: float = 60.0
    speed_m_s: float = 2.0
    absent: float = 0.1
    decision: float = 0.99
    hold_s: float = 3.0

    def __post_init__(self) -> None:
        shares = ("absent", "decision", "wrong")
        check_fields(self, require_positive, but=dict.fromkeys(shares, require_probability))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Common:
    """What is known of x.

    Attributes:
        mean: (5,) forward, right, heading, and the two components of the drift.
        covariance: (5, 5).
    """

    mean: Array
    covariance: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Pairs:
    """Differences of all pairs of windows, of which the noise has been made white.

    Attributes:
        off: (tracker's windows, handoff's windows, 2 n); the tracker's first window is the target's.
        design: (tracker's windows, 2 n, 5).
    """

    off: Array
    design: Array


class EvidenceComparison(TrackComparison):
    """Probabilities of the tracks from their newest windows.

    Args:
        parameters: noise and priors.
    """

    def __init__(self, parameters: EvidenceParameters | None = None) -> None:
        super().__init__()
        p = self.parameters = parameters or EvidenceParameters()
        self._scores: dict[int, float] = {}
        self._above: tuple[int, int] | None = None  # track above the decision, and since when
        self._compared_us: int | None = None
        self._wide = np.diag(np.square([p.apart_m, p.apart_m, 0.0, p.speed_m_s, p.speed_m_s]))

    def update(self, windows: TrackWindows, pose: PoseMode) -> None:
        p = self.parameters
        if self._compared_us is not None and 0 <= windows.time_us - self._compared_us < 1e6 * p.every_s:
            return
        self._compared_us = windows.time_us
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
        pairs = self._pairs(windows, target, pose)
        numbers = list(windows.handoff)
        narrow: Array = pose.covariance[np.ix_(_POSE, _POSE)] + np.diag(
            np.square([p.pose_sigma_m, p.pose_sigma_m, p.pose_sigma_rad])
        )
        wrong = np.diag(np.square([p.wrong_sigma_m, p.wrong_sigma_m, p.wrong_sigma_rad]))
        priors = ((1.0 - p.wrong, narrow), (p.wrong, narrow + wrong))
        logs = np.array([self._hypotheses(pairs, covariance) + _log(weight) for weight, covariance in priors])
        # the prior of a track: what is left beside `absent`, shared by all
        logs[:, :-1] += _log((1.0 - p.absent) / len(numbers))
        logs[:, -1] += _log(p.absent)
        shares = np.exp(logs - logs.max()).sum(axis=0)
        shares *= windows.identity / shares.sum()
        return dict(zip(numbers, shares[:-1].tolist(), strict=True))

    def _pairs(self, windows: TrackWindows, target: Array, pose: PoseMode) -> _Pairs:
        p = self.parameters
        chosen = _sampled(windows.times_us, round(1e6 * p.sample_s))
        times_s = 1e-6 * (windows.times_us[chosen] - windows.time_us).astype(np.float64)
        apart_s = np.abs(times_s[:, None] - times_s)
        noise = p.slow_sigma_m**2 * np.exp(-apart_s / p.slow_s) + p.sigma_m**2 * np.eye(len(chosen))
        white = np.linalg.inv(np.linalg.cholesky(noise))
        c, s = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
        tracker = np.array([target, *windows.others.values()])[:, chosen]
        turned = tracker @ np.array([[c, -s], [s, c]])
        handoff = np.array(list(windows.handoff.values()))[:, chosen]
        off = handoff - turned[:, None] - (pose.forward_m, pose.right_m)
        n = len(chosen)
        design = np.zeros((len(tracker), n, 2, 5))
        design[:, :, 0, 0] = design[:, :, 1, 1] = 1.0
        design[:, :, 0, 2], design[:, :, 1, 2] = turned[:, :, 1], -turned[:, :, 0]
        design[:, :, 0, 3] = design[:, :, 1, 4] = times_s
        return _Pairs(
            off=np.einsum("mn,jkna->jkma", white, off).reshape(*off.shape[:2], 2 * n),
            design=np.einsum("mn,jnax->jmax", white, design).reshape(len(tracker), 2 * n, 5),
        )

    def _hypotheses(self, pairs: _Pairs, pose: Array) -> Array:
        """Logarithm of the evidence that each track of the handoff aircraft is the target, and, last, that
        none is; over that of all tracks being of different targets.
        """
        prior = np.zeros((5, 5))
        prior[:3, :3] = pose
        prior[_DRIFT, _DRIFT] = self.parameters.drift_m_s**2 * np.eye(2)
        nothing = _Common(mean=np.zeros(5), covariance=prior)
        others, tracks = list(range(1, pairs.off.shape[0])), list(range(pairs.off.shape[1]))
        first = self._factors(pairs, [0], tracks, nothing)[0]
        logs = [
            float(first[k])
            + self._pattern(pairs, others, [j for j in tracks if j != k], self._joined(pairs, 0, k, nothing))
            for k in tracks
        ]
        return np.array([*logs, self._pattern(pairs, others, tracks, nothing)])

    def _pattern(self, pairs: _Pairs, others: list[int], tracks: list[int], common: _Common) -> float:
        """Logarithm of the factors of the other pairs, the best one first."""
        total, others, tracks = 0.0, list(others), list(tracks)
        while others and tracks:
            factors = self._factors(pairs, others, tracks, common)
            i, k = divmod(int(np.argmax(factors)), len(tracks))
            if factors[i, k] <= 0.0:
                break
            total += float(factors[i, k])
            common = self._joined(pairs, others.pop(i), tracks.pop(k), common)
        return total

    def _factors(self, pairs: _Pairs, others: list[int], tracks: list[int], common: _Common) -> Array:
        """(others, tracks) logarithms of the Bayes factors."""
        design = pairs.design[others]
        off = pairs.off[np.ix_(others, tracks)] - (design @ common.mean)[:, None]
        same = _log_evidence(off, design, common.covariance)
        return same - _log_evidence(off, design, common.covariance + self._wide)

    def _joined(self, pairs: _Pairs, other: int, track: int, common: _Common) -> _Common:
        """x if two windows are of one target."""
        design = pairs.design[other]
        off = pairs.off[other, track] - design @ common.mean
        covariance = np.linalg.inv(np.linalg.inv(common.covariance) + design.T @ design)
        return _Common(mean=common.mean + covariance @ design.T @ off, covariance=covariance)

    @property
    def scores(self) -> Mapping[int, float]:
        return dict(self._scores)

    def reset(self) -> None:
        self._scores.clear()
        self._above = self._compared_us = None
        self.decided = None


def _log_evidence(off: Array, design: Array, prior: Array) -> Array:
    """log N(off; 0, I + A P A') without the terms that any A and P have in common.

    Args:
        off: (m, k, 2 n).
        design: (m, 2 n, 5), A.
        prior: (5, 5), P.
    """
    information = np.linalg.inv(prior) + design.transpose(0, 2, 1) @ design
    vector = off @ design
    explained = (vector @ np.linalg.inv(information) * vector).sum(axis=-1)
    spread = np.linalg.slogdet(information)[1] + np.linalg.slogdet(prior)[1]
    found: Array = -0.5 * ((off * off).sum(axis=-1) - explained + spread[:, None])
    return found


def _log(probability: float) -> float:
    return math.log(probability) if probability > 0.0 else -math.inf


def _sampled(times_us: NDArray[np.int64], step_us: int) -> list[int]:
    """Indices of places about one step apart, back from the newest."""
    chosen, last = [], None
    for k in range(len(times_us) - 1, -1, -1):
        if last is None or last - times_us[k] >= step_us:
            chosen.append(k)
            last = times_us[k]
    return chosen[::-1]
