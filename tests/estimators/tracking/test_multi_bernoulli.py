"""The Poisson multi-Bernoulli filter: association against all of its ways, and updates in closed form."""

import itertools
import math

import numpy as np
import pytest

from estimators.tracking.marginal_association import association_marginals
from estimators.tracking.multi_bernoulli import MultiBernoulli, MultiBernoulliParameters
from estimators.tracking.range_bearing import RangeBearingSensor, Viewpoint

HOME = Viewpoint(north_m=0.0, east_m=0.0)


def constant(density):
    return lambda north, east: np.full(len(north), density)


def counted(odds, new):
    """Marginals by all ways to give each target one measurement or none."""
    n, m = odds.shape
    pairs, total = np.zeros((n, m)), 0.0
    for way in itertools.product(range(-1, m), repeat=n):
        taken = [j for j in way if j >= 0]
        if len(set(taken)) < len(taken):
            continue
        weight = math.prod(odds[i, j] for i, j in enumerate(way) if j >= 0)
        weight *= math.prod(new[j] for j in range(m) if j not in taken)
        total += weight
        for i, j in enumerate(way):
            if j >= 0:
                pairs[i, j] += weight
    return pairs / total


@pytest.mark.parametrize(("n", "m", "within"), [(1, 4, 1e-6), (4, 1, 1e-6), (3, 3, 0.1)])
def test_marginals_are_those_of_all_ways_to_associate(n, m, within):
    """Without a cycle they are exact; these odds, over five decades, are hard ones."""
    rng = np.random.default_rng(4)
    for _ in range(30):
        odds, new = rng.exponential(1.0, (n, m)) ** 3, rng.uniform(0.05, 1.0, m)
        pairs, none = association_marginals(odds, new)
        assert pairs == pytest.approx(counted(odds, new), abs=within)
        assert none == pytest.approx(1.0 - pairs.sum(axis=0), abs=1e-5)
        assert (pairs.sum(axis=1) <= 1.0 + 1e-9).all()


def test_no_target_or_no_measurement_leaves_nothing_to_associate():
    assert association_marginals(np.zeros((0, 2)), np.ones(2))[1].tolist() == [1.0, 1.0]
    assert association_marginals(np.zeros((2, 0)), np.ones(0))[0].shape == (2, 0)


def test_one_measurement_makes_a_target_with_the_odds_of_birth_against_clutter():
    sensor = RangeBearingSensor(clutter_per_scan=2.0, range_sigma_m=0.5, bearing_sigma_rad=0.03)
    belief = MultiBernoulli(sensor)
    belief.update(np.array([[15.0, 0.0]]), HOME, constant(1e-3))
    born = 0.98 * math.exp(-0.5) * 1e-3
    clutter = 2.0 / (math.pi * sensor.reach_m**2)
    (cluster,) = belief.clusters()
    assert cluster.mass == pytest.approx(born / (born + clutter), rel=1e-9)
    assert cluster.covariance_m2 == pytest.approx((0.25, 0.0, 0.45**2), abs=1e-12)

    # missed from above: Bayes' rule with the probability of detection there
    exists, missed = cluster.mass, 1.0 - 0.98
    belief.update(np.zeros((0, 2)), Viewpoint(north_m=15.0, east_m=0.0), constant(0.0))
    (cluster,) = belief.clusters()
    assert cluster.mass == pytest.approx(exists * missed / (1.0 - exists + exists * missed), rel=1e-9)


def test_a_certain_target_stays_certain_when_it_is_missed():
    """The PHD filter leaves it 1 - p_D."""
    belief = MultiBernoulli(RangeBearingSensor())
    belief.update(np.array([[15.0, 0.0]]), HOME, constant(1e-3))
    certain = belief.expected_targets
    assert certain > 0.999
    belief.update(np.zeros((0, 2)), HOME, constant(1e-3))
    assert belief.expected_targets == pytest.approx(certain, abs=1e-3)


def test_two_close_targets_stay_two():
    rng = np.random.default_rng(8)
    belief = MultiBernoulli(RangeBearingSensor())
    places = np.array([[12.0, -0.15], [12.0, 0.15]])  # 3.6 m apart
    for _ in range(25):
        seen = rng.random(2) < 0.6
        scan = places + rng.standard_normal((2, 2)) * (0.5, 0.03)
        belief.update(scan[seen], HOME, constant(1e-5))
    assert belief.expected_targets == pytest.approx(2.0, abs=0.1)
    first, second = belief.clusters()[:2]
    assert math.hypot(first.north_m - second.north_m, first.east_m - second.east_m) == pytest.approx(
        3.6, abs=0.8
    )


def test_the_number_of_targets_is_limited_and_removal_takes_one_out():
    belief = MultiBernoulli(RangeBearingSensor(), parameters=MultiBernoulliParameters(most_targets=3))
    belief.update(np.array([[20.0, 0.5 * k] for k in range(6)]), HOME, constant(1e-3))
    assert len(belief.clusters()) == 3
    first = belief.clusters()[1]
    belief.remove(first)
    assert len(belief.clusters()) == 2 and first not in belief.clusters()
    assert belief.points()[2].sum() == pytest.approx(belief.expected_targets)
