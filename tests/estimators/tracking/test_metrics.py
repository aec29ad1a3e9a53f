"""Metrics against closed forms, published properties, and brute force over permutations."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import linear_sum_assignment
from scipy.stats import chi2, norm

from estimators.tracking.association import assign
from estimators.tracking.metrics import calibration_error, crps, inside_ellipse, mean_square, nees, rms
from estimators.tracking.ospa import gospa, ospa

sets = st.lists(st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0)), max_size=5).map(
    lambda points: np.array(points, dtype=float).reshape(-1, 2)
)


def by_permutations(estimates, targets, cutoff, order):
    """(least sum of the cut distances to the p-th power over all assignments, least sum of GOSPA's)."""
    few, many = sorted((estimates, targets), key=len)
    cut, partial = [], []
    for chosen in itertools.permutations(range(len(many)), len(few)):
        apart = np.linalg.norm(few - many[list(chosen)], axis=1)
        cut.append(float(np.sum(np.minimum(apart, cutoff) ** order)))
        near = apart < cutoff
        single = len(few) + len(many) - 2 * np.count_nonzero(near)
        partial.append(float(np.sum(apart[near] ** order)) + 0.5 * cutoff**order * single)
    return min(cut), min(partial)


@given(sets, sets, st.floats(1.0, 60.0), st.sampled_from([1.0, 2.0]))
def test_set_metrics_are_the_least_over_all_permutations(estimates, targets, cutoff, order):
    cut, partial = by_permutations(estimates, targets, cutoff, order)
    n, m = len(estimates), len(targets)
    expected = 0.0 if n == m == 0 else ((cut + cutoff**order * abs(n - m)) / max(n, m)) ** (1.0 / order)
    assert ospa(estimates, targets, cutoff=cutoff, order=order) == pytest.approx(expected, abs=1e-9)
    found = gospa(estimates, targets, cutoff=cutoff, order=order)
    assert found.distance == pytest.approx(partial ** (1.0 / order), abs=1e-6)
    parts = found.localization + 0.5 * cutoff**order * (found.missed + found.false)
    assert parts == pytest.approx(partial, abs=1e-6)
    assert m - found.missed == n - found.false


@given(sets, sets, sets)
def test_ospa_is_a_metric(a, b, c):
    def d(x, y):
        return ospa(x, y, cutoff=20.0, order=2.0)

    assert d(a, b) == pytest.approx(d(b, a), abs=1e-9)
    assert d(a, a) == 0.0
    assert d(a, c) <= d(a, b) + d(b, c) + 1e-9


def test_set_metrics_of_sets_that_differ_by_one_target():
    """Schuhmacher et al. 2008, section II: a missing point costs c / n^(1/p); GOSPA: (c^p / 2)^(1/p), for any
    n.
    """
    targets = np.array([[0.0, 0.0], [30.0, 0.0], [60.0, 0.0], [90.0, 0.0]])
    assert ospa(targets[1:], targets, cutoff=10.0, order=2.0) == pytest.approx(5.0)
    assert ospa(np.zeros((0, 2)), targets, cutoff=10.0) == 10.0
    found = gospa(targets[1:], targets, cutoff=10.0, order=2.0)
    assert (found.missed, found.false) == (1, 0)
    assert found.distance == pytest.approx(math.sqrt(50.0))
    moved = targets + np.array([3.0, 4.0])
    assert ospa(moved, targets, cutoff=10.0, order=1.0) == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("estimates", "targets", "cutoff", "order", "distance", "parts"),
    [
        ([], [(15.62, 12.12), (14.2, 1.78), (12.61, 19.62)], 10.0, 2.0, 12.24744871391589, (0.0, 3, 0)),
        (
            [(17.08, 13.98), (4.43, 3.7), (19.08, 6.81)],
            [(8.83, 13.12), (8.81, 0.01), (5.21, 9.44)],
            10.0,
            2.0,
            14.198683037521471,
            (101.6026, 1, 1),
        ),
        (
            [(15.23, 12.13), (8.6, 3.82), (15.69, 3.74), (14.48, 9.95), (11.04, 7.68)],
            [(4.06, 3.4), (12.83, 5.52), (0.28, 3.85)],
            10.0,
            1.0,
            27.36468448165082,
            (7.364684481650817, 1, 3),
        ),
    ],
)
def test_gospa_is_that_of_stone_soup(estimates, targets, cutoff, order, distance, parts):
    """Of its version 1.9.1, `GOSPAMetric(p=order, c=cutoff)`, which states missed and false ones as costs of
    cutoff^order / 2 each.
    """
    found = gospa(
        np.array(estimates).reshape(-1, 2), np.array(targets).reshape(-1, 2), cutoff=cutoff, order=order
    )
    assert found.distance == pytest.approx(distance, rel=1e-12)
    assert (found.localization, found.missed, found.false) == pytest.approx(parts, rel=1e-12)


