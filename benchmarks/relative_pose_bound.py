"""The relative pose by a batch smoother, the bound of the filters: the same ranges, heights, heading, motion.

    python -m benchmarks.relative_pose_bound [--flights 20] [--seconds 45] [--world nominal]

The flights are those of the study `handoff`, opposite orbits around the target, the tracker from the start.
The unknowns are a pose a second, with the noise of motion of the filters between them, and the constant part
of the error of the relative heading. `scipy.optimize.least_squares` finds them from everything up to a time:
first from poses at sixteen bearings around the first range, later from the minima of the time before. Their
weights and covariances are those of Laplace's approximation, and both have converged by the same conditions.
"""

import argparse
import math
import sys
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from estimators.relative_pose import GaussianBank, LevelMotion, PoseMeasurement, RelativePoseParameters
from estimators.relative_pose.particle_belief import motion_array
from estimators.relative_pose.particles import YAW_RATE, displacements
from missions.planning.orbit_guidance import OrbitGuidance, OrbitParameters
from missions.studies.handoff_tracker import SEARCH_ROLL_RAD, orbit_roll
from missions.studies.handoff_trial import HandoffCell, HandoffTrial

Array = NDArray[np.float64]

BEARINGS = 16
SAME_M = 20.0  # minima whose poses are closer are one
RIGHT_M = 20.0  # an error that a converged pose has at most
AT_S = (10, 20, 30, 45)


@dataclass(kw_only=True)
class Second:
    """What both aircraft measured within a second, in their frames at its start.

    Attributes:
        own, other: (n, 2) ways of both since then.
        down, turn: (n,) ways down and turns of the relative heading.
        yaw_rad: (n,) turns of the handoff aircraft.
        measured: (n, 3) range, depth, relative heading; NaN: not measured.
    """

    own: list[Array] = field(default_factory=list)
    other: list[Array] = field(default_factory=list)
    down: list[float] = field(default_factory=list)
    turn: list[float] = field(default_factory=list)
    yaw_rad: list[float] = field(default_factory=list)
    measured: list[Array] = field(default_factory=list)

    def add(self, dt_s: float, own: LevelMotion, other: LevelMotion, measured: PoseMeasurement) -> None:
        """Add a step."""
        o, t = motion_array(own), motion_array(other)
        own_f, own_r, other_f, other_r, down, turn = displacements(o, t, dt_s)
        first = not self.own
        ways = [np.zeros(2) if first else way[-1] for way in (self.own, self.other)]
        yaw = 0.0 if first else self.yaw_rad[-1]
        other_yaw = yaw - (0.0 if first else self.turn[-1])
        self.own.append(ways[0] + _turned(yaw, own_f, own_r))
        self.other.append(ways[1] + _turned(other_yaw, other_f, other_r))
        self.down.append((0.0 if first else self.down[-1]) + down)
        self.turn.append((0.0 if first else self.turn[-1]) + turn)
        self.yaw_rad.append(yaw + float(o[YAW_RATE]) * dt_s)
        self.measured.append(np.array([measured.range_m, measured.down_m, measured.heading_rad]))


def _turned(yaw_rad: float, forward: float, right: float) -> Array:
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([c * forward - s * right, s * forward + c * right])


