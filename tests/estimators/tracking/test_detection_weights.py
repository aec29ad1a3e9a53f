"""Weights of correlated detections: the variance that their product claims is that of its error."""

import functools
import math

import numpy as np
import pytest

from estimators.tracking.camera_sight import PoseErrors, rotation_matrix
from estimators.tracking.detection_weights import DetectionWeights
from flightsim.foundation.vectors import from_euler, product

HEIGHT_M = 90.0
DOWN = from_euler(0.0, -0.5 * math.pi, 0.0)
ERRORS = PoseErrors(
    forward_m=0.2, right_m=0.2, height_m=0.3, yaw_rad=0.01, pitch_rad=0.004, roll_rad=0.004,
    mount_rad=0.005, place_time_s=40.0, attitude_time_s=15.0,
)  # fmt: skip


def passes(headings_rad, every_s=40.0, frames=8):
    """(time s, heading, north and east of the camera from the target) of straight passes over a target."""
    for k, heading in enumerate(headings_rad):
        for j in range(frames):
            ahead_m = 25.0 * 0.25 * (j - 0.5 * (frames - 1))
            yield k * every_s + 0.25 * j, heading, (ahead_m * math.cos(heading), ahead_m * math.sin(heading))


def final(headings, rng, errors=ERRORS):
    """Error of the weighted mean of the detections of a flight, and its claimed variance per axis. Everything
    by drawn errors and plain geometry.
    """
    weights = DetectionWeights(errors, 0.0)
    mount = product(DOWN, _small(errors.mount_rad * rng.standard_normal(3)))
    angles, place = rng.standard_normal(3), rng.standard_normal(3)
    total, mean, before_s = 0.0, np.zeros(2), 0.0
    for time_s, heading, (north, east) in passes(headings):
        for state, tau in ((angles, errors.attitude_time_s), (place, errors.place_time_s)):
            rho = math.exp(-(time_s - before_s) / tau)
            state[:] = rho * state + math.sqrt(1.0 - rho * rho) * rng.standard_normal(3)
        before_s = time_s
        reported = from_euler(0.0, 0.0, heading)
        true = from_euler(
            errors.roll_rad * angles[0], errors.pitch_rad * angles[1], heading + errors.yaw_rad * angles[2]
        )
        true_place = np.array([north, east, -HEIGHT_M]) + place * (
            errors.forward_m,
            errors.right_m,
            errors.height_m,
        )
        seen = rotation_matrix(product(true, mount)).T @ -true_place
        ray = (seen[1] / seen[0], seen[2] / seen[0])
        line = rotation_matrix(product(reported, DOWN)) @ (1.0, *ray)
        found = np.array([north, east]) + HEIGHT_M * line[:2] / line[2]
        factor = weights.take(
            round(1e6 * time_s), height_m=HEIGHT_M, q_ned_from_frd=reported, q_frd_from_mount=DOWN, ray=ray
        )
        assert factor >= 1.0
        information = 1.0 / (factor * _variance(errors, heading, ahead(north, east)))
        mean = (total * mean + information * found) / (total + information)
        total += information
    return mean, 1.0 / total


def _small(vector):
    half = 0.5 * vector
    return (1.0, *half.tolist())


def ahead(north, east):
    """Distance of the camera from the target along its way, m, to a centimetre."""
    return round(math.hypot(north, east), 2)


@functools.cache
def _variance(errors, heading, ahead_m):
    """Variance of one detection per axis, taken right above the line: all its causes."""
    total = 0.0
    ray = (0.0, ahead_m / HEIGHT_M)
    for name in ("forward_m", "right_m", "height_m", "yaw_rad", "pitch_rad", "roll_rad", "mount_rad"):
        alone = PoseErrors(
            **(dict.fromkeys(PoseErrors.__dataclass_fields__, 0.0) | {name: getattr(errors, name)})
        )
        one = DetectionWeights(alone, 0.0)
        one.take(
            0, height_m=HEIGHT_M, q_ned_from_frd=from_euler(0.0, 0.0, heading), q_frd_from_mount=DOWN, ray=ray
        )
        total += 1.0 / one.information_m2 if one.information_m2 else 0.0
    return total


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("headings", "least"),
    [
        ([0.0] * 6, 0.85),  # always in the same direction
        ([2.4 * k for k in range(6)], 0.6),  # errors of the mount turn: more precise than is claimed
        ([math.pi * k for k in range(6)], 0.4),
    ],
)
def test_the_claimed_variance_is_that_of_the_error(headings, least):
    rng = np.random.default_rng(4)
    runs = [final(headings, rng) for _ in range(300)]
    nees = np.mean([0.5 * float(error @ error) / variance for error, variance in runs])
    assert least < nees < 1.15


def test_independent_errors_all_count():
    independent = PoseErrors(mount_rad=0.0)
    weights = DetectionWeights(independent, 1e-3)
    for k in range(5):
        factor = weights.take(
            250_000 * k, height_m=60.0, q_ned_from_frd=from_euler(0.0, 0.1, 0.3), q_frd_from_mount=DOWN,
            ray=(0.1, -0.2),
        )  # fmt: skip
        assert factor == pytest.approx(1.0)


def test_a_constant_error_counts_once():
    """A second detection says nothing new, and one in the other direction does."""
    weights = DetectionWeights(
        PoseErrors(**(dict.fromkeys(PoseErrors.__dataclass_fields__, 0.0) | {"mount_rad": 0.005})), 1e-6
    )

    def factor(time_us, heading):
        return weights.take(
            time_us,
            height_m=60.0,
            q_ned_from_frd=from_euler(0.0, 0.0, heading),
            q_frd_from_mount=DOWN,
            ray=(0.0, 0.0),
        )

    assert factor(0, 0.0) == 1.0
    assert factor(1_000_000, 0.0) > 1e4
    assert factor(60_000_000, math.pi) == 1.0
