"""The study of the handoff: its world, one trial, its summary and picture."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from missions.studies import Inline, run_study, run_trial
from missions.studies.handoff import study
from missions.studies.handoff_pixels import PixelWorld
from missions.studies.handoff_surface import draw_surface
from missions.studies.handoff_trial import HandoffCell, HandoffTrial
from missions.studies.handoff_world import HandoffSetting, HandoffWorld
from missions.studies.options import Comparisons, HandoffStudyOptions, Operator, Points

ALL = HandoffStudyOptions(comparison=Comparisons.ALL, trade_off=True, operator=(Operator.WATCHES,))


def test_targets_stay_in_their_area_and_the_noise_is_the_papers():
    world = HandoffWorld(HandoffSetting(wind_m_s=0.0), 3)
    start = world.targets.copy()
    off, headings = [], []
    for _ in range(600):
        world.advance((0.2, -0.1))
        assert (np.abs(world.targets) <= (70.0 + 0.5, 135.0 + 0.5)).all()
        measured = world.measured()
        tracker, handoff = (world.seen_from(k, np.zeros((1, 2)))[0] for k in (0, 1))
        a, b = (aircraft.place for aircraft in world._aircraft)
        if math.isfinite(measured.range_m):
            off.append(measured.range_m - math.hypot(*(a - b), 30.0))
        turn = math.atan2(tracker[1], tracker[0]) - math.atan2(handoff[1], handoff[0])
        bearings = math.atan2(*(-a)[::-1]) - math.atan2(*(-b)[::-1])
        headings.append(math.remainder(measured.heading_rad - turn + bearings, math.tau))
    assert np.hypot(*(world.targets - start).T).min() > 1.0
    assert np.mean(off) == pytest.approx(0.0, abs=0.5) and np.std(off) == pytest.approx(3.0, abs=0.3)
    assert np.std(headings) == pytest.approx(0.01 * math.sqrt(2.0), abs=0.002)
    assert 0.02 < 1.0 - len(off) / 600 < 0.09


def test_a_frame_shows_the_targets_where_they_are():
    setting = HandoffSetting(
        tilt_sigma_rad=0.0, pixel_rad=1e-6, height_sigma_m=0.0, false_points=0.0, detected=0.9, seen_m=0.0
    )
    world = HandoffWorld(setting, 5)
    world.advance((0.0, 0.0))
    seen = []
    for _ in range(40):
        world.advance((0.3, 0.0))
        (target,) = world.seen_from(0, world.targets[:1])
        frame = world.frame(0, (target[0], target[1]))
        places, covariances = frame.places, frame.covariances
        true = world.seen_from(0, world.targets)
        assert len(places) == len(covariances) <= 5
        for place in places:
            assert np.hypot(*(true - place).T).min() < 0.01
        seen.append(len(places) > 0 and np.hypot(*(places - target).T).min() < 0.01)
    assert 0.7 < np.mean(seen) < 1.0  # a tenth is missed


@pytest.mark.slow
def test_a_trial_decides_for_the_target_and_repeats_itself():
    rows = [HandoffTrial(timeout_s=120.0)(HandoffCell(belief="gaussians"), 1) for _ in range(2)]
    assert rows[0] == rows[1]
    assert rows[0].correct and not rows[0].wrong and not rows[0].timeout
    assert rows[0].track_error_m < 15.0 and rows[0].score >= 0.99  # type: ignore[operator]
    assert rows[0].converged_s < rows[0].time_s < 120.0  # type: ignore[operator]


def test_a_trial_that_is_too_short_is_a_timeout():
    row = HandoffTrial(timeout_s=1.0)(HandoffCell(belief="gaussians"), 1)
    assert row.timeout and not row.decided and row.time_s is None
    assert row.cause == "pose never converged"


def test_the_summary_has_the_papers_figures(tmp_path):
    made = study(HandoffStudyOptions(operator=(Operator.ONCE,)))
    result = run_study(made, runs=2, engine=Inline(), out=tmp_path / "handoff")
    folder = Path(result.folder)
    summary = json.loads((folder / "summary.json").read_text())
    names = ("runs", "correct", "correct_ci95", "mean_time_s", "median_time_s", "wrong", "timeouts")
    assert all(name in summary for name in names)
    assert summary["runs"] == 2 == summary["correct"] + summary["wrong"] + summary["timeouts"]
    low, high = summary["correct_ci95"]
    assert low <= summary["correct"] / 2 <= high
    assert 10.0 < summary["mean_time_s"] < 900.0
    assert summary["paper"]["correct"] == 486
    once, nominal = summary["operators"]["once"], summary["worlds"]["nominal"]
    assert once["n"] == once["right"] + once["wrong"] + once["undecided"] == 2
    assert once["mean_requests"] == 1.0 and nominal["interval"] == once["interval"]
    assert (folder / "handoff.png").stat().st_size > 10_000
    assert "evidence" in (folder / "table.txt").read_text()


def test_the_trade_off_has_windows_and_thresholds():
    made = study(ALL)
    cells = [(cell["comparison"], cell["window"], cell["residual_m"]) for cell in made.design.cells]
    assert ("paper", 100, 15.0) in cells and ("rms", 25, 1.0) in cells and ("evidence", 50, 15.0) in cells
    assert len(set(cells)) == len(cells) == 21
    assert run_trial(study(HandoffStudyOptions(window=50)), 0, runs=1)["window"] == 50


def test_pixels_have_the_papers_frames_and_ranges_keep_their_10_hz():
    rates = [study(HandoffStudyOptions(camera=camera)).options["rate_hz"] for camera in Points]
    assert rates == [10.0, 30.0] and study(HandoffStudyOptions(rate_hz=5.0)).options["rate_hz"] == 5.0
    world, known = HandoffWorld(HandoffSetting(rate_hz=30.0, range_missing=0.0), 1), []
    for _ in range(30):
        world.advance((0.2, 0.2))
        known.append(math.isfinite(world.measured().range_m))
    assert world.time_us == 1_000_000 and sum(known) == 10


def test_the_surface_of_the_trade_off_is_drawn_without_decisions_too(tmp_path):
    cells = [
        {"comparison": kind, "window": 100, "residual_m": residual_m, "runs": 4, "correct": correct,
         "correct_ci95": [0.1, 0.9], "mean_time_s": 80.0 if correct else None}
        for kind, residual_m, correct in (("paper", 10.0, 0), ("paper", 15.0, 2), ("evidence", 15.0, 4))
    ]  # fmt: skip
    draw_surface(cells, {"runs": 500, "correct": 486, "mean_time_s": 314.0}, 900.0, tmp_path)
    assert (tmp_path / "trade_off.png").stat().st_size > 10_000


def test_all_cells_of_the_trade_off_judge_one_flight():
    trial = study(replace(ALL, timeout_s=1.0)).trial
    rows = [trial(cell, 1) for cell in trial.cells]  # type: ignore[attr-defined]
    assert len(rows) == 21 and all(row == rows[0] for row in rows)
    assert rows[0].timeout and rows[0].cause == "pose never converged"


@pytest.mark.slow
def test_a_flight_is_decided_by_some_cells_and_not_by_others():
    trial = study(replace(ALL, timeout_s=120.0)).trial
    rows = {(cell.comparison, cell.window, cell.residual_m): trial(cell, 3) for cell in trial.cells}  # type: ignore[attr-defined]
    assert all(rows["evidence", window, 15.0].correct for window in (25, 50, 100))
    assert rows["paper", 100, 10.0].timeout
    for kind, window in (("paper", 50), ("rms", 25)):  # a wider threshold matches earlier
        times = [row.time_s or 120.0 for (k, w, _), row in sorted(rows.items()) if (k, w) == (kind, window)]
        assert times == sorted(times, reverse=True)
    # the flight ends with the last decision, and all cells are of the same one
    assert len({row.converged_s for row in rows.values()}) == 1


@pytest.mark.slow
def test_the_front_end_finds_the_walkers_in_the_pictures_of_the_study():
    """The places agree with the truth within the errors of roll and pitch, which move all of them alike."""
    world = PixelWorld(HandoffSetting(), 4)
    which, searched, found, true = HandoffWorld.TRACKER, 0, 0, 0
    for _ in range(60):
        world.advance((0.27, 0.0))
        targets = world.seen_from(which, world.targets)
        frame = world.frame(which, tuple(targets[0].tolist()))
        if frame is None:
            continue
        searched += 1
        off = np.hypot(*(frame.places[:, None] - targets).transpose(2, 0, 1)).min(axis=1, initial=np.inf)
        found, true = found + len(off), true + int((off < 15.0).sum())
    assert searched == 60 - 16 and found > searched
    assert true / found > 0.9
