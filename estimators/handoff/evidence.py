"""Bayesian comparison of tracks: the probability that each is the target, from the pattern of all tracks.

The alternative to the paper's thresholds. With e the handoff aircraft's window less the tracker's, which the
relative pose has taken to its level frame, the hypothesis that both are of one target is linear and Gaussian,

    e_n = J_n x + M_n u_n + w_n.

x and u are what all pairs of tracks have in common. x has the error of the pose, the drift between both dead
reckonings and the errors of both heights; u has those of roll and pitch of both aircraft, which change within
seconds and move a place at the horizontal distance r from an aircraft of height h by M = h + r r'/h. w is
each pair's own noise, with a white part and a slow one. So an aircraft sees all tracks too far to the same
side, and their pattern counts.

A hypothesis joins some of the tracker's tracks to different tracks of the handoff aircraft; the others of the
tracker are not seen by it, and its own others are of targets that the tracker does not see. All hypotheses
are summed over (Reid 1979, "An algorithm for tracking multiple targets"), each with the joint density of its
pairs (Bishop 2006, "Pattern Recognition and Machine Learning", section 2.3). The target may be seen by none.
The pose may have converged to a wrong place, and the noise may be larger than thought: both are mixtures.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import combinations, permutations
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.handoff.comparison import TrackComparison, TrackWindows
from estimators.relative_pose.belief import PoseMode
from flightsim.foundation.checks import Positive, Share
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_POSE: Final = [0, 1, 3]  # forward, right and heading of the pose's covariance
_TRACKER_TRACKS: Final = 4  # the target and the nearest others
_HANDOFF_TRACKS: Final = 7  # the nearest to the target


@dataclass(frozen=True, slots=True, kw_only=True)
class EvidenceParameters(Options):
    """Noise and priors of the comparison.

    Attributes:
        every_s: time between comparisons.
        sample_s: time between the places of a window that count.
        sigma_m: standard deviation per axis of the white part of the difference of two windows of one target.
        slow_sigma_m, slow_s: standard deviation per axis of its slow part, and the correlation time.
        tilt_sigma_rad, tilt_s: errors of roll and of pitch of each aircraft, and their correlation time.
        height_sigma_m: errors of the heights over the ground.
        pose_sigma_m, pose_sigma_rad: errors of the pose that its covariance does not contain.
        drift_m_s: standard deviation per axis of the velocity between both dead reckonings.
        wrong: prior probability that the pose has converged to a wrong place.
        wrong_sigma_m, wrong_sigma_rad: errors of such a pose.
        rough, rough_scale: prior probability that the noise of the pairs is larger, and how many times.
        apart_m: standard deviation per axis of the distance of another target from this one.
        speed_m_s, turn_s: the same of its relative velocity, and the correlation time.
        seen: prior probability that the handoff aircraft has a track of a target that the tracker tracks.
        free: mean number of tracks of other targets.
        unforeseen: probability that the comparison is wrong for a reason that the model does not have,
            whatever the tracks show (docs/handoff.md).
        decision: probability of a track that is decided for.
        hold_s: time for which it must stay above, and must not be doubtful.
    """

    every_s: Positive = 0.5
    sample_s: Positive = 1.0
    sigma_m: Positive = 1.0
    slow_sigma_m: Positive = 1.0
    slow_s: Positive = 5.0
    tilt_sigma_rad: Positive = 0.012
    tilt_s: Positive = 5.0
    height_sigma_m: Positive = 2.0
    pose_sigma_m: Positive = 3.0
    pose_sigma_rad: Positive = 0.02
    drift_m_s: Positive = 0.3
    wrong: Share = 0.05
    wrong_sigma_m: Positive = 40.0
    wrong_sigma_rad: Positive = 0.1
    rough: Share = 0.1
    rough_scale: Positive = 3.0
    apart_m: Positive = 60.0
    speed_m_s: Positive = 1.5
    turn_s: Positive = 20.0
    seen: Share = 0.8
    free: Positive = 1.0
    unforeseen: Share = 0.004
    decision: Share = 0.99
    hold_s: Positive = 3.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Pairs:
    """All pairs of windows at n times.

    Attributes:
        off: (i, 2 n, k) the handoff aircraft's window k less the tracker's window i; i = 0 is the target's.
        common: (i, 2 n, q) derivatives by what all pairs have in common, of which the standard deviations
            are 1; the first three are the pose's errors, not scaled.
        own: (2 n, 2 n) covariance of the noise of one pair.
        apart: (2 n, 2 n) covariance of the way from one target to another.
        inner: (i, q, q) common' own^-1 common.
        mixed: (i, q, k) common' own^-1 off.
        squares: (i, k) off' own^-1 off.
    """

    off: Array
    common: Array
    own: Array
    apart: Array
    inner: Array
    mixed: Array
    squares: Array


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
        self._compared_us: int | None = None

    def due(self, time_us: int) -> bool:
        every_us = 1e6 * self.parameters.every_s
        return self._compared_us is None or not 0 <= time_us - self._compared_us < every_us

    def update(self, windows: TrackWindows, pose: PoseMode) -> None:
        p = self.parameters
        if not self.due(windows.time_us):
            return
        self._compared_us = windows.time_us
        self._scores = {}
        if windows.target is not None and windows.handoff:
            self._scores = self._probabilities(windows, windows.target, pose)
        best = max(self._scores, key=lambda number: self._scores[number], default=None)
        if best is None or self._scores[best] < p.decision or best in windows.doubtful:
            self._above = None
            return
        if self._above is None or self._above[0] != best:
            self._above = (best, windows.time_us)
        if self.decided is None and windows.time_us - self._above[1] >= 1e6 * p.hold_s:
            self.decided = best

    def _probabilities(self, windows: TrackWindows, target: Array, pose: PoseMode) -> dict[int, float]:
        p = self.parameters
        numbers, pairs = self._pairs(windows, target, pose)
        narrow: Array = pose.covariance[np.ix_(_POSE, _POSE)] + np.diag(
            np.square([p.pose_sigma_m, p.pose_sigma_m, p.pose_sigma_rad])
        )
        wrong = np.diag(np.square([p.wrong_sigma_m, p.wrong_sigma_m, p.wrong_sigma_rad]))
        logs = [
            self._hypotheses(pairs, covariance, scale) + _log(weight * share)
            for weight, covariance in ((1.0 - p.wrong, narrow), (p.wrong, narrow + wrong))
            for share, scale in ((1.0 - p.rough, 1.0), (p.rough, p.rough_scale))
        ]
        shares = np.exp(np.array(logs) - np.max(logs)).sum(axis=0)
        shares *= windows.identity * (1.0 - p.unforeseen) / shares.sum()
        return dict(zip(numbers, shares[:-1].tolist(), strict=True))

    def _pairs(self, windows: TrackWindows, target: Array, pose: PoseMode) -> tuple[list[int], _Pairs]:
        p = self.parameters
        chosen = _sampled(windows.times_us, round(1e6 * p.sample_s))
        times_s = 1e-6 * (windows.times_us[chosen] - windows.time_us).astype(np.float64)
        n = len(chosen)
        c, s = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
        turn, place = np.array([[c, -s], [s, c]]), np.array([pose.forward_m, pose.right_m])
        near = _nearest(windows.others, target, _TRACKER_TRACKS - 1)
        turned = np.array([target, *(windows.others[number] for number in near)])[:, chosen] @ turn
        numbers = _nearest(windows.handoff, target @ turn + place, _HANDOFF_TRACKS)
        handoff = np.array([windows.handoff[number] for number in numbers])[:, chosen]
        off = handoff - turned[:, None] - place
        shifts = np.zeros((len(turned), n, 2, 5))  # by pose and drift
        shifts[..., 0, 0] = shifts[..., 1, 1] = 1.0
        shifts[..., 0, 2], shifts[..., 1, 2] = turned[..., 1], -turned[..., 0]
        shifts[..., 0, 3] = shifts[..., 1, 4] = p.drift_m_s * times_s
        parts = [shifts]
        apart_s = np.abs(times_s[:, None] - times_s)
        root = p.tilt_sigma_rad * np.linalg.cholesky(np.exp(-apart_s / p.tilt_s))
        eyes = (windows.eyes[0], windows.eyes[1] @ turn + place)
        for eye, height_m in zip(eyes, windows.heights_m, strict=True):
            line = turned + place - eye[chosen]
            tilted = height_m * np.eye(2) + line[..., :, None] * line[..., None, :] / height_m
            parts.append((p.height_sigma_m / height_m * line)[..., None])
            parts.append((tilted[..., None, :] * root[:, None, :, None]).reshape(len(turned), n, 2, 2 * n))
        common = np.concatenate(parts, axis=-1).reshape(len(turned), 2 * n, -1)
        noise = p.slow_sigma_m**2 * np.exp(-apart_s / p.slow_s) + p.sigma_m**2 * np.eye(n)
        away = p.apart_m**2 + _walked(-times_s, p.speed_m_s, p.turn_s)
        own = _on_both_axes(noise)
        off = off.reshape(*off.shape[:2], 2 * n).transpose(0, 2, 1)
        white = np.linalg.inv(np.linalg.cholesky(own))
        white_common, white_off = white @ common, white @ off
        return numbers, _Pairs(
            off=off,
            common=common,
            own=own,
            apart=_on_both_axes(away),
            inner=white_common.transpose(0, 2, 1) @ white_common,
            mixed=white_common.transpose(0, 2, 1) @ white_off,
            squares=(white_off * white_off).sum(axis=1),
        )

    def _hypotheses(self, pairs: _Pairs, pose: Array, scale: float) -> Array:
        """Logarithm of the density, summed over all hypotheses, with each track of the handoff aircraft as
        the target, and, last, with none.

        The noise of the pairs is independent, so what they have in common is estimated from them (the
        information form), and a joint density takes one matrix of its size, whatever the number of pairs.

        Args:
            pairs: of tracks.
            pose: (3, 3) covariance of its error.
            scale: of the noise of the pairs.
        """
        p = self.parameters
        count, size, tracks = pairs.off.shape
        root = np.eye(pairs.common.shape[-1])
        root[:3, :3] = np.linalg.cholesky(pose)
        common, own = pairs.common[0] @ root, scale**2 * pairs.own
        # the same for all tracks: as if they were near the target
        lower = np.linalg.cholesky(common @ common.T + own + pairs.apart)
        free = _log(p.free) - _log_normal(np.linalg.solve(lower, pairs.off[0]), lower)
        inner, mixed = root.T @ pairs.inner @ root / scale**2, root.T @ pairs.mixed / scale**2
        squares = pairs.squares / scale**2
        spread = 0.5 * np.linalg.slogdet(own)[1] + 0.5 * size * math.log(math.tau)  # of one pair
        found: list[list[Array]] = [[] for _ in range(tracks + 1)]
        for some in _subsets(count):
            prior = len(some) * _log(p.seen) + (count - len(some)) * _log(1.0 - p.seen)
            if not some:
                found[-1].append(np.array([prior]))
            if not 0 < len(some) <= tracks:
                continue
            joined = _joined(len(some), tracks)
            misfits = np.empty(len(joined))
            log = _misfits(inner, mixed, squares, np.array(some), joined, misfits)
            logs = prior - log - len(some) * spread - 0.5 * misfits - free[joined].sum(axis=1)
            if some[0]:
                found[-1].append(logs)
                continue
            for k in range(tracks):
                found[k].append(logs[joined[:, 0] == k])
        return np.array([_log_sum(np.concatenate(logs)) if logs else -math.inf for logs in found])

    @property
    def scores(self) -> Mapping[int, float]:
        return dict(self._scores)

    def reset(self) -> None:
        self._scores.clear()
        self._above = self._compared_us = None
        self.decided = None


@kernel
def _misfits(
    inner: Array, mixed: Array, squares: Array, some: Indices, joined: Indices, misfits: Array
) -> float:
    """Squared normalized deviations of joint densities, of all ways to join some tracks of the tracker.

    Args:
        inner, mixed, squares: of the pairs.
        some: (m,) tracks of the tracker.
        joined: (p, m) tracks of the handoff aircraft to which they are joined.
        misfits: (p,) result.

    Returns:
        Half of the logarithm of the determinant of the information about what the pairs have in common.
    """
    count, size, tracks = some.size, inner.shape[1], mixed.shape[2]
    lower, shown = np.zeros((size, size)), np.empty((size, count * tracks))
    for m in range(count):
        lower += inner[some[m]]
        shown[:, m * tracks : (m + 1) * tracks] = mixed[some[m]]
    log = 0.0
    for i in range(size):  # Cholesky factor by rows, and the solution of lower x = shown in place
        lower[i, i] += 1.0
        for j in range(i + 1):
            value = lower[i, j]
            for k in range(j):
                value -= lower[i, k] * lower[j, k]
            lower[i, j] = math.sqrt(value) if i == j else value / lower[j, j]
        for j in range(i):
            for c in range(shown.shape[1]):
                shown[i, c] -= lower[i, j] * shown[j, c]
        for c in range(shown.shape[1]):
            shown[i, c] /= lower[i, i]
        log += math.log(lower[i, i])
    # what two pairs explain together, by both tracks of the handoff aircraft
    explained = shown.T @ shown
    for p in range(joined.shape[0]):
        value = 0.0
        for m in range(count):
            one = m * tracks + joined[p, m]
            value += squares[some[m], joined[p, m]] - explained[one, one]
            for other in range(m):
                value -= 2.0 * explained[one, other * tracks + joined[p, other]]
        misfits[p] = value
    return log


@cache
def _subsets(count: int) -> tuple[tuple[int, ...], ...]:
    return tuple(some for size in range(count + 1) for some in combinations(range(count), size))


@cache
def _joined(count: int, tracks: int) -> Indices:
    """(p, count) all ways to join tracks to different others."""
    return np.array(list(permutations(range(tracks), count)))


def _nearest(windows: Mapping[int, Array], to: Array, most: int) -> list[int]:
    """Numbers of the windows that end nearest to another's end."""
    return sorted(windows, key=lambda number: math.dist(windows[number][-1], to[-1]))[:most]


