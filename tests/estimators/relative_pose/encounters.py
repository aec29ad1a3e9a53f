"""Two aircraft that fly over the ground in wind, and what they measure of each other; the truth in NED."""

import math
from dataclasses import dataclass

import numpy as np

from estimators.relative_pose import LevelMotion, PoseMeasurement

RATE_HZ = 10
FINE = 10  # steps of the truth in one step of the filter


@dataclass
class Aircraft:
    """A coordinated turn of constant rate."""

    ned: np.ndarray
    heading: float
    speed: float
    rate: float

    def step(self, dt, wind):
        self.heading += 0.5 * self.rate * dt
        self.ned[0] += (self.speed * math.cos(self.heading) + wind[0]) * dt
        self.ned[1] += (self.speed * math.sin(self.heading) + wind[1]) * dt
        self.heading += 0.5 * self.rate * dt


class Encounter:
    """The tracker circles a target; the other aircraft turns gently some way off.

    The measurements have the noise of the paper's study: range 3 m, headings 0.01 rad each.
    """

    def __init__(self, seed, far_m=1500.0):
        self.rng = rng = np.random.default_rng([18, seed])
        self.wind = rng.uniform(-6.0, 6.0, 2)
        angle, far = rng.uniform(-math.pi, math.pi), rng.uniform(300.0, far_m)
        speed = rng.uniform(14.0, 22.0)
        place = rng.uniform(-math.pi, math.pi)
        radius = rng.uniform(100.0, 200.0)
        self.tracker = Aircraft(
            np.array([radius * math.cos(place), radius * math.sin(place), -150.0]),
            place + 0.5 * math.pi,
            speed,
            speed / radius,
        )
        self.handoff = Aircraft(
            np.array([far * math.cos(angle), far * math.sin(angle), -rng.uniform(80.0, 220.0)]),
            rng.uniform(-math.pi, math.pi),
            rng.uniform(14.0, 22.0),
            rng.choice((-1.0, 1.0)) * rng.uniform(0.0, 0.06),
        )

    def step(self):
        """Advance by one step: (own motion, the other's motion, measurement), with noise."""
        for _ in range(FINE):
            for aircraft in (self.tracker, self.handoff):
                aircraft.step(1.0 / (RATE_HZ * FINE), self.wind)
        rng = self.rng

        def motion(aircraft):
            return LevelMotion(
                forward_m_s=aircraft.speed + rng.normal(0.0, 0.3),
                yaw_rate_rad_s=aircraft.rate + rng.normal(0.0, 0.002),
            )

        off = self.tracker.ned - self.handoff.ned
        measured = PoseMeasurement(
            range_m=float(np.linalg.norm(off)) + rng.normal(0.0, 3.0),
            down_m=off[2] + rng.normal(0.0, 1.5),
            heading_rad=self.handoff.heading
            - self.tracker.heading
            + rng.normal(0.0, 0.01)
            - rng.normal(0.0, 0.01),
        )
        return motion(self.handoff), motion(self.tracker), measured

    def true_pose(self):
        """Forward, right, down and relative heading."""
        north, east, down = self.tracker.ned - self.handoff.ned
        c, s = math.cos(self.handoff.heading), math.sin(self.handoff.heading)
        turn = math.remainder(self.handoff.heading - self.tracker.heading, math.tau)
        return np.array([c * north + s * east, -s * north + c * east, down, turn])

    def target_error_m(self, mode):
        """Error of the target's place, which the tracker knows in its own level frame (equation 33)."""
        c, s = math.cos(self.tracker.heading), math.sin(self.tracker.heading)
        north, east = -self.tracker.ned[:2]
        estimated = mode.from_tracker(c * north + s * east, -s * north + c * east)
        north, east = -self.handoff.ned[:2]
        c, s = math.cos(self.handoff.heading), math.sin(self.handoff.heading)
        return math.dist(estimated, (c * north + s * east, -s * north + c * east))


def pose_error(mode, true):
    """Estimate minus truth of forward, right, down and heading."""
    error = np.array([mode.forward_m, mode.right_m, mode.down_m, mode.heading_rad]) - true
    error[3] = math.remainder(error[3], math.tau)
    return error
