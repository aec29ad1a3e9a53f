"""Found targets: their places, the biases of a sensor, and how far targets walk."""

import math

import numpy as np
import pytest

from estimators.tracking.found_targets import WALKS, FoundTargets
from estimators.tracking.intensity import Cluster
from estimators.tracking.range_bearing import RangeBearingSensor, Viewpoint

SENSOR = RangeBearingSensor()
WALK = 0.03
TARGETS = np.array([(20.0, 10.0), (40.0, -15.0), (60.0, 20.0), (35.0, 45.0)])


def filter_of(**changes):
    known = {"place_sigma_m": 0.3, "range_bias_m": 0.5, "bearing_bias_rad": math.radians(2.0)}
    return FoundTargets(SENSOR, walk_m_sqrt_s=WALK, **known | changes)


def cluster_at(place, width_m=0.4):
    return Cluster(
        north_m=place[0], east_m=place[1], mass=1.0, width_m=width_m,
        covariance_m2=(width_m**2, 0.0, width_m**2),
    )  # fmt: skip


def measurement(place, view, rng, *, range_bias_m=0.0, bearing_bias_rad=0.0):
    off_n, off_e = place[0] - view.north_m, place[1] - view.east_m
    return np.array(
        [
            math.hypot(off_n, off_e) + range_bias_m + 0.6 * rng.standard_normal(),
            math.atan2(off_e, off_n) - view.heading_rad + bearing_bias_rad + 0.035 * rng.standard_normal(),
        ]
    )


def search(seed, *, walk_m_sqrt_s=0.0, steps=120, found=None, **bias):
    """A vehicle flies twice around the targets and measures the near ones; the filter and the true places."""
    rng = np.random.default_rng(seed)
    targets = TARGETS + rng.uniform(-5.0, 5.0, TARGETS.shape)
    found = filter_of() if found is None else found
    for step in range(steps):
        turn = 2.0 * math.tau * step / steps
        view = Viewpoint(
            north_m=40.0 + 35.0 * math.sin(turn), east_m=15.0 + 35.0 * math.cos(turn), heading_rad=-turn
        )
        found.predict(2.0)
        targets = targets + walk_m_sqrt_s * math.sqrt(2.0) * rng.standard_normal(targets.shape)
        for number, place in enumerate(targets):
            if math.dist(place, (view.north_m, view.east_m)) > 45.0:
                continue
            measured = measurement(place, view, rng, **bias)
            if number == len(found):
                (seen,) = SENSOR.places(measured[None] - found.bias(1), view).tolist()
                found.add(cluster_at(seen, 0.8), view, 1)
            elif number < len(found):
                found.take(number, measured, view, 1)
    return found, targets


def distances_squared(found, targets):
    """Squared distances in standard deviations, (n,)."""
    places, covariances = found.places()
    off = places - targets[: len(places)]
    return np.einsum("ni,nij,nj->n", off, np.linalg.inv(covariances), off)


def test_biases_are_estimated_from_several_sides_and_leave_the_places():
    errors, biases = [], []
    for seed in range(4):
        found, targets = search(seed, range_bias_m=1.0, bearing_bias_rad=math.radians(-4.0))
        errors.append(np.abs(found.places()[0] - targets).max())
        biases.append(found.bias(1))
    assert max(errors) < 0.8
    assert np.mean(biases, axis=0) == pytest.approx([1.0, math.radians(-4.0)], abs=0.15)
    plain, targets = search(0, found=filter_of(range_bias_m=0.0, bearing_bias_rad=0.0), range_bias_m=1.0)
    assert np.array_equal(plain.bias(1), [0.0, 0.0])


@pytest.mark.parametrize(
    ("walk", "bias"), [(WALK, {}), (2.0 * WALK, {}), (0.3, {}), (WALK, {"bearing_bias_rad": 0.07})]
)
def test_the_stated_ellipses_hold_the_errors(walk, bias):
    squared = np.concatenate(
        [distances_squared(*search(seed, walk_m_sqrt_s=walk, **bias)) for seed in range(8)]
    )
    assert np.mean(squared < 5.99) > 0.85 and np.mean(squared) < 3.0  # 0.95 and 2 of an exact filter


def test_levels_of_the_walk_are_weighted_by_what_they_predict():
    still, moving = search(1)[0], search(1, walk_m_sqrt_s=0.3)[0]
    assert still.walk_m_sqrt_s == pytest.approx(WALK) and still.levels[-1] < 0.01
    assert moving.walk_m_sqrt_s == pytest.approx(10.0 * WALK) and moving.levels[0] < 0.01


def test_a_target_that_is_not_measured_is_less_and_less_known():
    found, _ = search(2, walk_m_sqrt_s=0.3)
    before = np.trace(found.places()[1], axis1=1, axis2=2)
    found.predict(100.0)
    after = np.trace(found.places()[1], axis1=1, axis2=2)
    walks_m2_s = (WALK * np.array(WALKS)) ** 2
    assert (after - before) == pytest.approx(2.0 * 100.0 * found.levels @ walks_m2_s, rel=1e-6)


def test_a_shared_bias_is_no_distance():
    found = filter_of()
    view = Viewpoint(north_m=0.0, east_m=0.0)
    found.add(cluster_at((30.0, 0.0), 0.2), view, 1)
    beside = np.array([[30.0, 0.0], [30.0, 0.2]])
    here = found.distances(beside, view, 1)[0]
    there = found.distances(beside - (0.0, math.pi), Viewpoint(north_m=60.0, east_m=0.0), 1)[0]
    assert here[0] == pytest.approx(0.0, abs=1e-9) and 1.5 * there[1] < here[1]


def test_a_measurement_of_something_else_is_hardly_used():
    found, _ = search(3)
    before = found.places()[0][0]
    view = Viewpoint(north_m=before[0] - 20.0, east_m=before[1])
    found.take(0, np.array([23.0, 0.15]), view, 1)
    assert np.abs(found.places()[0][0] - before).max() < 0.1


def test_each_vehicle_has_biases_of_its_own():
    found, _ = search(4, range_bias_m=1.0)
    assert abs(found.bias(1)[0] - 1.0) < 0.3 and np.array_equal(found.bias(2), [0.0, 0.0])
    place = found.places()[0][0]
    view = Viewpoint(north_m=place[0] - 15.0, east_m=place[1])
    for _ in range(40):
        found.take(0, np.array([15.0, 0.0]), view, 2)
    assert abs(found.bias(2)[0]) < 0.4 and abs(found.bias(1)[0] - 1.0) < 0.4
