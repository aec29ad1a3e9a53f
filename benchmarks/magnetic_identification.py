"""Time of one measurement of the paper's particle filter in `magnetic-identification`, beside plain NumPy.

    python -m benchmarks.magnetic_identification [--particles 10000] [--passes 60]

Both do the same: draw the noise of the control, move, weigh, normalize, and resample when the effective
number is low. They fly passes over a target, each from its first measurement on, and alternate measurement by
measurement in one process. The figures are the medians of the passes' means, so resampling has its usual
share, and their ratio.
"""

import argparse
import math
import sys
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.clock.pacing import wall_time_s
from estimators.magnetic_identification import particles as p
from estimators.magnetic_identification.classes import GaussianClass
from estimators.magnetic_identification.confidence import ConfidenceFilter, Control

Array = NDArray[np.float64]

STEP_M = 25.0
CONTROL = Control(forward_m=STEP_M, right_m=0.0, turn_rad=0.0, forward_sigma_m=0.5, turn_sigma_rad=0.02)
VARIANCE_NT2 = 1.05


class PlainFilter:
    """The same filter in NumPy."""

    def __init__(self, of: GaussianClass, particles: Array, weights: Array, rng: np.random.Generator) -> None:
        self.rows, self.weights, self.rng, self.of = particles.copy(), weights.copy(), rng, of

    def step(self, residual_nt: float) -> None:
        """One measurement."""
        of, count = self.of, self.weights.size
        if 1.0 / np.sum(self.weights**2) < 0.5 * count:
            chosen = np.searchsorted(np.cumsum(self.weights), (np.arange(count) + self.rng.random()) / count)
            self.rows = self.rows[:, np.minimum(chosen, count - 1)]
            self.weights = np.full(count, 1.0 / count)
        rows, noise = self.rows, self.rng.standard_normal((2, count))
        cosine, sine = rows[p.COS], rows[p.SIN]
        forward = CONTROL.forward_m + CONTROL.forward_sigma_m * noise[0]
        turn = CONTROL.turn_sigma_rad * noise[1]
        rows[p.X] += cosine * forward
        rows[p.Y] += sine * forward
        rows[p.COS], rows[p.SIN] = (
            cosine * np.cos(turn) - sine * np.sin(turn),
            sine * np.cos(turn) + cosine * np.sin(turn),
        )
        square = (rows[p.X] / of.sigma_along_m) ** 2 + (rows[p.Y] / of.sigma_across_m) ** 2
        residual = residual_nt - of.amplitude_nt * np.exp(-0.5 * square)
        likelihood = np.exp(-0.5 * residual**2 / VARIANCE_NT2)
        self.weights = self.weights * likelihood
        self.weights /= self.weights.sum()


def times_ms(steps: list[Callable[[float], object]], values: Array) -> Array:
    """(steps,) mean time of each step over the measurements of a pass, alternating."""
    found = np.zeros(len(steps))
    for value in values.tolist():
        for n, step in enumerate(steps):
            began_s = wall_time_s()
            step(value)
            found[n] += 1e3 * (wall_time_s() - began_s)
    return found / len(values)


def pass_ms(particles: int, number: int) -> Array:
    """(2,) times of the kernels and of NumPy for a pass over the middle of the target."""
    of = GaussianClass(name="target")
    noise = np.random.default_rng(number)
    along_m = STEP_M * np.arange(-7, 8)
    values = 0.85 * of.amplitude_nt * np.exp(-0.5 * (along_m / 70.0) ** 2)
    values += math.sqrt(VARIANCE_NT2) * noise.standard_normal(len(values))
    compiled = ConfidenceFilter(of, particles, np.random.Generator(np.random.SFC64(number)))
    compiled.start(float(values[0]), VARIANCE_NT2)
    plain = PlainFilter(of, compiled.particles, compiled.weights, noise)
    return times_ms([lambda value: compiled.step(CONTROL, value, VARIANCE_NT2), plain.step], values[1:])


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--particles", type=int, default=10_000)
    parser.add_argument("--passes", type=int, default=60)
    given = parser.parse_args()
    pass_ms(given.particles, 0)  # compiles the kernels
    found = np.median([pass_ms(given.particles, number) for number in range(given.passes)], axis=0)
    sys.stdout.write(
        f"{given.particles} particles, per measurement: kernels {found[0]:.2f} ms, NumPy {found[1]:.2f} ms, "
        f"ratio {found[1] / found[0]:.1f}\n"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
