"""Cost of the PHD update: the kernel beside NumPy and beside Stone Soup, on one problem and in one run.

    pip install -e '.[bench]'
    python -m benchmarks.phd_filter [--particles 10000] [--births 500] [--detections 6] [--repeats 200]

Particles lie around 18 targets; some of these are detected. The kernel updates all weights by a scan, with
the state-dependent probability of detection. NumPy computes the same without gating, which is also the
reference for the weights. Stone Soup's `SMCPHDUpdater` has a scalar probability of detection and no births,
so it gets the same particles without births and a constant probability; its weights are compared with the
kernel's on that problem. It adds noise to the predicted measurements (`logpdf(..., noise=True)`), which
makes its weights
random: here it is used with that mended. Times are the best of the repeats.
"""

import argparse
import math
import sys
import time
from collections.abc import Callable
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.gaussian_phd import GaussianPhd
from estimators.tracking.information import condensed, information_at
from estimators.tracking.multi_bernoulli import MultiBernoulli
from estimators.tracking.range_bearing import RangeBearingSensor, Viewpoint
from estimators.tracking.smc_phd import SmcPhd, SmcPhdParameters, update_weights

Array = NDArray[np.float64]

TARGETS = 18
SPREAD_M = 1.0
FIELD_M = 60.0


class Problem:
    """One scan and the particles before it."""

    def __init__(self, particles: int, births: int, detections: int, sensor: RangeBearingSensor) -> None:
        rng = np.random.default_rng(1)
        self.sensor = sensor
        self.viewpoint = Viewpoint(north_m=0.0, east_m=0.0, heading_rad=0.4)
        self.old = particles
        self.targets = rng.uniform(-FIELD_M, FIELD_M, (TARGETS, 2))
        around = self.targets[rng.integers(0, TARGETS, particles)]
        born = self.targets[rng.integers(0, detections, births)]
        places = np.vstack((around, born)) + SPREAD_M * rng.standard_normal((particles + births, 2))
        self.north, self.east = np.ascontiguousarray(places.T)
        self.weights = np.concatenate(
            (np.full(particles, TARGETS / particles), np.full(births, 0.01 / max(births, 1)))
        )
        seen = self.targets[:detections]
        bearing = np.arctan2(seen[:, 1], seen[:, 0]) - self.viewpoint.heading_rad
        self.scan = np.column_stack((np.hypot(seen[:, 0], seen[:, 1]), np.angle(np.exp(1j * bearing))))
        self.clutter = np.full(detections, 1e-3)

    def by_kernel(self) -> Array:
        """The weights after the scan."""
        weights = self.weights.copy()
        update_weights(
            self.north,
            self.east,
            weights,
            self.old,
            self.sensor.values,
            self.viewpoint.values,
            self.scan,
            self.clutter,
        )
        return weights

    def by_numpy(self) -> Array:
        """The same by NumPy, every particle with every detection."""
        s = self.sensor
        distance = np.hypot(self.north, self.east)
        bearing = np.arctan2(self.east, self.north) - self.viewpoint.heading_rad
        forward, right = distance * np.cos(bearing), distance * np.sin(bearing)
        zeta = np.hypot(forward / s.forward_scale_m, right / s.right_scale_m)
        detected = np.where(distance <= s.reach_m, s.gain * np.exp(-0.5 * zeta), 0.0)
        off = bearing[:, None] - self.scan[:, 1]
        off = (off + math.pi) % math.tau - math.pi
        squared = ((distance[:, None] - self.scan[:, 0]) / s.range_sigma_m) ** 2
        squared += (off / s.bearing_sigma_rad) ** 2
        peak = 1.0 / (math.tau * s.range_sigma_m * s.bearing_sigma_rad)
        psi = detected[:, None] * peak * np.exp(-0.5 * squared)
        explained = self.clutter + self.weights @ psi
        missed = np.where(np.arange(len(detected)) < self.old, 1.0 - detected, 0.0)
        weights: Array = self.weights * (missed + (psi / explained).sum(axis=1))
        return weights


