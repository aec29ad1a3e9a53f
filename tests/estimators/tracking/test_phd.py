"""Filters of many targets: weights against an exact reference in NumPy, numbers, clusters, moving targets."""

import math

import numpy as np
import pytest

from estimators.tracking.clusters import find_clusters
from estimators.tracking.gaussian_phd import GaussianPhd
from estimators.tracking.motion import Motion, MotionKind
from estimators.tracking.multi_bernoulli import MultiBernoulli
from estimators.tracking.range_bearing import RangeBearingSensor, Viewpoint
from estimators.tracking.smc_phd import SmcPhd, update_weights

SENSOR = RangeBearingSensor(clutter_per_scan=0.5)
KINDS = ("particles", "gaussians", "bernoullis")


def scan_of(rng, targets, viewpoint, sensor, *, range_sigma=0.5, bearing_sigma=0.03, clutter=0.0):
    """A scan of targets (n, 2), drawn in NumPy from the definition of the sensor."""
    off = np.asarray(targets, dtype=float).reshape(-1, 2) - (viewpoint.north_m, viewpoint.east_m)
    distance = np.hypot(off[:, 0], off[:, 1])
    bearing = np.arctan2(off[:, 1], off[:, 0]) - viewpoint.heading_rad
    zeta = np.hypot(
        distance * np.cos(bearing) / sensor.forward_scale_m, distance * np.sin(bearing) / sensor.right_scale_m
    )
    seen = rng.random(len(off)) < np.where(distance <= sensor.reach_m, sensor.gain * np.exp(-0.5 * zeta), 0.0)
    true = np.column_stack(
        (
            np.abs(distance + range_sigma * rng.standard_normal(len(off))),
            bearing + bearing_sigma * rng.standard_normal(len(off)),
        )
    )
    count = rng.poisson(clutter)
    false = np.column_stack(
        (sensor.reach_m * np.sqrt(rng.random(count)), rng.uniform(-math.pi, math.pi, count))
    )
    return np.vstack((true[seen], false))


def belief_of(kind, sensor, motion=None, seed=0):
    if kind == "particles":
        return SmcPhd(sensor, motion, seed=np.random.SeedSequence(seed))
    return {"gaussians": GaussianPhd, "bernoullis": MultiBernoulli}[kind](sensor, motion)


def constant(density):
    return lambda north, east: np.full(len(north), density)


def test_weights_are_those_of_the_exact_update():
    rng = np.random.default_rng(3)
    count, old = 3000, 2500
    viewpoint = Viewpoint(north_m=20.0, east_m=-10.0, heading_rad=2.8)
    north, east = rng.uniform(-40.0, 60.0, (2, count))
    weight = rng.random(count) * 1e-3
    sensor = RangeBearingSensor(
        forward_scale_m=20.0, right_scale_m=11.0, reach_m=70.0, bearing_sigma_rad=0.2, clutter_per_scan=2.0
    )
    scan = np.array([[12.0, 3.1], [30.0, -1.0], [55.0, 0.4], [0.5, 1.0]])
    clutter = sensor.clutter_density(scan[:, 0])

    dn, de = north - viewpoint.north_m, east - viewpoint.east_m
    distance, bearing = np.hypot(dn, de), np.arctan2(de, dn) - viewpoint.heading_rad
    zeta = np.hypot(distance * np.cos(bearing) / 20.0, distance * np.sin(bearing) / 11.0)
    detected = np.where(distance <= 70.0, 0.98 * np.exp(-0.5 * zeta), 0.0)
    off = np.angle(np.exp(1j * (bearing[:, None] - scan[:, 1])))
    squared = ((distance[:, None] - scan[:, 0]) / sensor.range_sigma_m) ** 2 + (off / 0.2) ** 2
    psi = detected[:, None] * np.exp(-0.5 * squared) / (math.tau * sensor.range_sigma_m * 0.2)
    explained = clutter + weight @ psi
    expected = np.where(np.arange(count) < old, 1.0 - detected, 0.0) + (psi / explained).sum(axis=1)
    expected *= weight

    update_weights(north, east, weight, old, sensor.values, viewpoint.values, scan, clutter)
    # what the gate leaves out is below 1e-17 of a likelihood's peak
    assert weight == pytest.approx(expected, rel=1e-12, abs=1e-18)
    assert np.count_nonzero(weight[old:] > 1e-6) > 20


def test_each_measurement_adds_at_most_one_target():
    """The share of C(z) that targets explain: all of it without clutter (docs/multi_target.md)."""
    belief = belief_of("particles", RangeBearingSensor())
    viewpoint = Viewpoint(north_m=0.0, east_m=0.0)
    belief.update(np.array([[20.0, 0.3], [35.0, -2.0]]), viewpoint, constant(2e-4))
    assert belief.expected_targets == pytest.approx(2.0, abs=1e-3)


