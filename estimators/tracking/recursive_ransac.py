"""Recursive RANSAC: a bank of track hypotheses over measurements of any number of targets, with clutter.

Source: Niedfeldt and Beard 2014, "Multiple target tracking using recursive RANSAC", and 2017, "Comparison and
analysis of recursive-RANSAC for multiple target tracking"; Fischler and Bolles 1981. Each scan goes through

1. prediction of all hypotheses, and their update by the measurements in their gates (probabilistic data
   association, Bar-Shalom, Daum and Huang 2009);
2. for each measurement that no hypothesis explains, RANSAC over the window of past scans: polynomials through
   it and random earlier measurements, of which the one that most scans support becomes a hypothesis;
3. inlier ratio of each hypothesis: the share of the window's scans with a measurement in its gate;
4. hypotheses of the same target are merged, those with few inliers pruned, the best M kept;
5. a hypothesis with a high inlier ratio for long enough is a track, and gets a number that it keeps.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking import ransac_kernels as kernels
from flightsim.foundation.checks import Count, Positive, Share
from flightsim.foundation.options import Options
from flightsim.foundation.random_streams import RandomStreams

__all__ = ["RansacParameters", "RansacTrack", "RecursiveRansac", "TargetModel"]

Array = NDArray[np.float64]


class TargetModel(StrEnum):
    """How a target moves: the derivative of its place that is white noise."""

    RANDOM_WALK = "random-walk"
    CONSTANT_VELOCITY = "constant-velocity"
    CONSTANT_ACCELERATION = "constant-acceleration"


_ORDERS: Final = {model: order for order, model in enumerate(TargetModel)}


@dataclass(frozen=True, slots=True, kw_only=True)
class RansacParameters(Options):
    """Parameters of the tracker. The papers' symbols are in parentheses.

    Attributes:
        model: how targets move.
        noise_density: spectral density of the white noise: m^2/s of a random walk, m^2/s^3 of a constant
            velocity, m^2/s^5 of a constant acceleration.
        sigma_m: standard deviation of a measurement per axis, where a scan brings no covariances.
        gate_squared: squared Mahalanobis distance of a measurement to a hypothesis (chi squared: 99 % of the
            target's own are within 9.2).
        detected: probability of detection.
        clutter_per_m2: density of false measurements.
        window: number of scans (N_w).
        hypotheses: size of the bank (M).
        iterations: largest number of polynomials tried for one measurement (ell).
        inlier_m: largest distance of an inlier to a polynomial (tau_R).
        speed_max_m_s: faster polynomials are not considered.
        enough: share of the window's scans whose support ends the search (gamma).
        seed_support: least number of earlier scans that support a new hypothesis.
        good_ratio: least inlier ratio with which a hypothesis becomes a track (tau_rho).
        prune_ratio: hypotheses with a smaller inlier ratio are dropped.
        good_age: least number of scans of a track (tau_T).
        lost_after: number of scans without a measurement after which a hypothesis is dropped.
        merge_squared: squared Mahalanobis distance of the states of hypotheses that are merged.
        seed: of the random numbers.
    """

    model: TargetModel = TargetModel.CONSTANT_VELOCITY
    noise_density: Positive = 0.1
    sigma_m: Positive = 1.0
    gate_squared: Positive = 9.2
    detected: Share = 0.9
    clutter_per_m2: Positive = 1e-5
    window: Count = 10
    hypotheses: Count = 30
    iterations: Count = 50
    inlier_m: Positive = 3.0
    speed_max_m_s: Positive = 30.0
    enough: Share = 0.9
    seed_support: Count = 3
    good_ratio: Share = 0.6
    prune_ratio: Share = 0.2
    good_age: Count = 10
    lost_after: Count = 10
    merge_squared: Positive = 4.0
    seed: int = 0

    def check_together(self) -> None:
        if self.window < self.seed_support + 1:
            raise ValueError(
                f"window = {self.window} is not accepted: more than seed_support = {self.seed_support} is"
            )
        if self.seed_support < self.order:
            raise ValueError(
                f"seed_support = {self.seed_support} is not accepted: {self.model} takes {self.order} or more"
            )

    @property
    def order(self) -> int:
        """Order of the polynomial."""
        return _ORDERS[self.model]


@dataclass(frozen=True, slots=True, kw_only=True)
class RansacTrack:
    """A target.

    Attributes:
        number: its number, from 1; it is never used again.
        state: (s,) x, y, vx, vy, ax, ay, as far as the model has them.
        covariance: (s, s).
        inlier_ratio: share of the window's scans that have a measurement of it.
        scans: number of scans since it was seeded.
        seen: whether the newest scan has a measurement of it.
    """

    number: int
    state: Array
    covariance: Array
    inlier_ratio: float
    scans: int
    seen: bool


class RecursiveRansac:
    """The tracker; places are in any frame in which targets move smoothly.

    Args:
        parameters: numbers and thresholds.
    """

    def __init__(self, parameters: RansacParameters | None = None) -> None:
        p = self.parameters = parameters or RansacParameters()
        self._random = RandomStreams(p.seed).generator("recursive_ransac")
        # one more, for the newest before the worst is dropped
        room, size = p.hypotheses + 1, 2 * (p.order + 1)
        self._count = 0
        self._means = np.zeros((room, size))
        self._covariances = np.zeros((room, size, size))
        self._hits = np.zeros((room, p.window), dtype=np.bool_)  # newest scan last
        self._ratios = np.zeros(room)  # share of hits
        self._ages = np.zeros(room, dtype=np.int64)  # scans since it was seeded
        self._missed = np.zeros(room, dtype=np.int64)
        self._numbers = np.zeros(room, dtype=np.int64)  # 0: no track yet
        self._found = np.zeros(room, dtype=np.bool_)
        self._drop = np.zeros(room, dtype=np.bool_)
        self._last_number = 0
        self._time_us: int | None = None
        self._window: deque[tuple[int, Array, Array]] = deque(maxlen=p.window - 1)
        self._tracks: tuple[RansacTrack, ...] | None = None  # of the newest scan, when they were asked for

    @property
    def hypotheses(self) -> int:
        """Number of hypotheses in the bank."""
        return self._count

    def scan(self, time_us: int, places: Array, covariances: Array | None = None) -> None:
        """Process the measurements of one time.

        Args:
            time_us: time of the scan; a scan that is not newer than the last one is ignored.
            places: (n, 2) m; n may be 0.
            covariances: (n, 2, 2) m^2; None: `sigma_m` on both axes.
        """
        if self._time_us is not None and time_us <= self._time_us:
            return
        p = self.parameters
        self._tracks = None
        places = np.ascontiguousarray(places, dtype=np.float64).reshape(-1, 2)
        if covariances is None:
            covariances = np.tile(p.sigma_m**2 * np.eye(2), (len(places), 1, 1))
        explained = np.zeros(len(places), dtype=np.bool_)
        if self._time_us is not None:
            self._advance((time_us - self._time_us) * 1e-6, places, covariances, explained)
        self._time_us = time_us
        if self._window and len(self._window) >= p.seed_support:
            self._seed(time_us, places, covariances, explained)
        self._window.append((time_us, places, covariances))
        self._tidy()

    def _advance(self, dt_s: float, places: Array, covariances: Array, explained: NDArray[np.bool_]) -> None:
        p, count = self.parameters, self._count
        if not count:
            return
        transition, noise = kernels.transition_and_noise(p.order, dt_s, p.noise_density)
        kernels.predict(count, self._means, self._covariances, transition, noise)
        kernels.associate(
            count,
            self._means,
            self._covariances,
            places,
            covariances,
            p.gate_squared,
            p.detected,
            p.clutter_per_m2,
            self._numbers[:count] > 0,
            self._found,
            explained,
        )
        found = self._found[:count]
        self._hits[:count, :-1] = self._hits[:count, 1:]
        self._hits[:count, -1] = found
        self._ages[:count] += 1
        self._missed[:count] = np.where(found, 0, self._missed[:count] + 1)

    def _seed(self, time_us: int, places: Array, covariances: Array, explained: NDArray[np.bool_]) -> None:
        """A hypothesis for each measurement that none explains and enough earlier scans support."""
        p = self.parameters
        earlier = [scan for scan in self._window if len(scan[1])]
        if explained.all() or len(earlier) < p.seed_support:
            return
        counts = [len(scan[1]) for scan in earlier]
        ages = np.repeat([(time_us - scan[0]) * 1e-6 for scan in earlier], counts)
        scans = np.repeat(np.arange(len(earlier)), counts)
        old_places = np.concatenate([scan[1] for scan in earlier])
        old_covariances = np.concatenate([scan[2] for scan in earlier])
        inliers = np.zeros(len(ages), dtype=np.bool_)
        slots = p.window - len(self._window)  # the window's place of its oldest scan
        filled = {id(scan): slots + k for k, scan in enumerate(self._window)}
        for i in np.flatnonzero(~explained):
            if explained[i]:
                continue
            marks = self._random.random((p.iterations, max(1, p.order)))
            enough = math.ceil(p.enough * len(earlier))
            supported = kernels.search(
                places[i],
                ages,
                scans,
                old_places,
                p.order,
                p.inlier_m,
                p.speed_max_m_s,
                enough,
                marks,
                inliers,
            )
            if supported < p.seed_support:
                continue
            k = self._room()
            known = kernels.fit(
                np.append(ages[inliers], 0.0),
                np.vstack((old_places[inliers], places[i])),
                np.concatenate((old_covariances[inliers], covariances[i][None])),
                p.order,
                self._means[k],
                self._covariances[k],
            )
            if not known:
                continue
            span_s = float(ages[inliers].max())
            self._covariances[k] += kernels.transition_and_noise(p.order, span_s, p.noise_density)[1]
            self._hits[k] = False
            for scan in np.unique(scans[inliers]):
                self._hits[k, filled[id(earlier[scan])] - 1] = True
            self._hits[k, -1] = True
            self._ages[k] = self._missed[k] = self._numbers[k] = 0
            self._found[k] = True
            self._count = k + 1
            off = places - self._means[k, :2]
            explained |= (off * off).sum(axis=1) <= p.inlier_m**2

    def _room(self) -> int:
        """Index of a free row; in a full bank the worst hypothesis makes room for it."""
        self._drop_worst()
        return self._count

    def _drop_worst(self) -> None:
        """Limit the bank to its size: of one hypothesis too many the worst is dropped, a track last."""
        if self._count > self.parameters.hypotheses:
            kernels.inlier_ratios(self._count, self._hits, self._ratios)
            ratios = self._ratios[: self._count] + (self._numbers[: self._count] > 0)
            keep = np.ones(self._count, dtype=np.bool_)
            keep[int(np.argmin(ratios))] = False
            self._keep(keep)

    def _tidy(self) -> None:
        """Merge, prune, limit the bank, and number the tracks."""
        p, count = self.parameters, self._count
        if not count:
            return
        kernels.inlier_ratios(count, self._hits, self._ratios)
        ratios = self._ratios[:count]
        # an older track wins over a younger hypothesis with the same inliers
        kernels.duplicates(
            count,
            self._means,
            self._covariances,
            ratios + (self._numbers[:count] > 0),
            p.merge_squared,
            self._drop,
        )
        lost = (ratios < p.prune_ratio) | (self._missed[:count] >= p.lost_after)
        self._keep(~(self._drop[:count] | lost))
        self._drop_worst()
        count = self._count
        good = (self._ratios[:count] >= p.good_ratio) & (self._ages[:count] >= p.good_age)
        for k in np.flatnonzero(good & (self._numbers[:count] == 0)):
            self._last_number += 1
            self._numbers[k] = self._last_number

    def _keep(self, keep: NDArray[np.bool_]) -> None:
        if keep.all():
            return
        rows = np.flatnonzero(keep)
        for values in (
            self._means,
            self._covariances,
            self._hits,
            self._ratios,
            self._ages,
            self._missed,
            self._numbers,
            self._found,
        ):
            values[: len(rows)] = values[rows]
        self._count = len(rows)

    @property
    def tracks(self) -> Sequence[RansacTrack]:
        """The tracks, by number."""
        if self._tracks is None:
            rows = np.flatnonzero(self._numbers[: self._count])
            self._tracks = tuple(
                RansacTrack(
                    number=int(self._numbers[k]),
                    state=self._means[k].copy(),
                    covariance=self._covariances[k].copy(),
                    inlier_ratio=float(self._ratios[k]),
                    scans=int(self._ages[k]),
                    seen=bool(self._found[k]),
                )
                for k in rows[np.argsort(self._numbers[rows])]
            )
        return self._tracks
