"""Anomalies of maps with errors, over seeds: what the map's error makes is none, what a target makes is
one.
"""

import numpy as np
import pytest

from benchmarks.occupancy_anomalies import Case, case_of, seen, targets, wandering
from estimators.errors import EstimatorError
from estimators.occupancy.detection import AnomalyDetector, MapError
from estimators.occupancy.significance import signal_to_noise


@pytest.fixture(scope="module")
def cases() -> list[Case]:
    """Maps with 2 to 3 nT of error."""
    return [case_of(seed, 2.5) for seed in range(3)]


def test_the_error_of_a_map_makes_no_anomalies(cases: list[Case]) -> None:
    false = {trusting: 0 for trusting in (False, True)}
    for case in cases:
        track = wandering(case.seed, 15_000.0)
        for trusting in false:
            own = Case(seed=case.seed, truth=case.truth, published=case.published, trusting=trusting)
            false[trusting] += len(own.anomalies(track, []))
    assert false[True] >= 5  # a map that is taken for the truth makes them
    assert false[False] == 0


def test_targets_are_seen_through_the_error_of_a_map(cases: list[Case]) -> None:
    gaussian = sum(seen(case, targets(case.seed)["Gaussian"]) for case in cases)
    dipole = sum(seen(case, targets(case.seed)["dipole"]) for case in cases)
    assert gaussian >= 35  # of 36
    assert dipole >= 21  # those at 60 m have some 8 nT left


def test_the_ratio_is_that_of_generalised_least_squares() -> None:
    """In pure noise its variance is one for each template; the largest of the bank stays below five."""
    rng = np.random.default_rng(3)
    north_m, east_m = np.arange(0.0, 600.0, 10.0), np.zeros(60)
    apart_m = np.abs(north_m[:, None] - north_m)
    root = np.linalg.cholesky(4.0 * np.exp(-apart_m / 100.0) + 0.25 * np.eye(60))
    ratios = [
        signal_to_noise(
            north_m,
            east_m,
            root @ rng.standard_normal(60) + 100.0,
            noise_nt=0.5,
            map_error_nt=2.0,
            correlation_m=100.0,
        )
        for _ in range(150)
    ]
    assert 0.8 < np.median(ratios) < 2.6
    assert max(ratios) < 4.0


def test_a_map_without_error_is_the_threshold_alone() -> None:
    detector = AnomalyDetector(threshold_nt=3.0)
    values = [0.0] * 20 + [4.0] * 5 + [0.0] * 5
    found = [
        detector.update(100_000 * (k + 1), 48_000.0 + value, 48_000.0, 2.5 * k, 0.0)
        for k, value in enumerate(values)
    ]
    assert sum(anomaly is not None for anomaly in found) == 1


@pytest.mark.parametrize("sigma_nt", [-1.0, float("nan"), float("inf")])
def test_bad_errors_of_maps_are_refused_by_name(sigma_nt: float) -> None:
    with pytest.raises(EstimatorError, match="`map_error_nt`"):
        MapError(sigma_nt=sigma_nt)
