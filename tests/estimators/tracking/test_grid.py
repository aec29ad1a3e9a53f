"""Grid beliefs: moments against closed forms, probability of detection against drawn targets."""

import math

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.occupancy.detection import DetectionModel
from estimators.tracking.grid import GridBelief, GridLayout

LAYOUT = GridLayout.over(width_m=600.0, height_m=400.0, cell_m=20.0, centre_ne_m=(100.0, -50.0))


def test_moments_and_entropy_of_a_uniform_belief():
    belief = GridBelief(LAYOUT)
    mean, covariance = belief.moments()
    assert mean == pytest.approx([100.0, -50.0])
    assert covariance == pytest.approx(np.diag([400.0**2 / 12.0, 600.0**2 / 12.0]), abs=1e-6)
    assert belief.entropy_nats == pytest.approx(math.log(30 * 20))


def test_a_detection_makes_the_belief_its_likelihood():
    belief = GridBelief(LAYOUT)
    north, east = LAYOUT.centres()
    sigma = np.array([30.0, 50.0])
    along, across = (north - 140.0) / sigma[0], (east - 10.0) / sigma[1]
    belief.update(np.exp(-0.5 * (along**2 + across**2 - 2 * 0.6 * along * across) / (1 - 0.6**2)))
    assert belief.normalize() > 0.0
    mean, covariance = belief.moments()
    assert mean == pytest.approx([140.0, 10.0], abs=1.0)
    assert np.sqrt(np.diag(covariance)) == pytest.approx(sigma, rel=0.03)
    assert covariance[0, 1] / np.prod(sigma) == pytest.approx(0.6, abs=0.05)
    assert math.dist(belief.mode_ne_m, (140.0, 10.0)) < 15.0
    assert belief.probability_of_detection == pytest.approx(0.0, abs=1e-12)


def test_probability_of_detection_and_belief_are_those_of_drawn_targets():
    """Targets are drawn from the prior; those that two passes miss are where the belief says."""
    rng = np.random.default_rng(3)
    model = DetectionModel(probability_overhead=0.8, range_m=60.0)
    passes = (((100.0, -400.0), (100.0, 300.0)), ((-200.0, 50.0), (400.0, 50.0)))
    belief = GridBelief(LAYOUT)
    cells = rng.integers(0, (LAYOUT.rows, LAYOUT.columns), size=(40_000, 2))
    places = np.array([LAYOUT.south_m, LAYOUT.west_m]) + (cells + 0.5) * LAYOUT.cell_m
    missed = np.ones(len(places), dtype=bool)
    for start, end in passes:
        belief.update(1.0 - model.probability(*LAYOUT.centres(), start, end))
        missed &= rng.uniform(size=len(places)) >= model.probability(*places.T, start, end)  # type: ignore[call-arg]
    assert belief.probability_of_detection == pytest.approx(1.0 - missed.mean(), abs=0.01)
    mean, covariance = belief.moments()
    assert mean == pytest.approx(places[missed].mean(axis=0), abs=5.0)
    assert covariance == pytest.approx(np.cov(places[missed].T), abs=0.03 * np.trace(covariance))


def test_nothing_left_is_a_uniform_belief():
    belief = GridBelief(LAYOUT)
    belief.update(np.zeros((LAYOUT.rows, LAYOUT.columns)))
    assert belief.probability_of_detection == 1.0
    assert belief.normalize() == 0.0
    assert belief.mass.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("bad", [np.zeros((20, 30)), -np.ones((20, 30)), np.ones((3, 3))])
def test_a_prior_that_is_no_probability_is_refused(bad):
    with pytest.raises(EstimatorError, match="prior"):
        GridBelief(LAYOUT, bad)