class Smoother:
    """The poses of all seconds, and the bias of the headings.

    Args:
        parameters: noise of motion and measurements: that of the filters.
    """

    def __init__(self, parameters: RelativePoseParameters) -> None:
        self.parameters = p = parameters
        self._walks = np.array(
            [p.walk_m_sqrt_s, p.walk_m_sqrt_s, p.climb_walk_m_sqrt_s, p.heading_walk_rad_sqrt_s]
        )
        self.minima: list[Array] = []  # (4 n + 1,): poses and bias, the best first
        self.best: tuple[Array, Array, float] | None = None  # last pose, its covariance, its weight

    def solve(self, seconds: list[Second]) -> None:
        """Find the minima with everything measured so far, and the pose at the end of the last second."""
        if not self.minima:
            self._start(seconds)
        minima = []
        for start in self.minima:
            x = start
            while len(x) < 4 * len(seconds) + 1:
                moved = self._moved(x[-5:-1], seconds[(len(x) - 1) // 4 - 1])
                x = np.concatenate((x[:-1], moved, x[-1:]))
            found = least_squares(
                self._residuals, x, self._jacobian, args=(seconds,), method="trf", max_nfev=30
            )
            information = found.jac.T @ found.jac
            log = -found.cost - 0.5 * np.linalg.slogdet(information)[1]
            minima.append((log, found.x, np.linalg.inv(information)))
        minima.sort(key=lambda one: -one[0])
        kept: list[tuple[float, Array, Array]] = []
        for one in minima:
            if one[0] > minima[0][0] - 12.0 and all(
                math.dist(one[1][-5:-3], other[1][-5:-3]) > SAME_M for other in kept
            ):
                kept.append(one)
        self.minima = [one[1] for one in kept]
        weights = np.exp([one[0] - kept[0][0] for one in kept])
        self._end(seconds[-1], kept[0], float(weights[0] / weights.sum()))

    def _start(self, seconds: list[Second]) -> None:
        range_m, down_m, heading = next(m for m in seconds[0].measured if np.isfinite(m).all())
        rho = math.sqrt(max(1.0, range_m**2 - down_m**2))
        for bearing in math.tau * np.arange(BEARINGS) / BEARINGS:
            place = rho * math.cos(bearing), rho * math.sin(bearing)
            self.minima.append(np.array([*place, down_m, heading, 0.0]))

    @staticmethod
    def _moved(pose: Array, second: Second) -> Array:
        """A pose at the end of a second."""
        place = pose[:2] + _turned(-pose[3], *second.other[-1]) - second.own[-1]
        ahead, right = _turned(-second.yaw_rad[-1], *place)
        return np.array([ahead, right, pose[2] + second.down[-1], pose[3] + second.turn[-1]])

    def _end(self, last: Second, one: tuple[float, Array, Array], weight: float) -> None:
        _, x, covariance = one
        pose = x[-5:-1]
        jacobian = np.eye(4)
        c, s = math.cos(last.yaw_rad[-1]), math.sin(last.yaw_rad[-1])
        back = np.array([[c, s], [-s, c]])
        way = _turned(-pose[3], *last.other[-1])
        jacobian[:2, :2], jacobian[:2, 3] = back, back @ np.array([way[1], -way[0]])
        moved = jacobian @ covariance[-5:-1, -5:-1] @ jacobian.T + np.diag(self._walks**2)
        self.best = self._moved(pose, last), moved, weight

    def _residuals(self, x: Array, seconds: list[Second]) -> Array:
        return self._linearized(x, seconds)[0]

    def _jacobian(self, x: Array, seconds: list[Second]) -> Array:
        return self._linearized(x, seconds)[1]

    def _linearized(self, x: Array, seconds: list[Second]) -> tuple[Array, Array]:
        p, bias = self.parameters, x[-1]
        heading_bias_rad = max(p.heading_bias_rad, 1e-4)
        values, rows = [np.array([bias / heading_bias_rad])], [np.zeros((1, len(x)))]
        rows[0][0, -1] = 1.0 / heading_bias_rad
        for k, second in enumerate(seconds):
            pose, at = x[4 * k : 4 * k + 4], 4 * k
            c, s = math.cos(pose[3]), math.sin(pose[3])
            way = np.array(second.other) @ np.array([[c, -s], [s, c]])
            place = pose[:2] + way - np.array(second.own)
            down = pose[2] + np.array(second.down)
            measured = np.array(second.measured)
            range_m = np.sqrt((place**2).sum(axis=1) + down**2)
            turned = np.column_stack((way[:, 1], -way[:, 0]))  # derivative of the way by the heading
            for axis, off, sigma in (
                (0, range_m - measured[:, 0], p.range_sigma_m),
                (1, down - measured[:, 1], p.height_sigma_m),
                (2, pose[3] + np.array(second.turn) + bias - measured[:, 2], p.heading_sigma_rad),
            ):
                seen = np.isfinite(measured[:, axis])
                off = np.remainder(off[seen] + math.pi, math.tau) - math.pi if axis == 2 else off[seen]
                row = np.zeros((len(off), len(x)))
                if axis == 0:
                    row[:, at : at + 2] = place[seen] / range_m[seen, None]
                    row[:, at + 2] = down[seen] / range_m[seen]
                    row[:, at + 3] = (place[seen] * turned[seen]).sum(axis=1) / range_m[seen]
                else:
                    row[:, at + axis + 1] = 1.0
                    row[:, -1] = float(axis == 2)
                values.append(off / sigma)
                rows.append(row / sigma)
            if k + 1 < len(seconds):
                off = x[at + 4 : at + 8] - self._moved(pose, second)
                off[3] = math.remainder(off[3], math.tau)
                row = np.zeros((4, len(x)))
                c, s = math.cos(second.yaw_rad[-1]), math.sin(second.yaw_rad[-1])
                back = np.array([[c, s], [-s, c]])
                row[:, at + 4 : at + 8] = np.eye(4)
                row[:2, at : at + 2] = -back
                row[:2, at + 3] = -back @ turned[-1]
                row[2, at + 2] = row[3, at + 3] = -1.0
                values.append(off / self._walks)
                rows.append(row / self._walks[:, None])
        return np.concatenate(values), np.vstack(rows)


@dataclass(kw_only=True)
class Course:
    """Errors of the tracker's place in a flight.

    Attributes:
        errors_m: by second; NaN: not known.
        right_s: time from which on the pose was converged and right; NaN: never.
    """

    errors_m: list[float] = field(default_factory=list)
    right_s: float = math.nan

    def add(self, second: int, error_m: float, *, converged: bool) -> None:
        """Add a second."""
        self.errors_m.append(error_m)
        if not (converged and error_m < RIGHT_M):
            self.right_s = math.nan
        elif math.isnan(self.right_s):
            self.right_s = second


def flown(seed: int, seconds: int, world_name: str) -> tuple[Course, Course]:
    """The courses of the filter and of the smoother in one flight."""
    trial, cell = HandoffTrial(), HandoffCell(world=world_name)
    world, bank = trial._world(cell, seed), trial._belief(cell, seed)
    assert isinstance(bank, GaussianBank)
    p = bank.parameters
    smoother, taken = Smoother(p), [Second()]
    pilots = [OrbitGuidance(OrbitParameters(radius_m=120.0, direction=d)) for d in (1, -1)]
    rolls, courses = (0.0, 0.0), (Course(), Course())
    dt_s = 1.0 / world.setting.rate_hz
    while world.time_us < 1e6 * seconds:
        world.advance(rolls)
        motions = [world.motion(which) for which in range(2)]
        measured = world.measured()
        bank.predict(dt_s, motions[1], motions[0])
        bank.update(measured)
        taken[-1].add(dt_s, motions[1], motions[0], measured)
        target = world.targets[:1]
        places = [tuple(world.seen_from(which, target)[0].tolist()) for which in range(2)]
        wanted = [
            orbit_roll(pilot, world.time_us, place, world.ground_velocity(k), world.roll_rad(k))
            for k, (pilot, place) in enumerate(zip(pilots, places, strict=True))
        ]
        rolls = (wanted[0], wanted[1] if bank.converged else SEARCH_ROLL_RAD)
        if world.time_us % 1_000_000:
            continue
        second, true = round(1e-6 * world.time_us), world.tracker_from_handoff()
        best = bank.best
        if best is not None:
            off_m = math.dist((best.forward_m, best.right_m), true)
            courses[0].add(second, off_m, converged=bank.converged)
        smoother.solve(taken)
        assert smoother.best is not None
        pose, covariance, weight = smoother.best
        narrow = math.sqrt(covariance[0, 0] + covariance[1, 1]) <= p.converged_sigma_m
        courses[1].add(second, math.dist(pose[:2], true), converged=narrow and weight >= p.converged_weight)
        taken.append(Second())
    return courses


def main() -> int:
    """Fly and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--flights", type=int, default=20)
    parser.add_argument("--seconds", type=int, default=45)
    parser.add_argument("--world", default="nominal")
    given = parser.parse_args()
    courses = [flown(seed, given.seconds, given.world) for seed in range(given.flights)]
    names = ("Gaussians", "smoother")
    sys.stdout.write(f"{given.flights} flights of {given.seconds} s, world {given.world}\n")
    for k, name in enumerate(names):
        times = np.array([pair[k].right_s for pair in courses])
        known = times[np.isfinite(times)]
        sys.stdout.write(
            f"{name:<10} right to the end from {np.median(known):.0f} s (median), {known.max():.0f} s "
            f"(last), in {len(known)} of {len(times)}\n"
        )
    for at_s in (second for second in AT_S if second <= given.seconds):
        both = np.array([[course.errors_m[at_s - 1] for course in pair] for pair in courses])
        medians, squares = np.median(both, axis=0), np.sqrt(np.mean(both**2, axis=0))
        sys.stdout.write(
            f"after {at_s:>3} s error of the place, median: {medians[0]:.1f} m, {medians[1]:.1f} m, "
            f"ratio {medians[0] / medians[1]:.2f}; root mean square: {squares[0]:.1f} m, {squares[1]:.1f} m\n"
        )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
