"""What a search knows: the intensity of targets, the exploration map, and the targets that count as found.

Source: Yousuf, Lendek and Busoniu, algorithm 1, as docs/multi_target.md corrects it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.multi_target.estimate import TargetRow
from estimators.multi_target.models import layout_of, motion_of, particles_of, sensor_of
from estimators.multi_target.parameters import Belief, MultiTargetParameters
from estimators.tracking.exploration import ExplorationMap
from estimators.tracking.gaussian_phd import GaussianPhd
from estimators.tracking.intensity import Cluster, TargetIntensity
from estimators.tracking.multi_bernoulli import MultiBernoulli
from estimators.tracking.range_bearing import Viewpoint
from estimators.tracking.smc_phd import SmcPhd
from flightsim.foundation.random_streams import RandomStreams

__all__ = ["FoundTarget", "SearchBelief"]

Array = NDArray[np.float64]

_OWN_GATE: Final = 11.83  # squared distance, 99.7 % in the plane: a far measurement of a found target


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundTarget:
    """A target that counts as found.

    Attributes:
        time_us: vehicle time of the scan with which it was found.
        north_m, east_m: place.
        mass: expected number of targets there, at most 1: the probability that there is one.
        width_m: standard deviation per axis.
    """

    time_us: int
    north_m: float
    east_m: float
    mass: float
    width_m: float


class SearchBelief:
    """The belief of one search, to which any number of vehicles report scans.

    Attributes:
        parameters: as given.
        sensor: what is known about it.
        intensity: of targets that were detected and do not count as found.
        exploration: probability that a target was never detected.
        found: found targets in order; always empty when targets move, because a place does not stay found.
        scans: number of scans.
        removed: number of measurements that were taken out because they belong to found targets.
        outside: number of measurements outside the area.
    """

    def __init__(self, parameters: MultiTargetParameters) -> None:
        p = self.parameters = parameters
        self.sensor = sensor_of(p)
        motion = motion_of(p)
        self.intensity: TargetIntensity
        if p.belief is Belief.PARTICLES:
            seed = RandomStreams(p.seed).child("multi_target")
            self.intensity = SmcPhd(self.sensor, motion, particles_of(p), seed=seed)
        elif p.belief is Belief.GAUSSIANS:
            self.intensity = GaussianPhd(self.sensor, motion)
        else:
            self.intensity = MultiBernoulli(self.sensor, motion)
        self._static = not motion.moves
        self.exploration = ExplorationMap(layout_of(p), self.sensor, math.inf if self._static else p.forget_s)
        self.found: list[FoundTarget] = []
        self.clusters: Sequence[Cluster] = ()
        self.scans = self.removed = self.outside = 0
        self._time_us: int | None = None

    def observe(self, time_us: int, scan: Array, viewpoint: Viewpoint) -> None:
        """Process one scan.

        Args:
            time_us: time of the scan; of scans of several vehicles, on a common time base.
            scan: (m, 2) range and bearing from the nose.
            viewpoint: of the scan.
        """
        dt_s = 0.0 if self._time_us is None else max(0, time_us - self._time_us) * 1e-6
        self._time_us = time_us if self._time_us is None else max(time_us, self._time_us)
        self.scans += 1
        self.intensity.predict(dt_s)
        self.exploration.predict(dt_s)
        scan = self._unexplained(np.asarray(scan, dtype=np.float64).reshape(-1, 2), viewpoint)
        self.intensity.update(scan, viewpoint, self.birth)
        self.exploration.look(viewpoint)
        self.clusters = self.intensity.clusters()
        if self._static:
            self._find(time_us)

    def birth(self, north_m: Array, east_m: Array) -> Array:
        """Intensity of targets that were never detected, per square metre."""
        return self.parameters.birth_per_m2 * self.exploration.at(north_m, east_m)

    def _unexplained(self, scan: Array, viewpoint: Viewpoint) -> Array:
        """The measurements that belong neither to found targets nor outside the area. Each found target takes
        out the nearest measurement only, so that a second target beside it can be found.
        """
        if not len(scan):
            return scan
        places = self.sensor.places(scan, viewpoint)
        kept = self.exploration.near_area(places[:, 0], places[:, 1])
        self.outside += int(np.count_nonzero(~kept))
        if self.found:
            inverse = np.linalg.inv(self.sensor.covariances(scan, viewpoint))
            for target in self.found:
                off = places - (target.north_m, target.east_m)
                away = np.hypot(off[:, 0], off[:, 1])
                own = away <= self.parameters.found_distance_m
                own |= np.einsum("ni,nij,nj->n", off, inverse, off) <= _OWN_GATE
                away[~(own & kept)] = math.inf
                nearest = int(np.argmin(away))
                if math.isfinite(away[nearest]):
                    kept[nearest] = False
                    self.removed += 1
        return scan[kept]

    def _find(self, time_us: int) -> None:
        """Move narrow clusters of enough mass to the found targets."""
        p = self.parameters
        new = [c for c in self.clusters if c.width_m <= p.found_width_m and c.mass >= p.found_mass]
        for cluster in new:
            self.intensity.remove(cluster)
            self.found.append(
                FoundTarget(
                    time_us=time_us,
                    north_m=cluster.north_m,
                    east_m=cluster.east_m,
                    mass=min(1.0, cluster.mass),
                    width_m=cluster.width_m,
                )
            )
        if new:
            self.clusters = [cluster for cluster in self.clusters if cluster not in new]

    @property
    def candidates(self) -> list[Cluster]:
        """Clusters that are reported as targets and do not count as found."""
        return [cluster for cluster in self.clusters if cluster.mass >= self.parameters.reported_mass]

    @property
    def targets(self) -> tuple[TargetRow, ...]:
        """The reported targets: the found ones in order, then the others."""
        found = [
            TargetRow(north_m=t.north_m, east_m=t.east_m, mass=t.mass, width_m=t.width_m, found=True)
            for t in self.found
        ]
        others = [
            TargetRow(north_m=c.north_m, east_m=c.east_m, mass=c.mass, width_m=c.width_m, found=False)
            for c in self.candidates
        ]
        return (*found, *others)

    @property
    def expected_targets(self) -> float:
        """Expected number of detected targets: the found ones, and the integral of the intensity."""
        return len(self.found) + self.intensity.expected_targets

    @property
    def expected_undetected(self) -> float:
        """Expected number of targets in the area that were never detected.

        Their density before the search is estimated from the detected ones: n + 1/2 over the part of the area
        that was seen (the mean with Jeffreys' prior of a Poisson rate); it is infinite before the first scan.
        """
        seen_m2 = self.exploration.area_m2 - self.exploration.undetected_area_m2
        if not seen_m2 > 0.0:
            return math.inf
        return (self.expected_targets + 0.5) * self.exploration.undetected_area_m2 / seen_m2
