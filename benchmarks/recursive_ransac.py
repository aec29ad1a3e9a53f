"""R-RANSAC beside a global-nearest-neighbour Kalman tracker and JPDA of Stone Soup, on the same measurements.

    pip install -e '.[bench]'
    python -m benchmarks.recursive_ransac [--scenes 5] [--scans 200] [--false 5]

Targets walk in 140 m by 270 m; scans of 10 Hz have their places with noise (1 m), misses (10 %) and false
measurements. All trackers have the same nearly constant velocity, noise, gate and probability of detection.
Stone Soup's trackers start tracks by its `MultiMeasurementInitiator` (as many updates as R-RANSAC asks for)
and drop them after as many scans without a measurement, or when they are wide. Printed are the mean GOSPA
(cut-off 5 m, order 2), missed and false targets, numbers of tracks, and time per frame.
"""

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.ospa import gospa
from estimators.tracking.recursive_ransac import RansacParameters, RecursiveRansac

Array = NDArray[np.float64]

RATE_HZ = 10
TARGETS = 5
HALF_M = np.array([70.0, 135.0])
SIGMA_M = 1.0
DETECTED = 0.9
DENSITY = 0.3
CUTOFF_M = 5.0
SKIPPED = 50  # scans before the figures count: all trackers have started by then

Places = list[tuple[int, Array]]
"""Number and position of each track after a scan."""


@dataclass(frozen=True, slots=True)
class Scene:
    """Targets (scans, n, 2) and the measurements (m, 2) of each scan."""

    targets: Array
    scans: list[Array]


def scene(number: int, count: int, false: float) -> Scene:
    """One scene."""
    rng = np.random.default_rng([18, number])
    place = rng.uniform(-1.0, 1.0, (TARGETS, 2)) * HALF_M
    heading = rng.uniform(-math.pi, math.pi, TARGETS)
    speed = rng.uniform(0.8, 2.0, TARGETS)
    targets, scans = np.empty((count, TARGETS, 2)), []
    for k in range(count):
        heading += 0.3 / math.sqrt(RATE_HZ) * rng.standard_normal(TARGETS)
        heading = np.where(
            np.any(np.abs(place) > HALF_M, axis=1), np.arctan2(-place[:, 1], -place[:, 0]), heading
        )
        place = place + (speed / RATE_HZ)[:, None] * np.column_stack((np.cos(heading), np.sin(heading)))
        targets[k] = place
        seen = rng.random(TARGETS) < DETECTED
        true = place[seen] + SIGMA_M * rng.standard_normal((int(seen.sum()), 2))
        scans.append(np.vstack((true, rng.uniform(-1.0, 1.0, (rng.poisson(false), 2)) * HALF_M)))
    return Scene(targets, scans)


def clutter(false: float) -> float:
    """Density of false measurements."""
    return max(false, 0.1) / float(np.prod(2.0 * HALF_M))


