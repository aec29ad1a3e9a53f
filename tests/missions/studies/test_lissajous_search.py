"""The study `lissajous-search`: its statistics of censored times."""

from types import SimpleNamespace

import numpy as np
import pytest

from missions.studies.lissajous_search import (
    PAPER,
    PATTERNS,
    lines_of,
    restricted_mean_s,
    study,
    summarise,
    survival,
)


def test_all_patterns_of_the_table_are_there():
    assert set(PATTERNS) - set(PAPER) == {"ergodic"}
    assert [cell["pattern"] for cell in study().design.cells] == list(PATTERNS)


def test_the_restricted_mean_with_censoring_at_the_limit_is_the_mean_of_the_limited_times():
    rng = np.random.default_rng(2)
    time_s = rng.exponential(900.0, 200)
    found = time_s < 1800.0
    limited = np.minimum(time_s, 1800.0)
    assert restricted_mean_s(limited, found, 1800.0) == pytest.approx(limited.mean(), rel=1e-9)


def test_the_curve_is_that_of_kaplan_and_meier():
    # Freireich et al. 1963, remission times under 6-MP: the textbook example (Kleinbaum and Klein, table 2.1)
    time = np.array(
        [6, 6, 6, 7, 10, 13, 16, 22, 23, 6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35], dtype=float
    )
    found = np.arange(21) < 9
    times, missed = survival(time, found)
    at = {t: missed[np.searchsorted(times, t)] for t in (6.0, 7.0, 10.0, 13.0, 16.0, 22.0, 23.0)}
    assert list(at.values()) == pytest.approx([0.857, 0.807, 0.753, 0.690, 0.627, 0.538, 0.448], abs=5e-4)


def test_no_search_found_anything():
    assert restricted_mean_s(np.full(5, 1800.0), np.zeros(5, dtype=bool), 1800.0) == 1800.0


def test_a_flight_that_failed_counts_with_what_it_searched():
    rows = {
        "found": np.array([[1.0, 1.0, 0.0, np.nan]]),
        "search_s": np.array([[100.0, 200.0, 500.0, np.nan]]),
        "completed": np.array([[1.0, 0.0, 0.0, np.nan]]),
    }
    results = SimpleNamespace(
        cells=[{"pattern": name} for name in PATTERNS],
        values=lambda name: np.repeat(rows[name], len(PATTERNS), axis=0),
    )
    entry = summarise(results)["patterns"]["L1"]
    assert (entry["found"], entry["runs"], entry["mean_s"], entry["median_s"]) == (2, 3, 150.0, 200.0)
    assert entry["restricted_mean_s"] == pytest.approx(100.0 + 100.0 * 2 / 3 + 1600.0 / 3, abs=1e-3)
    assert entry["restricted_mean_ci95_s"] is None  # one search was cut short
    assert entry["minus_parallel_sweep_s"] == 0.0  # the same rows; pairs with a search cut short are left out
    assert any(line.startswith("L1 ") for line in lines_of(results))