@given(st.integers(1, 12), st.integers(0, 8), st.integers(0, 2**31))
def test_assignment_is_that_of_scipy(rows, more, seed):
    cost = np.random.default_rng(seed).normal(size=(rows, rows + more))
    found = assign(cost)
    assert len(set(found.tolist())) == rows
    row, column = linear_sum_assignment(cost)
    assert cost[np.arange(rows), found].sum() == pytest.approx(cost[row, column].sum())


@pytest.mark.parametrize(
    ("cost", "reported"), [(np.zeros((3, 2)), "as many columns"), (np.full((1, 1), np.inf), "finite")]
)
def test_an_impossible_assignment_is_refused(cost, reported):
    with pytest.raises(ValueError, match=reported):
        assign(cost)


def test_nees_has_a_chi_square_distribution():
    rng = np.random.default_rng(1)
    root = np.array([[2.0, 0.0], [1.0, 0.5]])
    errors = rng.normal(size=(20_000, 2)) @ root.T
    covariances = np.broadcast_to(root @ root.T, (20_000, 2, 2))
    found = nees(errors, covariances)
    assert found.mean() == pytest.approx(2.0, abs=0.06)
    assert np.mean(found < chi2.ppf(0.9, 2)) == pytest.approx(0.9, abs=0.01)
    assert inside_ellipse(errors, covariances) == pytest.approx(0.95, abs=0.006)
    assert inside_ellipse(2.0 * errors, covariances) < 0.6
    one = nees(np.array([3.0, 0.0]), np.diag([4.0, 1.0]))
    assert one == pytest.approx(9.0 / 4.0)


def test_errors():
    assert rms(np.array([3.0, -4.0])) == pytest.approx(math.sqrt(12.5))
    assert mean_square(np.array([[3.0], [-4.0]])) == pytest.approx(12.5)
    assert math.isnan(rms(np.zeros(0)))


@pytest.mark.parametrize("truth", [-1.5, 0.2, 4.0])
def test_crps_is_the_integral_of_its_definition(truth):
    values, weights = np.array([1.0, -0.5, 2.0, 0.3]), np.array([2.0, 1.0, 0.5, 0.5])

    def square(x):
        return (weights[values <= x].sum() / weights.sum() - (x >= truth)) ** 2

    edges = sorted([*values.tolist(), truth])
    expected = sum(quad(square, a, b)[0] for a, b in itertools.pairwise(edges))
    assert crps(values, weights, truth) == pytest.approx(expected, abs=1e-9)


def test_crps_of_many_samples_of_a_gaussian_is_its_closed_form():
    """Gneiting and Raftery 2007, equation 5."""
    values, z = norm.ppf((np.arange(20_000) + 0.5) / 20_000), 0.7
    closed = z * (2.0 * norm.cdf(z) - 1.0) + 2.0 * norm.pdf(z) - 1.0 / math.sqrt(math.pi)
    assert crps(values, np.ones(20_000), z) == pytest.approx(closed, abs=1e-3)


def test_calibration():
    rng = np.random.default_rng(2)
    stated = rng.uniform(size=50_000)
    assert calibration_error(stated, rng.uniform(size=50_000) < stated) < 0.01
    assert calibration_error(stated, rng.uniform(size=50_000) < stated**2) == pytest.approx(1 / 6, abs=0.01)
