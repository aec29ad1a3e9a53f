"""The filter on flights of our own, against the truth."""

import numpy as np
import pytest

from tests.estimators.attitude.wing_flight import PAPER_DEG2, fly_turns


@pytest.mark.slow
def test_one_flight():
    """A calm one, by the truth: better than Table I of Tolman et al. 2021."""
    found = fly_turns(1)
    assert found.bank_deg > 44.0
    assert found.mean_square_deg2[0] < PAPER_DEG2[0]
    assert found.mean_square_deg2[1] < PAPER_DEG2[1]


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_twenty_flights():
    """Wind, light and moderate turbulence, turns to 45 degrees, both autopilots."""
    found = [fly_turns(seed) for seed in range(1, 21)]
    assert min(one.bank_deg for one in found) > 44.0
    mean_squares = np.array([one.mean_square_deg2 for one in found])
    assert (mean_squares.mean(axis=0) <= PAPER_DEG2).all()
    assert mean_squares.max() < 6.0
    assert (np.mean([one.mean_deg for one in found], axis=0) ** 2 < 0.5**2).all()
    # The covariance is honest: errors are about as large as it says, and no larger.
    normalised = np.array([one.normalised for one in found]).mean(axis=0)
    assert ((normalised > 0.2) & (normalised < 1.1)).all()