def stone_soup(problem: Problem) -> Callable[[], Array]:
    """The update by Stone Soup's mended `SMCPHDUpdater`: a function that returns the weights."""
    from stonesoup.models.measurement.nonlinear import CartesianToBearingRange
    from stonesoup.types.array import StateVectors
    from stonesoup.types.detection import Detection, MissedDetection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.multihypothesis import MultipleHypothesis
    from stonesoup.types.prediction import ParticleStatePrediction
    from stonesoup.updater.particle import SMCPHDUpdater

    class Mended(SMCPHDUpdater):  # type: ignore[misc]
        def _get_measurement_loglikelihoods(self, prediction: Any, detections: Any) -> Array:
            columns = [d.measurement_model.logpdf(d, prediction, noise=False) for d in detections]
            return np.column_stack([np.asarray(column, dtype=np.float64) for column in columns])

    sensor, stamp = problem.sensor, datetime(2025, 1, 1)
    model = CartesianToBearingRange(
        ndim_state=2,
        mapping=(0, 1),
        noise_covar=np.diag([sensor.bearing_sigma_rad**2, sensor.range_sigma_m**2]),
    )
    prediction = ParticleStatePrediction(
        StateVectors(np.vstack((problem.north, problem.east))), weight=problem.weights, timestamp=stamp
    )
    prediction.log_weight = np.log(problem.weights)
    hypotheses = [SingleHypothesis(prediction, MissedDetection(timestamp=stamp))]
    for range_m, bearing in problem.scan.tolist():
        wrapped = math.remainder(bearing + problem.viewpoint.heading_rad, math.tau)
        detection = Detection([[wrapped], [range_m]], timestamp=stamp, measurement_model=model)
        hypotheses.append(SingleHypothesis(prediction, detection))
    whole = MultipleHypothesis(hypotheses)
    updater = Mended(
        measurement_model=model,
        prob_detect=sensor.gain,
        clutter_intensity=float(problem.clutter[0]),
        resampler=None,
    )

    def weights() -> Array:
        per_hypothesis = updater.get_log_weights_per_hypothesis(whole)
        found: Array = np.exp(np.asarray(per_hypothesis, dtype=np.float64)).sum(axis=1)
        return found

    return weights


def best_ms(function: Callable[[], object], repeats: int) -> float:
    """Shortest time of a call."""
    function()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def largest_difference(a: Array, b: Array) -> float:
    """Largest relative difference; weights below 1e-18 of the largest count as 0."""
    least = 1e-18 * float(np.max(b))
    return float(np.max(np.abs(a - b) / np.maximum(b, least)))


def say(line: str) -> None:
    """Print a line."""
    sys.stdout.write(f"{line}\n")


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--particles", type=int, default=10_000)
    parser.add_argument("--births", type=int, default=500)
    parser.add_argument("--detections", type=int, default=6)
    parser.add_argument("--repeats", type=int, default=200)
    given = parser.parse_args()
    repeats = given.repeats

    problem = Problem(given.particles, given.births, given.detections, RangeBearingSensor())
    kernel_ms = best_ms(problem.by_kernel, repeats)
    numpy_ms = best_ms(problem.by_numpy, max(3, repeats // 10))
    off = largest_difference(problem.by_kernel(), problem.by_numpy())
    say(f"{given.particles} particles, {given.births} births, {given.detections} detections")
    say(f"kernel {kernel_ms:8.3f} ms")
    say(f"NumPy  {numpy_ms:8.3f} ms, {numpy_ms / kernel_ms:5.1f} times the kernel")
    say(f"largest relative difference of a weight: {off:.1e}")

    flat = RangeBearingSensor(gain=0.9, forward_scale_m=1e20, right_scale_m=1e20, reach_m=1e6)
    same = Problem(given.particles, 0, given.detections, flat)
    try:
        by_peer = stone_soup(same)
    except ImportError:
        say("Stone Soup is not installed: pip install -e '.[bench]'")
    else:
        same_ms, peer_ms = best_ms(same.by_kernel, repeats), best_ms(by_peer, max(3, repeats // 10))
        off = largest_difference(same.by_kernel(), by_peer())
        say("scalar probability of detection, no births:")
        say(f"kernel {same_ms:8.3f} ms")
        say(f"Stone Soup {peer_ms:.2f} ms, {peer_ms / same_ms:.1f} times the kernel")
        say(f"largest relative difference of a weight: {off:.1e}")

    points = (problem.north, problem.east, problem.weights)
    viewpoints = np.array([(9.0 * math.cos(k), 9.0 * math.sin(k), 0.0) for k in range(8)])
    values, some = problem.sensor.values, max(3, repeats // 10)
    whole_ms = best_ms(lambda: information_at(*points, values, viewpoints), some)
    summed_ms = best_ms(lambda: information_at(*condensed(*points, cell_m=1.0), values, viewpoints), some)
    say(f"information at 8 places {whole_ms:.2f} ms; with particles summed by metres {summed_ms:.2f} ms")

    parameters = SmcPhdParameters(births_per_measurement=max(1, given.births // given.detections))
    beliefs: dict[str, Any] = {
        "particles": SmcPhd(problem.sensor, None, parameters, seed=np.random.SeedSequence(1)),
        "Gaussians": GaussianPhd(problem.sensor),
        "Bernoullis": MultiBernoulli(problem.sensor),
    }
    for name, belief in beliefs.items():

        def step(belief: Any = belief) -> None:
            belief.predict(1.0)
            belief.update(problem.scan, problem.viewpoint, lambda n, e: np.full(len(n), 2e-4))
            belief.clusters()

        for _ in range(10):
            step()
        say(f"a whole step by {name}, {given.detections} targets: {best_ms(step, some):.2f} ms")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