def test_clusters_find_separate_masses_and_their_widths():
    rng = np.random.default_rng(2)
    centres = np.array([[0.0, 0.0], [6.0, 1.0], [50.0, -20.0]])
    masses = np.array([1.0, 0.7, 0.4])
    points = np.concatenate([c + 0.4 * rng.standard_normal((500, 2)) for c in centres])
    found = find_clusters(points[:, 0], points[:, 1], np.repeat(masses / 500.0, 500), radius_m=2.0)
    assert [c.mass for c in found] == pytest.approx(masses, abs=0.01)
    for cluster, (north_m, east_m) in zip(found, centres, strict=True):
        assert (cluster.north_m, cluster.east_m) == pytest.approx((north_m, east_m), abs=0.06)
        assert cluster.width_m == pytest.approx(0.4, rel=0.08)
    assert find_clusters(np.zeros(0), np.zeros(0), np.zeros(0), radius_m=2.0) == []


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("clutter", [0.0, 2.0])
@pytest.mark.sampled(2)
def test_the_expected_number_is_that_of_the_targets(kind, clutter):
    """Targets are drawn from the birth intensity, which is thinned by what was seen; over scenes the mean
    error of N_hat is within its statistical bound.
    """
    sensor = RangeBearingSensor(reach_m=40.0, clutter_per_scan=clutter)
    density = 10.0 / (math.pi * 30.0**2)
    errors = []
    for scene in range(25):
        rng = np.random.default_rng(100 + scene)
        radius = 30.0 * np.sqrt(rng.random(rng.poisson(10)))
        turn = math.tau * rng.random(len(radius))
        targets = np.column_stack((radius * np.cos(turn), radius * np.sin(turn)))
        belief = belief_of(kind, sensor, seed=scene)
        looks = []
        for k in range(12):
            viewpoint = Viewpoint(north_m=10.0 * math.cos(k), east_m=10.0 * math.sin(k))

            def birth(north, east, looks=tuple(looks)):
                left = np.full(len(north), density) * (np.hypot(north, east) <= 30.0)
                for look in looks:
                    left *= 1.0 - sensor.probability(north, east, look)
                return left

            belief.predict(1.0)
            belief.update(scan_of(rng, targets, viewpoint, sensor, clutter=clutter), viewpoint, birth)
            looks.append(viewpoint)
        errors.append(belief.expected_targets - len(targets))
    mean, sigma = np.mean(errors), np.std(errors) / math.sqrt(len(errors))
    assert abs(mean) <= 3.0 * sigma + 0.2  # 2 % of ten targets


@pytest.mark.parametrize("kind", KINDS)
def test_targets_with_constant_velocity_are_followed(kind):
    sensor = RangeBearingSensor(forward_scale_m=100.0, right_scale_m=100.0)
    motion = Motion(kind=MotionKind.CONSTANT_VELOCITY, survival_per_s=0.99, speed_sigma_m_s=1.5)
    rng = np.random.default_rng(5)
    belief = belief_of(kind, sensor, motion, seed=5)
    viewpoint = Viewpoint(north_m=0.0, east_m=0.0)
    start, speed = np.array([[15.0, -10.0], [-12.0, 8.0]]), np.array([[-0.6, 0.8], [0.9, 0.3]])
    for k in range(40):
        targets = start + k * speed
        belief.predict(1.0)
        belief.update(scan_of(rng, targets, viewpoint, sensor), viewpoint, constant(2e-4))
    found = [c for c in belief.clusters() if c.mass > 0.5]
    assert belief.expected_targets == pytest.approx(2.0, abs=0.6)
    for north_m, east_m in targets:
        assert min(math.hypot(c.north_m - north_m, c.east_m - east_m) for c in found) < 2.0


@pytest.mark.parametrize("kind", ["particles", "gaussians"])
def test_points_carry_the_mass_and_removal_takes_a_target_out(kind):
    sensor = RangeBearingSensor()
    belief = belief_of(kind, sensor)
    viewpoint = Viewpoint(north_m=0.0, east_m=0.0)
    assert belief.points()[2].sum() == 0.0
    for _ in range(3):
        belief.update(np.array([[20.0, 0.0], [20.0, 1.5]]), viewpoint, constant(2e-4))
    north, _, mass = belief.points()
    assert mass.sum() == pytest.approx(belief.expected_targets)
    assert float(north @ mass) / mass.sum() == pytest.approx(10.0 * (1.0 + math.cos(1.5)), abs=0.5)
    before, cluster = belief.expected_targets, belief.clusters()[0]
    belief.remove(cluster)
    assert belief.expected_targets == pytest.approx(before - 1.0, abs=0.01)
    belief.remove(cluster)  # the rest is less than one target
    assert belief.expected_targets == pytest.approx(before - cluster.mass, abs=0.01)
    assert cluster.mass > 1.0
