"""Cost of a step of the relative pose: the particle kernels beside NumPy, and the bank of Gaussians.

    python -m benchmarks.relative_pose [--particles 1000] [--repeats 400]

A step is a motion with noise, drawn in it, and an update of the weights by range, depth and heading. NumPy
computes the same from the same random numbers, and its particles and weights are compared with the kernels'.
Times are the best of the repeats, kernel and NumPy in turn. A whole step also resamples when it is due.
"""

import argparse
import math
import sys
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from estimators.relative_pose import (
    GaussianBank,
    LevelMotion,
    ParticlePose,
    PoseMeasurement,
    RelativePoseBelief,
    RelativePoseParameters,
)
from estimators.relative_pose import particles as kernels
from estimators.relative_pose.particle_belief import motion_array

Array = NDArray[np.float64]

OWN = LevelMotion(forward_m_s=18.0, right_m_s=0.5, down_m_s=-0.3, yaw_rate_rad_s=0.1)
OTHER = LevelMotion(forward_m_s=20.0, yaw_rate_rad_s=-0.15)
DT_S = 0.1
SIGMAS = np.array([3.0, 1.5, 0.0141])
WALKS = np.array([0.16, 0.3, 0.003])


class Problem:
    """Particles around a pose, and one step of it."""

    def __init__(self, count: int) -> None:
        rng = self.rng = np.random.default_rng(1)
        angles = rng.normal(0.7, 0.02, count)
        places = rng.normal(0.0, 4.0, (3, count)) + np.array([[300.0], [-120.0], [30.0]])
        self._start = np.array([*places, np.cos(angles), np.sin(angles)])
        self.poses = self._start.copy()
        self.weights = np.full(count, 1.0 / count)
        self.noise = np.empty((kernels.NOISES, count))
        self.fits = np.empty(count)
        self.measured = np.array([326.0, 29.0, 0.69])
        self.own, self.other = motion_array(OWN), motion_array(OTHER)

    def restart(self) -> None:
        """Go back to the start: without resampling the weights would soon be those of one particle."""
        self.poses[:] = self._start
        self.weights[:] = 1.0 / len(self.weights)

    def by_kernel(self) -> None:
        """A step by the kernels."""
        self.rng.standard_normal(out=self.noise)
        kernels.move(self.poses, self.own, self.other, DT_S, self.noise, WALKS)
        kernels.weigh(self.poses, self.weights, self.measured, SIGMAS, self.fits)

    def by_numpy(self) -> None:
        """The same step by NumPy."""
        noise = self.rng.standard_normal(out=self.noise)
        own_f, own_r, other_f, other_r, down, turn = kernels.displacements(self.own, self.other, DT_S)
        x, y, z, c, s = self.poses
        ahead = x + c * other_f + s * other_r - own_f + WALKS[0] * noise[0]
        right = y - s * other_f + c * other_r - own_r + WALKS[0] * noise[1]
        yaw = OWN.yaw_rate_rad_s * DT_S
        x[:], y[:] = (
            math.cos(yaw) * ahead + math.sin(yaw) * right,
            -math.sin(yaw) * ahead + math.cos(yaw) * right,
        )
        z += down + WALKS[1] * noise[2]
        turned = turn + 2.0 * np.arctan(0.5 * WALKS[2] * noise[3])
        cosine, sine = np.cos(turned), np.sin(turned)
        c[:], s[:] = c * cosine - s * sine, s * cosine + c * sine
        off = np.sqrt(x * x + y * y + z * z) - self.measured[0]
        fits = 0.5 * (off / SIGMAS[0]) ** 2 + 0.5 * ((z - self.measured[1]) / SIGMAS[1]) ** 2
        fits += (1.0 - math.cos(self.measured[2]) * c - math.sin(self.measured[2]) * s) / SIGMAS[2] ** 2
        self.weights *= np.exp(fits.min() - fits)
        self.weights /= self.weights.sum()


def in_turn_ms(problems: list[Problem], functions: list[Callable[[], object]], repeats: int) -> list[float]:
    """Shortest time of a call of each, called in turn from the start of its problem."""
    best = [math.inf] * len(functions)
    for _ in range(repeats):
        for k, (problem, function) in enumerate(zip(problems, functions, strict=True)):
            problem.restart()
            start = time.perf_counter()
            function()
            best[k] = min(best[k], time.perf_counter() - start)
    return [1e3 * value for value in best]


def whole_step_us(belief: RelativePoseBelief, repeats: int) -> float:
    """Mean time of a step of a belief that follows a pose which rests in its own frame."""
    still = LevelMotion(forward_m_s=18.0)
    measured = PoseMeasurement(range_m=326.0, down_m=29.0, heading_rad=0.0)
    rng = np.random.default_rng(2)
    turning = [LevelMotion(forward_m_s=18.0 + rng.normal(0.0, 0.3)) for _ in range(8)]
    for k in range(30):
        belief.predict(DT_S, still, turning[k % 8])
        belief.update(measured)
    start = time.perf_counter()
    for k in range(repeats):
        belief.predict(DT_S, still, turning[k % 8])
        belief.update(measured)
    return 1e6 * (time.perf_counter() - start) / repeats


def say(line: str) -> None:
    """Print a line."""
    sys.stdout.write(f"{line}\n")


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--particles", type=int, default=1000)
    parser.add_argument("--repeats", type=int, default=400)
    given = parser.parse_args()
    mine, theirs = Problem(given.particles), Problem(given.particles)
    mine.by_kernel()
    theirs.by_numpy()
    off = max(
        float(np.max(np.abs(mine.poses - theirs.poses))), float(np.max(np.abs(mine.weights - theirs.weights)))
    )
    kernel_ms, numpy_ms = in_turn_ms([mine, theirs], [mine.by_kernel, theirs.by_numpy], given.repeats)
    say(f"{given.particles} particles, motion with noise and weights")
    say(f"kernel {kernel_ms:8.4f} ms")
    say(f"NumPy  {numpy_ms:8.4f} ms, {numpy_ms / kernel_ms:5.1f} times the kernel")
    say(f"largest difference of a coordinate or weight: {off:.1e}")
    parameters = RelativePoseParameters(particles=given.particles, start_particles=given.particles)
    for name, belief in {
        "particles": ParticlePose(parameters),
        "Gaussians": GaussianBank(parameters),
    }.items():
        say(f"a whole step by {name}: {whole_step_us(belief, given.repeats):.0f} us")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
