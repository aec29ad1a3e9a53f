"""A belief about a target's place claims the errors that it has: searches with drawn poses, over seeds."""

import math

import numpy as np
import pytest

from estimators.tracking.camera_sight import (
    CameraSight,
    DetectionRate,
    PoseErrors,
    SightModel,
    rotation_matrix,
)
from estimators.tracking.grid import GridLayout
from estimators.tracking.search_grid import SearchGrid
from estimators.tracking.search_particles import SearchParticles
from flightsim.foundation.vectors import from_euler, product

DOWN = from_euler(0.0, -0.5 * math.pi, 0.0)
MODEL = SightModel(
    rate=DetectionRate(peak=0.97, constant=50.0), target_size_m=3.0, false_rate=1e-4, pixel_sigma_px=0.5
)
ERRORS = PoseErrors(forward_m=0.1, right_m=0.1, height_m=0.2, yaw_rad=0.005, pitch_rad=0.004, roll_rad=0.004)
SEARCHES = 60
INSIDE_95 = 5.991


def grid(target, _seed):
    """The paper's cells of 0.67 m: the target is anywhere in its cell."""
    n, e = (round(x / 0.67) * 0.67 for x in target)
    layout = GridLayout.over(width_m=67.0, height_m=67.0, cell_m=0.67, centre_ne_m=(n, e))
    return SearchGrid(layout, MODEL, dtype=np.float32)


def particles(_target, seed):
    """12 m apart, over the paper's square kilometre."""
    layout = GridLayout.over(width_m=1000.0, height_m=1000.0, cell_m=10.0, centre_ne_m=(0.0, 0.0))
    return SearchParticles(layout, MODEL, seed=np.random.SeedSequence(seed))


def frame(target, rng):
    """A frame from about 90 m above the target, whose true pose is drawn about the reported one."""
    offset, heading = rng.uniform(-25.0, 25.0, 2), rng.uniform(-math.pi, math.pi)
    place = np.array([*(target + offset), -90.0])
    e, drawn = ERRORS, rng.standard_normal(6)
    reported = from_euler(0.02, 0.05, heading)
    true = from_euler(
        0.02 + e.roll_rad * drawn[0], 0.05 + e.pitch_rad * drawn[1], heading + e.yaw_rad * drawn[2]
    )
    true_place = place + drawn[3:] * (e.forward_m, e.right_m, e.height_m)
    x, y, z = rotation_matrix(product(true, DOWN)).T @ (np.array([*target, 0.0]) - true_place)
    place_m2, rotation_rad2 = e.covariances(reported, DOWN)
    return CameraSight(
        place_ned_m=tuple(place.tolist()),
        q_ned_from_mount=product(reported, DOWN),
        place_m2=place_m2,
        rotation_rad2=rotation_rad2,
        width_px=1280,
        height_px=720,
        focal_px=914.0,
        detections=np.array([[y / x, z / x]]) + 0.5 / 914.0 * rng.standard_normal((1, 2)),
    )


@pytest.mark.parametrize("frames", [pytest.param(2, marks=pytest.mark.slow), 9])
@pytest.mark.parametrize("make", [grid, particles])
@pytest.mark.sampled(1)
def test_the_claimed_errors_are_those_of_drawn_searches(make, frames):
    """Nine frames leave 0.13 m, a fifth of a cell, and the first one is sharper than the particles are dense.
    After it alone the detection can be false: a belief over all of the area is no Gaussian then.
    """
    squared, errors_m = [], []
    for seed in range(SEARCHES):
        rng = np.random.default_rng(seed)
        target = rng.uniform(-440.0, 440.0, 2)
        belief = make(target, seed)
        for _ in range(frames):
            belief.update(frame(target, rng))
        mean, covariance = belief.moments()
        off = target - mean
        squared.append(float(off @ np.linalg.solve(covariance, off)))
        errors_m.append(math.hypot(*off))
    # of a chi-square with two degrees of freedom the mean of 60 is 2 +- 0.26
    assert 0.6 < 0.5 * np.mean(squared) < 1.4
    assert np.mean(np.array(squared) < INSIDE_95) >= 0.88
    assert np.median(errors_m) < 0.65 / math.sqrt(frames)
