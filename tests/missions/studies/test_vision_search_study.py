"""The study of the vision search: its summary from drawn rows, its error budget, and one trial."""

import json
import math

import numpy as np
import pytest

from missions.studies import Inline, run_study, run_trial
from missions.studies.design import grid
from missions.studies.options import VisionStudyOptions
from missions.studies.study import Study, run_of
from missions.studies.vision_search import draw, error_budget, lines_of, study, summarise
from missions.studies.vision_search_trial import BELIEFS, Localized, VisionSearchCell, VisionSearchTrial


def drawn(cell, seed):
    """Honest beliefs: errors of 1 m per axis, of two aircraft 0.7 m."""
    rng = np.random.default_rng(seed)
    sigma_m = 1.0 if cell.aircraft == "one" else 0.7
    figures = {}
    for belief in BELIEFS:
        n, e = rng.standard_normal(2)
        distance = float(n * n + e * e)
        figures |= {
            f"{belief}_error_m": sigma_m * math.sqrt(distance),
            f"{belief}_sigma_m": sigma_m,
            f"{belief}_distance_squared": distance,
            f"{belief}_inside": float(distance < 5.99),
        }
    figures |= {f"pose_{name}": 0.01 for name in ("forward_m", "pitch_rad")}
    if run_of(seed)[1] == 3:
        raise ValueError("a trial that fails")
    return Localized(
        completed=True,
        reason="",
        localized=True,
        localized_s=100.0 * sigma_m,
        search_s=200.0,
        sim_time_s=300.0,
        figures=figures,
    )


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    own = study()
    made = Study(
        name="vision-search",
        trial=drawn,
        parameters=VisionSearchCell,
        row=Localized,
        design=grid(aircraft=("one", "two")),
        runs=40,
        success="completed",
        metrics=(),
        options=own.options,
        summarise=summarise,
        report=lines_of,
        draw=draw,
    )
    out = tmp_path_factory.mktemp("study") / "run"
    return run_study(made, engine=Inline(), out=out), out


def test_the_summary_has_one_and_two_aircraft(results):
    _, out = results
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    for team, median_m in (("one", 1.18), ("two", 0.82)):
        found = summary[team]
        assert found["median_error_m"] == pytest.approx(median_m, rel=0.25)
        assert 0.85 <= found["inside_ellipse_rate"] <= 1.0
        assert found["runs"] == 39
        assert found["localized"] == 39
        assert set(found["beliefs"]) == {"fine", "coarse", "particles"}
        assert found["beliefs"]["coarse"]["nees_per_axis"] == pytest.approx(1.0, abs=0.4)
    gap = summary["two_minus_one"]
    assert gap["localized_s"] == pytest.approx(-30.0)
    assert gap["error_m_ci95"][0] < gap["error_m"] < gap["error_m_ci95"][1]
    assert summary["pose_errors"]["pitch_rad"] == 0.01
    assert summary["pose_errors"]["yaw_rad"] is None
    assert (out / "errors.png").stat().st_size > 10_000
    assert "two      particles" in (out / "table.txt").read_text(encoding="utf-8")


def test_the_error_budget_is_that_of_the_paper():
    for row in error_budget().values():
        assert row["localization_m"] == pytest.approx(row["paper_m"], rel=0.01)


@pytest.mark.slow
def test_a_trial_flies_and_replays_its_log_through_three_beliefs():
    made = study(VisionStudyOptions(model="iris", side_m=120.0, passes=2))
    assert made.trial == VisionSearchTrial(model="iris", side_m=120.0, passes=2)
    row = run_trial(made, 0, runs=1)
    assert row["completed"] and row["localized"]
    figures = row["figures"]
    for belief, bound_m in (("fine", 1.5), ("particles", 1.5), ("coarse", 9.0)):
        assert figures[f"{belief}_error_m"] < bound_m
    assert figures["coarse_sigma_m"] > 2.0 * figures["fine_sigma_m"]
    assert 0.0 < figures["pose_pitch_rad"] < 0.01