def by_ransac(scans: list[Array], false: float) -> Iterator[Places]:
    """Tracks of R-RANSAC after each scan."""
    tracker = RecursiveRansac(
        RansacParameters(
            noise_density=DENSITY,
            sigma_m=SIGMA_M,
            detected=DETECTED,
            clutter_per_m2=clutter(false),
            window=20,
            good_age=10,
            lost_after=15,
            speed_max_m_s=6.0,
            seed_support=5,
        )
    )
    for k, scan in enumerate(scans):
        tracker.scan(k * 1_000_000 // RATE_HZ, scan)
        yield [(track.number, track.state[:2]) for track in tracker.tracks]


def by_stone_soup(scans: list[Array], false: float, *, joint: bool) -> Iterator[Places]:
    """Tracks of Stone Soup's tracker after each scan: JPDA, or global nearest neighbour."""
    from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
    from stonesoup.dataassociator.probability import JPDA
    from stonesoup.deleter.error import CovarianceBasedDeleter
    from stonesoup.deleter.multi import CompositeDeleter
    from stonesoup.deleter.time import UpdateTimeStepsDeleter
    from stonesoup.hypothesiser.distance import DistanceHypothesiser
    from stonesoup.hypothesiser.probability import PDAHypothesiser
    from stonesoup.initiator.simple import MultiMeasurementInitiator
    from stonesoup.measures import Mahalanobis
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.tracker.simple import MultiTargetMixtureTracker, MultiTargetTracker
    from stonesoup.types.detection import Detection
    from stonesoup.types.state import GaussianState
    from stonesoup.updater.kalman import KalmanUpdater

    start = datetime(2026, 1, 1)
    model = LinearGaussian(4, (0, 2), SIGMA_M**2 * np.eye(2))
    predictor = KalmanPredictor(
        CombinedLinearGaussianTransitionModel([ConstantVelocity(DENSITY), ConstantVelocity(DENSITY)])
    )
    updater = KalmanUpdater(model)
    nearest = GNNWith2DAssignment(
        DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=math.sqrt(9.2))
    )
    deleter = CompositeDeleter(
        [UpdateTimeStepsDeleter(15), CovarianceBasedDeleter(100.0, mapping=[0, 2])], intersect=False
    )
    initiator = MultiMeasurementInitiator(
        prior_state=GaussianState([[0.0], [0.0], [0.0], [0.0]], np.diag([1.0, 4.0, 1.0, 4.0])),
        measurement_model=model,
        deleter=UpdateTimeStepsDeleter(3),
        data_associator=nearest,
        updater=updater,
        min_points=10,
    )

    def detections() -> Iterator[tuple[datetime, set[Any]]]:
        for k, scan in enumerate(scans):
            now = start + timedelta(seconds=k / RATE_HZ)
            yield now, {Detection(row.reshape(2, 1), timestamp=now, measurement_model=model) for row in scan}

    pda = PDAHypothesiser(
        predictor, updater, clutter_spatial_density=clutter(false), prob_detect=DETECTED, prob_gate=0.99
    )
    kind = MultiTargetMixtureTracker if joint else MultiTargetTracker
    tracker = kind(
        initiator=initiator,
        deleter=deleter,
        detector=detections(),
        data_associator=JPDA(pda) if joint else nearest,
        updater=updater,
    )
    numbers: dict[str, int] = {}
    for _, tracks in tracker:
        yield [
            (numbers.setdefault(track.id, len(numbers)), np.array(track.state_vector, dtype=float)[[0, 2], 0])
            for track in tracks
        ]


def measure(name: str, scenes: list[Scene], run: Callable[[list[Array]], Iterator[Places]]) -> None:
    """Run a tracker over the scenes and print its figures."""
    values, seconds, frames, numbers = [], [], 0, 0
    for given in scenes:
        seen = set()
        begin = time.perf_counter()
        for k, tracks in enumerate(run(given.scans)):
            seconds.append(time.perf_counter() - begin)
            if k >= SKIPPED:
                places = np.array([place for _, place in tracks]).reshape(-1, 2)
                values.append(gospa(places, given.targets[k], cutoff=CUTOFF_M))
                seen |= {number for number, _ in tracks}
            frames += 1
            begin = time.perf_counter()
        numbers += len(seen)
    found = [np.mean([getattr(v, part) for v in values]) for part in ("distance", "missed", "false")]
    say(
        f"{name:<16} {found[0]:7.2f} {found[1]:7.2f} {found[2]:7.2f} {numbers / len(scenes):8.1f} "
        f"{1e3 * float(np.mean(seconds)):9.3f} {1e3 * float(np.median(seconds)):9.3f}"
    )


def say(line: str) -> None:
    """Print a line."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=5)
    parser.add_argument("--scans", type=int, default=200)
    parser.add_argument("--false", type=float, default=5.0)
    given = parser.parse_args()
    scenes = [scene(number, given.scans, given.false) for number in range(given.scenes)]
    for _ in by_ransac(scenes[0].scans, given.false):  # compiles
        pass
    say(f"{given.scenes} scenes of {given.scans} scans, {TARGETS} targets, {given.false:g} false a scan")
    say(
        f"{'tracker':<16} {'GOSPA':>7} {'missed':>7} {'false':>7} {'numbers':>8} {'mean ms':>9} {'median':>9}"
    )
    measure("R-RANSAC", scenes, lambda scans: by_ransac(scans, given.false))
    try:
        measure("GNN, Kalman", scenes, lambda scans: by_stone_soup(scans, given.false, joint=False))
        measure("JPDA", scenes, lambda scans: by_stone_soup(scans, given.false, joint=True))
    except ImportError:
        say("Stone Soup is not installed: pip install -e '.[bench]'")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
