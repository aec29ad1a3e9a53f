"""Statistics: intervals cover what they should, over many samples; values from the literature."""

import math

import numpy as np
import pytest
from scipy import stats

from missions.studies.statistics import (
    figures_of,
    mean_interval,
    median_interval,
    paired_difference,
    paired_rates,
    rate_of,
    unpaired_difference,
    unpaired_rates,
)


def covered(interval, samples, truth: float) -> float:
    """Share of the samples whose interval has the truth."""
    found = [interval(sample) for sample in samples]
    return float(np.mean([low <= truth <= high for low, high in found]))


@pytest.mark.parametrize(("n", "least"), [(6, 0.89), (30, 0.90)])
def test_the_mean_is_in_its_interval(n: int, least: float) -> None:
    """Of skewed values: 300 samples of an exponential distribution."""
    samples = np.random.default_rng(n).exponential(2.0, (300, n))
    assert least - 0.04 < covered(mean_interval, samples, 2.0) < 0.99


@pytest.mark.parametrize("n", [6, 8, 30])
def test_the_median_is_in_its_interval(n: int) -> None:
    samples = np.random.default_rng(n).exponential(2.0, (300, n))
    assert 0.90 < covered(median_interval, samples, 2.0 * math.log(2.0)) <= 1.0


def test_too_few_values_have_no_interval() -> None:
    assert all(map(math.isnan, mean_interval(np.array([1.0]))))
    assert all(map(math.isnan, median_interval(np.arange(5.0))))  # all five cover 1 - 2 / 2^5 = 94 %
    assert median_interval(np.arange(6.0)) == (0.0, 5.0)


def test_of_very_many_values_the_intervals_are_those_of_the_bootstrap() -> None:
    values = np.random.default_rng(0).gamma(2.0, size=6000)
    for interval, statistic in ((mean_interval, np.mean), (median_interval, np.median)):
        expected = stats.bootstrap((values,), statistic, n_resamples=999, rng=1, method="percentile")
        low, high = expected.confidence_interval
        width = high - low
        assert interval(values) == pytest.approx((low, high), abs=0.15 * width)


def test_equal_values_have_a_point() -> None:
    figures = figures_of(np.full(12, 3.0))
    assert figures.mean_ci95 == figures.median_ci95 == (3.0, 3.0) and figures.sd == 0.0


def test_figures_leave_out_what_is_not_finite() -> None:
    values = np.array([1.0, 2.0, 3.0, 4.0, np.nan, np.inf])
    figures = figures_of(values)
    assert (figures.n, figures.mean, figures.median) == (4, 2.5, 2.5)
    assert figures.sd == pytest.approx(math.sqrt(5.0 / 3.0))
    assert figures_of(np.array([np.nan])).n == 0


@pytest.mark.parametrize(
    ("count", "n", "low", "high"),
    # Newcombe 1998 (Statistics in Medicine 17, 857), Table I, method 3
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0000, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_rates_have_wilsons_interval(count: int, n: int, low: float, high: float) -> None:
    assert rate_of(count, n).ci95 == pytest.approx((low, high), abs=5e-5)


def test_no_trials_have_no_rate() -> None:
    rate = rate_of(0, 0)
    assert math.isnan(rate.rate) and rate.ci95 == (0.0, 1.0)


@pytest.mark.parametrize(
    ("counts", "low", "high"),
    # Newcombe 1998 (Statistics in Medicine 17, 873), Table II, method 10
    [((56, 70, 48, 80), 0.0524, 0.3339), ((9, 10, 3, 10), 0.1705, 0.8090), ((10, 10, 0, 20), 0.6791, 1.0)],
)
def test_independent_rates_have_newcombes_interval(counts, low: float, high: float) -> None:
    a, m, b, n = counts
    found = unpaired_rates(np.arange(m) < a, np.arange(n) < b)
    assert found.ci95 == pytest.approx((low, high), abs=5e-5)


def test_pairs_show_what_independent_values_do_not() -> None:
    """A tenth of a difference under noise that both have."""
    generator = np.random.default_rng(4)
    noise = generator.standard_normal(40)
    one, other = noise + 0.1 + 0.05 * generator.standard_normal(40), noise
    paired, unpaired = paired_difference(one, other), unpaired_difference(one, other)
    assert paired.conclusive and not unpaired.conclusive
    assert paired.mean == pytest.approx(unpaired.mean)


def test_the_runs_that_are_needed_show_the_difference_in_four_of_five_studies() -> None:
    generator = np.random.default_rng(8)
    found = paired_difference(0.3 + generator.standard_normal(20), np.zeros(20))
    assert not found.conclusive and found.runs_needed is not None
    deviation = 1.0 / 0.3 * found.mean  # of a population whose true difference is the one that was seen
    exact = ((stats.norm.ppf(0.975) + stats.norm.ppf(0.8)) / 0.3) ** 2 + 2.0
    scaled = paired_difference(np.array([found.mean - deviation, found.mean + deviation] * 3), np.zeros(6))
    assert scaled.runs_needed == pytest.approx(exact * 6 / 5, rel=0.05)  # sd with n - 1
    n = math.ceil(exact)
    shown = [
        paired_difference(0.3 + generator.standard_normal(n), np.zeros(n)).conclusive for _ in range(120)
    ]
    assert 0.68 < np.mean(shown) < 0.92


def test_rates_in_pairs() -> None:
    """Coverage over 400 samples of pairs that agree mostly; equal rates do not differ."""
    generator = np.random.default_rng(2)
    covered_by = 0
    for _ in range(400):
        base = generator.random(30) < 0.8
        other = np.where(generator.random(30) < 0.3, generator.random(30) < 0.5, base)
        low, high = paired_rates(other, base).ci95
        covered_by += low <= 0.7 * 0.8 + 0.3 * 0.5 - 0.8 <= high
    assert 0.91 < covered_by / 400 < 0.99
    same = paired_rates(np.ones(10, dtype=bool), np.ones(10, dtype=bool))
    assert same.mean == 0.0 and not same.conclusive and same.ci95[0] < 0.0 < same.ci95[1]
