"""The relative pose in opposite orbits: whether it stays right depends on the rates of turn."""

import math

import numpy as np
import pytest

from estimators.relative_pose import GaussianBank, LevelMotion, PoseMeasurement, RelativePoseSettings
from missions.handoff.options import HandoffOptions
from tests.estimators.relative_pose.encounters import Aircraft, pose_error

RATE_HZ = 10


def drift(rng, state, sigma, time_s):
    """A slow error, after one step."""
    dt_s = 1.0 / RATE_HZ
    return state * (1.0 - dt_s / time_s) + sigma * math.sqrt(2.0 * dt_s / time_s) * rng.standard_normal()


def errors(seed, handoff_m, tracker_m, seconds=200):
    """Horizontal errors of the converged pose, m, and its NEES per axis. Beside the noise, headings and
    airspeeds have slow errors, which the belief does not know as such."""
    rng = np.random.default_rng([seed, 31])
    aircraft = []
    for radius_m, direction, down_m in ((handoff_m, -1, -95.0), (tracker_m, 1, -115.0)):
        speed, bearing = 22.0 * (1.0 + rng.normal(0.0, 0.02)), rng.uniform(-math.pi, math.pi)
        place = np.array([radius_m * math.cos(bearing), radius_m * math.sin(bearing), down_m])
        place[:2] += rng.uniform(-20.0, 20.0, 2)
        heading = bearing + direction * 0.5 * math.pi
        aircraft.append(Aircraft(place, heading, speed, direction * speed / radius_m))
    handoff, tracker = aircraft
    pose, compass, speeds = GaussianBank(RelativePoseSettings()), 0.0, [0.0, 0.0]
    found, nees = [], []
    for _ in range(seconds * RATE_HZ):
        for _ in range(10):
            for one in aircraft:
                one.step(0.1 / RATE_HZ, (0.0, 0.0))
        compass = drift(rng, compass, 0.05, 10.0)
        speeds = [drift(rng, state, 0.4, 20.0) for state in speeds]
        motions = [
            LevelMotion(
                forward_m_s=one.speed + slow + rng.normal(0.0, 0.3),
                yaw_rate_rad_s=one.rate + rng.normal(0.0, 0.005),
            )
            for one, slow in zip(aircraft, speeds, strict=True)
        ]
        pose.predict(1.0 / RATE_HZ, *motions)
        off, turned = tracker.ned - handoff.ned, handoff.heading - tracker.heading
        pose.update(
            PoseMeasurement(
                range_m=max(0.0, float(np.linalg.norm(off)) + rng.normal(0.0, 3.0)),
                down_m=off[2] + rng.normal(0.0, 1.5),
                heading_rad=math.remainder(turned + compass, math.tau),
            )
        )
        if pose.converged:
            c, s = math.cos(handoff.heading), math.sin(handoff.heading)
            true = np.array([c * off[0] + s * off[1], -s * off[0] + c * off[1], off[2], turned])
            error = pose_error(pose.best, true)[:2]
            found.append(math.hypot(*error))
            nees.append(0.5 * float(error @ np.linalg.solve(pose.best.covariance[:2, :2], error)))
    return np.array(found), np.array(nees)


@pytest.mark.slow
def test_in_the_missions_orbits_the_pose_stays_right():
    """In orbits of one radius it is more than 20 m off in a fourth of the time."""
    options = HandoffOptions()
    flown = [errors(seed, options.radius_m, options.tracker_radius_m) for seed in range(8)]
    found, nees = (np.concatenate(parts) for parts in zip(*flown, strict=True))
    assert len(found) > 0.8 * 8 * 200 * RATE_HZ
    assert (found > 20.0).mean() < 0.05
    assert nees.mean() < 2.0
    assert options.radius_m != options.tracker_radius_m
