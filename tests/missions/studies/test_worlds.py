"""Worlds of studies by name, verdicts with intervals, and stated against achieved probabilities."""

import numpy as np
import pytest

from missions.errors import PlanError
from missions.studies.calibration import calibration_gap, calibration_of, verdicts_of
from missions.studies.statistics import rate_of, share_interval
from missions.studies.worlds import World, chosen_worlds, described

WORLDS = {
    "nominal": World(setting=0.0),
    "clock": World(setting=0.3, differs="0.3 s late", source="a data sheet"),
    "tilt": World(setting=1.0, differs="1 degree", source="a paper"),
}


def test_mismatched_stands_for_all_worlds_but_the_nominal_one():
    assert chosen_worlds(("mismatched",), WORLDS) == ("clock", "tilt")
    assert chosen_worlds(("tilt", "nominal", "tilt"), WORLDS) == ("nominal", "tilt")
    for asked in (("wide",), ()):
        with pytest.raises(PlanError, match="clock, mismatched, nominal, tilt"):
            chosen_worlds(asked, WORLDS)
    assert described(WORLDS["nominal"]) == {} and described(WORLDS["clock"])["source"] == "a data sheet"


def test_verdicts_count_the_undecided_and_calibrate_the_decisions_alone():
    stated = np.array([0.95] * 60 + [0.55] * 10 + [0.95] * 5 + [np.nan] * 25)
    right = np.arange(100) < 70
    wrong = (np.arange(100) >= 70) & (np.arange(100) < 75)
    found = verdicts_of(right, wrong, stated)
    assert [found[name] for name in ("n", "right", "wrong", "undecided")] == [100, 70, 5, 25]
    assert found["interval"] == pytest.approx(rate_of(70, 100).ci95, abs=1e-4)
    assert found["wrong_interval"] == pytest.approx(rate_of(5, 100).ci95, abs=1e-4)
    low, high = found["calibration"]
    assert (low["from"], low["n"], low["achieved"]) == (0.5, 10, 1.0)
    assert (high["to"], high["n"], high["achieved"]) == (1.0, 65, pytest.approx(60 / 65, abs=1e-4))
    # the bin of ten statements says nothing yet
    assert found["calibration_gap"] == pytest.approx(0.95 - 60 / 65, abs=1e-4)
    assert calibration_gap(found["calibration"][:1]) is None


def test_a_bin_has_its_upper_edge_and_the_first_one_its_lower_edge_too():
    stated = np.array([0.0, 0.1, 0.1001, 1.0])
    assert [row["n"] for row in calibration_of(stated, stated > 0.5)] == [2, 1, 1]


def test_an_interval_over_clusters_is_as_wide_as_their_differences():
    """50 trials in each of 12 maps, on which either all or none is found: 12 values, not 600."""
    maps = np.repeat(np.arange(12), 50)
    share, (low, high) = share_interval(maps % 2 == 0, maps)
    single = rate_of(300, 600).ci95
    assert share == 0.5 and high - low > 4.0 * (single[1] - single[0])
    assert share_interval(maps >= 0, maps)[1] == rate_of(12, 12).ci95
    assert share_interval(maps % 2 == 0, np.arange(600))[1] == single


def test_an_interval_over_clusters_covers_the_share():
    rng = np.random.default_rng(2)
    clusters = np.repeat(np.arange(30), 10)
    covered = 0
    for _ in range(200):
        shares = rng.beta(2.0, 2.0, 30)
        low, high = share_interval(rng.random(300) < shares[clusters], clusters)[1]
        covered += low <= 0.5 <= high
    assert 0.88 < covered / 200 < 0.99
