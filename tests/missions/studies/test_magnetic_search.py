"""The study `magnetic-search`, and the searches with points that it consists of."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from estimators.magnetic_identification.parameters import IdentificationParameters
from missions.cli.main import run_command_line
from missions.occupancy.options import OccupancyOptions
from missions.occupancy.parameters import Identify
from missions.occupancy.world import drawn_target
from missions.occupancy.world_searchers import search_with_points
from missions.studies import run_study, run_trial
from missions.studies.magnetic_search import report, study, summarise
from missions.studies.options import MagneticStudyOptions

SMALL = OccupancyOptions(
    vehicles=2,
    width_m=900.0,
    height_m=900.0,
    identify=Identify.BAYES,
    search_time_s=200.0,
    identification=IdentificationParameters(particles=800),
)


def test_points_find_the_target_of_the_world_and_a_seed_repeats_itself():
    first, again = (search_with_points(SMALL, 3, false_count=0) for _ in range(2))
    assert first.target_ne_m == drawn_target(SMALL, 3)[0]
    assert first.error_m < 60.0
    assert 0.0 < first.time_s < 200.0
    assert (again.time_s, again.error_m) == (first.time_s, first.error_m)
    assert np.array_equal(again.search.map.scores, first.search.map.scores)


def test_where_there_is_no_target_nothing_is_found_and_its_probability_says_so():
    """Two boats and no target; the search with the target has the same boats, and is sure of it."""
    done = search_with_points(SMALL, 3, false_count=1, absent=True)
    assert done.search.found is None
    assert math.isnan(done.error_m)
    assert done.search.no_target_probability > 0.5 > SMALL.search.no_target_prior
    known = search_with_points(SMALL, 3, false_count=1)
    assert known.error_m < 60.0
    assert known.search.no_target_probability < 0.05


def test_without_a_search_the_probability_of_no_target_is_the_one_before_it():
    done = search_with_points(replace(SMALL, search_time_s=2.0), 3, false_count=0, absent=True)
    assert done.search.no_target_probability == pytest.approx(SMALL.search.no_target_prior, abs=0.02)


def test_a_search_that_is_over_names_nothing():
    done = search_with_points(
        OccupancyOptions(vehicles=1, width_m=900.0, height_m=900.0, search_time_s=2.0), 3, false_count=0
    )
    assert done.search.found is None
    assert (done.time_s, math.isnan(done.error_m)) == (2.0, True)


def test_the_time_of_a_search_that_does_not_name_the_target_is_infinite():
    columns = {
        "target_named": [[1, 0, 0], [1, 1, 1]],
        "false_anomaly_named": [[0, 1, 1], [0, 0, 0]],
        "time_s": [[100.0, 20.0, 30.0], [90.0, 200.0, 300.0]],
        "error_m": [[8.0, 900.0, 700.0], [4.0, 6.0, 10.0]],
        "no_target_probability": [[0.0, 0.5, 0.5], [0.0, 0.0, 0.0]],
    }
    results = SimpleNamespace(
        cells=[{"identify": way, "world": "nominal"} for way in ("threshold", "bayes")],
        finished=np.ones((2, 3), dtype=bool),
        values=lambda name: np.array(columns[name], dtype=np.float64),
    )
    threshold, bayes = summarise(results)["searches"].values()
    assert (threshold["target_named"], threshold["false_anomaly_named"]) == (0.3333, 0.6667)
    assert (threshold["time_s_median"], bayes["time_s_median"]) == (None, 200.0)
    assert (bayes["sooner_than_threshold"], bayes["later_than_threshold"]) == (1.0, 0.0)
    assert (bayes["pairs_that_both_name_it"], bayes["time_to_threshold_s_median_of_pairs"]) == (1, -10.0)
    assert threshold["searches"] == bayes["searches"] == 3
    assert bayes["error_m_median"] == 6.0
    assert "bayes" in report(results)[2]


def test_searches_that_have_not_ended_are_not_counted():
    columns = {
        "target_named": [[1, np.nan, 1], [1, 1, np.nan]],
        "false_anomaly_named": [[0, np.nan, 0], [0, 0, np.nan]],
        "time_s": [[100.0, np.nan, 30.0], [90.0, 200.0, np.nan]],
        "error_m": [[8.0, np.nan, 7.0], [4.0, 6.0, np.nan]],
        "no_target_probability": [[0.0, np.nan, 0.5], [0.0, 0.0, np.nan]],
    }
    results = SimpleNamespace(
        cells=[{"identify": way, "world": "nominal"} for way in ("threshold", "bayes")],
        finished=~np.isnan(columns["time_s"]),
        values=lambda name: np.array(columns[name]),
    )
    bayes = summarise(results)["searches"]["bayes"]
    assert (bayes["searches"], bayes["target_named"], bayes["time_s_median"]) == (2, 1.0, 145.0)
    assert (bayes["sooner_than_threshold"], bayes["time_to_threshold_s_median_of_pairs"]) == (1.0, -10.0)
    results.finished = np.zeros((2, 3), dtype=bool)
    assert summarise(results) == {"searches": {}}


def test_without_the_threshold_nothing_is_compared_with_it():
    chosen = study(MagneticStudyOptions(identify=(Identify.BAYES, Identify.TRACE)))
    assert [cell["identify"] for cell in chosen.design.cells] == ["trace", "bayes"]
    columns = {
        "target_named": [[1, 0], [1, 1]],
        "false_anomaly_named": [[0, 1], [0, 0]],
        "time_s": [[100.0, 20.0], [90.0, 200.0]],
        "error_m": [[8.0, 900.0], [4.0, 6.0]],
        "no_target_probability": [[0.0, 0.5], [0.0, 0.0]],
    }
    results = SimpleNamespace(
        cells=chosen.design.cells,
        finished=np.ones((2, 2), dtype=bool),
        values=lambda name: np.array(columns[name], dtype=np.float64),
    )
    assert "sooner_than_threshold" not in summarise(results)["searches"]["trace"]
    assert [line.split()[-2:] for line in report(results)[1:3]] == [["-", "-"]] * 2


@pytest.mark.slow
@pytest.mark.parametrize("run", range(4))
def test_the_evidence_names_the_target_among_five_false_anomalies(run):
    index = 3 * run + list(Identify).index(Identify.BAYES)
    row = run_trial(study(), index, runs=4)
    assert (row["identify"], row["target_named"], row["false_anomaly_named"]) == ("bayes", True, False)
    assert row["error_m"] < 40.0


@pytest.mark.slow
def test_a_flight_of_the_study_is_that_of_its_command(tmp_path):
    chosen = study(MagneticStudyOptions(identify=(Identify.BAYES,), flights=True))
    result = run_study(chosen, runs=1, out=tmp_path / "study", keep_logs="all", picture=False)
    row = result.results.table.to_pylist()[0]
    words = ["fly", "occupancy", "--vehicles", "3", "--identify", "bayes", "--false-anomalies", "5"]
    assert run_command_line([*words, "--seed", "0", "--no-picture", "--out", str(tmp_path / "fly")]) == 0
    (log,) = (tmp_path / "study").rglob("flight.tlog")
    assert log.read_bytes() == (tmp_path / "fly" / "flight.tlog").read_bytes()
    summary = json.loads((tmp_path / "fly" / "summary.json").read_text(encoding="utf-8"))
    assert (row["target_named"], row["time_s"]) == (True, summary["time_to_find_s"])
    assert (row["error_m"], row["reason"]) == (summary["target_error_m"], "")


def test_its_cells_can_be_stored():
    """Rows are written with the parameters of their cells: plain numbers and texts."""
    assert [type(cell["identify"]) for cell in study().design.cells] == [str] * 3
    assert study().schema.table_schema(study().design.cells[0]) is not None
