"""Consistency of the PHD filters over scenes: the expected number of targets, and OSPA beside a bound.

    python -m benchmarks.phd_consistency [--scenes 200] [--scans 20] [--no-found]

In each scene a Poisson number of targets (10 on average) is uniform over a square of 60 m, and a vehicle
looks from a circle of 10 m. The belief is that of the estimator `multi-target`: filter, exploration map and,
without `--no-found`, found targets. Printed are, for clutter of 0 and 2 false detections per scan, the sum of
N_hat over the sum of the true numbers in view, with its 95 % interval, and the mean OSPA (cut-off 5 m) after
some scans. The bound has the association: it knows which detection is of which target, and fuses those of
each by least squares; targets that were never detected are missing in it too.
"""

import argparse
import math
import sys

import numpy as np
from numpy.typing import NDArray

from estimators.multi_target.models import sensor_of
from estimators.multi_target.parameters import Belief, MultiTargetParameters
from estimators.multi_target.search_belief import SearchBelief
from estimators.tracking.ospa import ospa
from estimators.tracking.range_bearing import RangeBearingSensor, Viewpoint

Array = NDArray[np.float64]

HALF_M = 30.0
MEAN_TARGETS = 10.0
CUTOFF_M = 5.0
SHOWN = (1, 2, 4, 8, 12, 20)


class Bound:
    """Each target's detections, fused with the true association."""

    def __init__(self, count: int, sensor: RangeBearingSensor) -> None:
        self._sensor = sensor
        self._information = np.zeros((count, 2, 2))
        self._vector = np.zeros((count, 2))

    def add(self, seen: NDArray[np.bool_], scan: Array, viewpoint: Viewpoint) -> None:
        """Fuse the detections of one scan; `scan` has a row for each target that is seen."""
        inverse = np.linalg.inv(self._sensor.covariances(scan, viewpoint))
        self._information[seen] += inverse
        self._vector[seen] += np.einsum("nij,nj->ni", inverse, self._sensor.places(scan, viewpoint))

    @property
    def places(self) -> Array:
        """Places of the targets that were detected."""
        known = self._information[:, 0, 0] > 0.0
        found = np.linalg.solve(self._information[known], self._vector[known][..., None])[..., 0]
        return found.astype(np.float64, copy=False)


def scene(number: int, kind: Belief, clutter: float, scans: int, *, find: bool) -> tuple[Array, Array]:
    """(N_hat, true number) and (OSPA, bound) after each scan."""
    rng = np.random.default_rng([7, number])
    count = int(rng.poisson(MEAN_TARGETS))
    targets = rng.uniform(-HALF_M, HALF_M, (count, 2))
    parameters = MultiTargetParameters(
        south_m=-HALF_M,
        west_m=-HALF_M,
        north_m=HALF_M,
        east_m=HALF_M,
        reach_m=55.0,
        clutter_per_scan=clutter,
        unknown_clutter_per_scan=0.0,
        belief=kind,
        expected_targets=MEAN_TARGETS,
        found_mass=0.9 if find else 1e9,
        seed=number,
    )
    belief, sensor = SearchBelief(parameters), sensor_of(parameters)
    bound = Bound(count, sensor)
    numbers, distances = np.empty((scans, 2)), np.empty((scans, 2))
    for k in range(scans):
        viewpoint = Viewpoint(north_m=10.0 * math.cos(0.7 * k), east_m=10.0 * math.sin(0.7 * k))
        off = targets - (viewpoint.north_m, viewpoint.east_m)
        distance, bearing = np.hypot(off[:, 0], off[:, 1]), np.arctan2(off[:, 1], off[:, 0])
        seen = rng.random(count) < sensor.probability(targets[:, 0], targets[:, 1], viewpoint)
        noise = rng.standard_normal((count, 2)) * (sensor.range_sigma_m, sensor.bearing_sigma_rad)
        scan = np.column_stack((np.abs(distance + noise[:, 0]), bearing + noise[:, 1]))[seen]
        bound.add(seen, scan, viewpoint)
        false = rng.poisson(clutter)
        places = np.column_stack(
            (sensor.reach_m * np.sqrt(rng.random(false)), rng.uniform(-math.pi, math.pi, false))
        )
        belief.observe(k * 1_000_000, np.vstack((scan, places)), viewpoint)
        reported = np.array([(target.north_m, target.east_m) for target in belief.targets])
        numbers[k] = belief.expected_targets, count
        distances[k] = (
            ospa(reported.reshape(-1, 2), targets, cutoff=CUTOFF_M),
            ospa(bound.places, targets, cutoff=CUTOFF_M),
        )
    return numbers, distances


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--scans", type=int, default=20)
    parser.add_argument("--no-found", action="store_true", help="the filter alone")
    given = parser.parse_args()
    shown = [k for k in SHOWN if k <= given.scans]
    for kind in Belief:
        for clutter in (0.0, 2.0):
            scenes = [
                scene(number, kind, clutter, given.scans, find=not given.no_found)
                for number in range(given.scenes)
            ]
            numbers, distances = zip(*scenes, strict=True)
            last = np.array(numbers)[:, -1]
            ratio = last[:, 0].sum() / last[:, 1].sum()
            errors = last[:, 0] - last[:, 1]
            half = 1.96 * errors.std(ddof=1) / math.sqrt(len(errors)) / last[:, 1].mean()
            sys.stdout.write(f"{kind}, clutter {clutter:g}: N_hat / N = {ratio:.4f} +- {half:.4f}\n")
            mean = np.array(distances).mean(axis=0)
            for name, column in (("filter", 0), ("bound", 1)):
                row = "  ".join(f"{mean[k - 1, column]:.2f}" for k in shown)
                sys.stdout.write(f"  OSPA of the {name} after {', '.join(map(str, shown))} scans: {row} m\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
