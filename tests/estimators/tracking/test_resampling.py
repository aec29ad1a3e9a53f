"""Resampling: the next generation has the weights of the last one."""

import numpy as np
import pytest

from estimators.tracking.resampling import effective_count, roulette, systematic

WEIGHTS = np.array([0.05, 0.0, 0.4, 0.25, 0.3])


def counts(chosen):
    return np.bincount(chosen, minlength=len(WEIGHTS))


@pytest.mark.parametrize("start", [0.0, 0.31, 0.999])
def test_systematic_counts_are_within_one_of_their_expectation(start):
    chosen = np.empty(1000, dtype=np.int64)
    systematic(WEIGHTS, start, chosen)
    assert np.all(np.abs(counts(chosen) - 1000 * WEIGHTS) < 1.0 + 1e-9)


def test_roulette_counts_are_multinomial():
    rng, chosen = np.random.default_rng(3), np.empty(1000, dtype=np.int64)
    drawn = np.empty((400, len(WEIGHTS)))
    for k in range(len(drawn)):
        roulette(WEIGHTS, np.sort(rng.random(1000)), chosen)
        drawn[k] = counts(chosen)
    variance = 1000 * WEIGHTS * (1.0 - WEIGHTS)
    assert np.all(np.abs(drawn.mean(axis=0) - 1000 * WEIGHTS) <= 4.0 * np.sqrt(variance / len(drawn)))
    assert drawn.var(axis=0) == pytest.approx(variance, rel=0.35)


def test_rounding_of_the_sum_chooses_nothing_beyond_the_end():
    weights, chosen = np.full(7, 1.0 / 7.0) * (1.0 - 1e-12), np.empty(10, dtype=np.int64)
    systematic(weights, 1.0, chosen)
    assert chosen.max() == 6
    roulette(weights, np.linspace(0.5, 1.0, 10), chosen)
    assert chosen.max() == 6


def test_the_effective_number_lies_between_one_and_all():
    assert effective_count(np.full(50, 0.02)) == pytest.approx(50.0)
    assert effective_count(np.array([0.0, 1.0, 0.0])) == pytest.approx(1.0)
    assert effective_count(np.zeros(4)) == 0.0
