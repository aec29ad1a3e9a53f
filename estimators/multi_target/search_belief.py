"""What a search knows: the intensity of targets, the exploration map, and the targets that count as found.

Source: Yousuf, Lendek and Busoniu, algorithm 1, as docs/multi_target.md corrects it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.multi_target.estimate import TargetRow
from estimators.multi_target.models import layout_of, motion_of, particles_of, sensor_of
from estimators.multi_target.parameters import Belief, MultiTargetParameters
from estimators.scene_items import Field, Item, PointSet, Role, Value
from estimators.tracking.exploration import ExplorationMap
from estimators.tracking.found_targets import FoundTargets
from estimators.tracking.gaussian_components import Components
from estimators.tracking.gaussian_phd import GaussianPhd
from estimators.tracking.information import condensed
from estimators.tracking.intensity import Cluster, TargetIntensity
from estimators.tracking.multi_bernoulli import MultiBernoulli
from estimators.tracking.range_bearing import Viewpoint
from estimators.tracking.smc_phd import SmcPhd
from flightsim.foundation.random_streams import RandomStreams

__all__ = ["FoundTarget", "SearchBelief"]

Array = NDArray[np.float64]

_SHOWN_CELL_M: Final = 1.0  # particles are shown together in cells
_LEAST_AWAY: Final = 0.05  # share of a found target that has left its place, which is worth a look
_OWN_GATE: Final = 11.83  # squared distance, 99.7 % in the plane: a far measurement of a found target


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundTarget:
    """A target that counts as found.

    Attributes:
        time_us: vehicle time of the scan with which it was found.
        north_m, east_m: place, by all measurements so far.
        mass: expected number of targets there, at most 1: the probability that there is one within
            `found_distance_m` of the place. It falls where targets walk and are not measured again.
        width_m: standard deviation per axis, with the errors that all measurements share.
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
        self._found = FoundTargets(
            self.sensor,
            walk_m_sqrt_s=motion.walk_m_sqrt_s,
            place_sigma_m=p.place_sigma_m,
            range_bias_m=p.range_bias_sigma_m,
            bearing_bias_rad=p.bearing_bias_sigma_rad,
        )
        self._found_us: list[int] = []
        self._exist: list[float] = []
        self.clusters: Sequence[Cluster] = ()
        self.scans = self.removed = self.outside = 0
        self._time_us: int | None = None

    @property
    def found_so_far(self) -> Sequence[FoundTarget]:
        """All targets that were found, in order; none when targets move: a place does not stay found."""
        places, covariances = self._found.places()
        widths = np.sqrt(0.5 * np.trace(covariances, axis1=1, axis2=2))
        near = _within(self.parameters.found_distance_m, widths)
        return [
            FoundTarget(time_us=time_us, north_m=north_m, east_m=east_m, mass=exists * share, width_m=width_m)
            for time_us, (north_m, east_m), exists, share, width_m in zip(
                *(self._found_us, places.tolist(), self._exist, near.tolist(), widths.tolist()), strict=True
            )
        ]

    @property
    def found(self) -> Sequence[FoundTarget]:
        """Those that are probably where they are reported."""
        return [target for target in self.found_so_far if target.mass >= self.parameters.reported_mass]

    def points(self) -> tuple[Array, Array, Array]:
        """North, east and mass (n,) of points that represent the targets that are to be located: the
        intensity, and of each found target the share that has left its place.
        """
        places, covariances = self._found.places()
        widths = np.sqrt(0.5 * np.trace(covariances, axis1=1, axis2=2))
        away = np.array(self._exist) * (1.0 - _within(self.parameters.found_distance_m, widths))
        lost = away > _LEAST_AWAY
        if not lost.any():
            return self.intensity.points()
        gone = Components(weights=away[lost], means=places[lost], covariances=covariances[lost]).points()
        north, east, mass = map(np.concatenate, zip(self.intensity.points(), gone, strict=True))
        return north, east, mass

    def observe(self, time_us: int, scan: Array, viewpoint: Viewpoint, vehicle: int = 0) -> None:
        """Process one scan.

        Args:
            time_us: time of the scan; of scans of several vehicles, on a common time base.
            scan: (m, 2) range and bearing from the nose.
            viewpoint: of the scan.
            vehicle: whose sensor scans.
        """
        dt_s = 0.0 if self._time_us is None else max(0, time_us - self._time_us) * 1e-6
        self._time_us = time_us if self._time_us is None else max(time_us, self._time_us)
        self.scans += 1
        if self._static and len(self._found):
            self.intensity.motion = replace(self.intensity.motion, walk_m_sqrt_s=self._found.walk_m_sqrt_s)
        self.intensity.predict(dt_s)
        self.exploration.predict(dt_s)
        self._found.predict(dt_s)
        scan = self._unexplained(np.asarray(scan, dtype=np.float64).reshape(-1, 2), viewpoint, vehicle)
        self.intensity.update(scan, viewpoint, self.birth)
        self.exploration.look(viewpoint)
        self.clusters = self.intensity.clusters()
        if self._static:
            self._find(time_us, viewpoint, vehicle)

    def birth(self, north_m: Array, east_m: Array) -> Array:
        """Intensity of targets that were never detected, per square metre."""
        return self.parameters.birth_per_m2 * self.exploration.at(north_m, east_m)

    def _unexplained(self, scan: Array, viewpoint: Viewpoint, vehicle: int) -> Array:
        """The measurements, without the vehicle's expected biases, that belong neither to found targets nor
        outside the area. Each found target takes the nearest measurement only, so that a second target beside
        it can be found.
        """
        if not len(scan):
            return scan
        raw, scan = scan, scan - self._found.bias(vehicle)
        places = self.sensor.places(scan, viewpoint)
        kept = self.exploration.near_area(places[:, 0], places[:, 1])
        self.outside += int(np.count_nonzero(~kept))
        means, _ = self._found.places()
        found = zip(means, self._found.distances(raw, viewpoint, vehicle), strict=True)
        for number, (mean, distance) in enumerate(found):
            off = places - mean
            own = np.hypot(off[:, 0], off[:, 1]) <= self.parameters.found_distance_m
            own |= distance <= _OWN_GATE
            distance[~(own & kept)] = math.inf
            nearest = int(np.argmin(distance))
            if math.isfinite(distance[nearest]):
                kept[nearest] = False
                self.removed += 1
                self._found.take(number, raw[nearest], viewpoint, vehicle)
        return scan[kept]

    def _find(self, time_us: int, viewpoint: Viewpoint, vehicle: int) -> None:
        """Move narrow clusters of enough mass to the found targets."""
        p = self.parameters
        new = [c for c in self.clusters if c.width_m <= p.found_width_m and c.mass >= p.found_mass]
        for cluster in new:
            self.intensity.remove(cluster)
            self._found.add(cluster, viewpoint, vehicle)
            self._found_us.append(time_us)
            self._exist.append(min(1.0, cluster.mass))
        if new:
            self.clusters = [cluster for cluster in self.clusters if cluster not in new]

    @property
    def candidates(self) -> list[Cluster]:
        """Clusters that are reported as targets and do not count as found."""
        return [cluster for cluster in self.clusters if cluster.mass >= self.parameters.reported_mass]

    @property
    def targets(self) -> tuple[TargetRow, ...]:
        """The reported targets: the found ones in order, then the others."""
        least = self.parameters.reported_mass
        found = [
            TargetRow(
                north_m=t.north_m, east_m=t.east_m, mass=t.mass, width_m=t.width_m, found=t.mass >= least
            )
            for t in self.found_so_far
        ]
        others = [
            TargetRow(north_m=c.north_m, east_m=c.east_m, mass=c.mass, width_m=c.width_m, found=False)
            for c in self.candidates
        ]
        return (*found, *others)

    def shown(self) -> dict[str, Item]:
        """The belief for viewers: where targets are, where none was looked for, and what is reported."""
        north, east, mass = condensed(*self.intensity.points(), cell_m=_SHOWN_CELL_M)
        rows = self.targets
        found = [row for row in rows if row.found]
        others = [row for row in rows if not row.found]
        return {
            "unexplored": Field.on(
                self.exploration.layout,
                self.exploration.undetected,
                unit="not yet detected",
                low=0.0,
                high=1.0,
            ),
            "intensity": PointSet(
                points_ned_m=np.column_stack([north, east, np.zeros_like(north)]),
                weights=mass,
                unit="targets",
            ),
            "found": PointSet.on_ground(
                [(row.north_m, row.east_m) for row in found],
                labels=[f"found {k + 1}" for k in range(len(found))],
            ),
            "candidates": PointSet.on_ground(
                [(row.north_m, row.east_m) for row in others],
                labels=[f"{row.mass:.2f}" for row in others],
                role=Role.BELIEF,
            ),
            "expected_undetected": Value(value=self.expected_undetected, role=Role.BELIEF),
            "expected_targets": Value(value=self.expected_targets, role=Role.BELIEF),
        }

    @property
    def expected_targets(self) -> float:
        """Expected number of detected targets: the found ones, and the integral of the intensity."""
        return sum(self._exist) + self.intensity.expected_targets

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


def _within(radius_m: float, widths_m: Array) -> Array:
    """Probability that a place in the plane is off by less than a radius, by its width."""
    return np.asarray(-np.expm1(-0.5 * (radius_m / widths_m) ** 2), dtype=np.float64)
