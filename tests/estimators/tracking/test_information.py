"""Mutual information of the detection event: the closed form against Monte Carlo and direct summation."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.tracking.information import detection_information, information_at
from estimators.tracking.range_bearing import RangeBearingSensor, Viewpoint


def summed(mass, probability, terms=20_000):
    """The formula of docs/multi_target.md, term by term; the terms after the last one have P0 = 0."""
    missed = 1.0 - probability
    none = math.exp(-float(mass @ probability))
    k = np.arange(2, terms)
    left = sum(m * (1.0 - q**k) for m, q in zip(mass, missed, strict=True))
    series = float(np.sum(np.exp(-left) / (k * (k - 1.0)))) + math.exp(-float(mass.sum())) / (terms - 1)
    entropy = -none * math.log(none) - (1.0 - none) * math.log1p(-none)
    return entropy + none * float(mass @ (missed * np.log(missed))) - none + series


def entropy_of(p):
    inner = (p > 0.0) & (p < 1.0)
    q = np.where(inner, p, 0.5)
    return np.where(inner, -q * np.log(q) - (1.0 - q) * np.log1p(-q), 0.0)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.003, 0.1, 1.0, 4.0]), st.sampled_from([0.05, 0.5, 0.98]))
def test_closed_form_is_the_sum(seed, scale, largest):
    rng = np.random.default_rng(seed)
    mass, probability = scale * rng.random(12), 0.01 + (largest - 0.01) * rng.random(12)
    assert detection_information(mass, probability) == pytest.approx(summed(mass, probability), abs=3e-7)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_closed_form_is_what_monte_carlo_finds(seed):
    """Sets are drawn from a Poisson process; the error of the estimate is that of both entropies together."""
    rng = np.random.default_rng(seed)
    mass, probability = 0.4 * rng.random(8), 0.05 + 0.9 * rng.random(8)
    counts = rng.poisson(mass, (60_000, 8))
    missed = np.exp(counts @ np.log1p(-probability))  # probability of no detection, given the set
    none = float(missed.mean())
    slope = math.log((1.0 - none) / none)
    terms = slope * missed - entropy_of(missed)  # derivative of the estimate by each sample
    estimate = float(entropy_of(np.array([none]))[0] - entropy_of(missed).mean())
    assert detection_information(mass, probability) == pytest.approx(
        estimate, abs=5.0 * float(terms.std()) / math.sqrt(60_000) + 1e-6
    )


def test_limits():
    assert detection_information(np.zeros(0), np.zeros(0)) == 0.0
    assert detection_information(np.array([2.0]), np.array([0.0])) == 0.0
    # one point, detected for certain: the event is whether there is a target at all
    none = math.exp(-0.7)
    expected = -none * math.log(none) - (1.0 - none) * math.log(1.0 - none)
    assert detection_information(np.array([0.7]), np.array([1.0])) == pytest.approx(expected, rel=1e-6)
    # many targets: the event is certain, and tells nothing
    assert detection_information(np.array([1e4]), np.array([0.9])) == pytest.approx(0.0, abs=1e-9)


def test_viewpoints_are_those_of_the_sensor():
    rng = np.random.default_rng(4)
    north, east, mass = rng.uniform(-50.0, 50.0, 300), rng.uniform(-50.0, 50.0, 300), rng.random(300) * 0.02
    sensor = RangeBearingSensor(forward_scale_m=25.0, right_scale_m=8.0, reach_m=45.0)
    viewpoints = np.array([[0.0, 0.0, 0.3], [20.0, -40.0, -2.0], [500.0, 0.0, 0.0]])
    found = information_at(north, east, mass, sensor.values, viewpoints)
    for value, (n, e, heading) in zip(found, viewpoints, strict=True):
        look = Viewpoint(north_m=n, east_m=e, heading_rad=heading)
        expected = detection_information(mass, sensor.probability(north, east, look))
        assert value == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert found[2] == 0.0