def _on_both_axes(covariance: Array) -> Array:
    """(2 n, 2 n) of places, from (n, n) of each axis."""
    return np.kron(covariance, np.eye(2)).astype(np.float64)


def _walked(ages_s: Array, speed_m_s: float, turn_s: float) -> Array:
    """(n, n) covariance per axis of the ways since past times, of a velocity that is an Ornstein-Uhlenbeck
    process.
    """
    ages = ages_s / turn_s
    both = 2.0 * np.minimum(ages[:, None], ages) - 1.0 - np.exp(-np.abs(ages[:, None] - ages))
    found: Array = (speed_m_s * turn_s) ** 2 * (both + np.exp(-ages)[:, None] + np.exp(-ages))
    return found


def _log_normal(white: Array, lower: Array) -> Array:
    """Logarithm of a normal density, with the sign changed.

    Args:
        white: (m, ...) deviations, of which the covariance has been made 1.
        lower: (m, m) Cholesky factor of their covariance.
    """
    spread = np.log(np.diag(lower)).sum() + 0.5 * len(lower) * math.log(math.tau)
    found: Array = 0.5 * (white * white).sum(axis=0) + spread
    return found


def _log_sum(logs: Array) -> float:
    most = float(logs.max())
    return most + math.log(float(np.exp(logs - most).sum()))


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
