"""The study of the multi-target search: its worlds, its row, its summary, and one trial."""

from dataclasses import replace

import numpy as np
import pytest

from flightsim.payload import GroundTargetParameters, Static, TerrainSpec
from flightsim.payload.target_sensor import TargetSensor
from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.multi_target.options import MultiTargetOptions, PlannerKind
from missions.multi_target.target_field import Deviation
from missions.multi_target.world import terrain_targets_world, world_deviating
from missions.multi_target.world_searchers import search_with_point
from missions.studies import Inline, run_study, run_trial
from missions.studies.multi_target_search import study
from missions.studies.multi_target_trial import EXPERIMENTS, Found, _row
from missions.studies.multi_target_worlds import WORLDS
from missions.studies.options import MultiTargetStudyOptions, Planners
from missions.studies.study import run_of

E2 = EXPERIMENTS["E2"]
OPTIONS = E2.options(PlannerKind.SWEEP, MultiTargetOptions().planning)


def places(seed):
    world = terrain_targets_world(WorldSpec(seed=seed), OPTIONS, counts=E2.counts, clusters=E2.groups)
    return np.array([(t.motion.north_m, t.motion.east_m) for t in world.targets])  # type: ignore[attr-defined]


def test_targets_lie_low_or_high_on_the_terrain_of_their_run():
    south_m, west_m, north_m, east_m = E2.area_m
    spec = TerrainSpec(south_m=south_m, west_m=west_m, north_m=north_m, east_m=east_m, relief_m=25.0)
    means = []
    for seed in range(20):
        terrain, found = spec.made(seed), places(seed)
        means += np.abs(terrain.at(found[:, 0], found[:, 1]) - terrain.height_m.mean()).tolist()
    assert np.mean(means) > 0.8 * 25.0


def test_terrain_places_and_numbers_are_those_of_the_seed():
    assert np.array_equal(places(1), places(1))
    counts = {len(places(seed)) for seed in range(40)}
    assert min(counts) >= 8 and max(counts) <= 20 and len(counts) > 8
    centres = np.array([places(seed).mean(axis=0) for seed in range(40)])
    assert (centres.std(axis=0) > 30.0).all()


def test_the_row_counts_targets_at_the_times_of_the_experiment():
    summary = {
        "found_right_s": [[13.0, 2], [130.0, 7]],
        "targets_true": 14,
        "targets_found_right": 7,
        "targets_found": 8,
        "targets_expected": 9.5,
        "targets_expected_undetected": 2.0,
        "targets_reported": [
            {"mass": 1.02, "width_m": 0.4, "error_m": 0.9},
            {"mass": 0.6, "width_m": 0.4, "error_m": 1.1},
            {"mass": 0.95, "width_m": 0.4, "error_m": None},
        ],
        "gospa_end_m": 3.0,
        "gospa_missed": 6,
        "gospa_false": 1,
        "step_s_mean": 2.5,
        "sim_time_s": 300.0,
    }
    row = _row(E2, summary, True, "")
    time_s = E2.time_s
    assert time_s[-1] == pytest.approx(260.0)
    assert row.found_over_time == tuple(np.where(time_s >= 130.0, 7.0, np.where(time_s >= 13.0, 2.0, 0.0)))
    assert row.area == pytest.approx(np.mean(row.found_over_time) / 14)
    assert (row.found, row.false, row.all_found, row.cardinality_error) == (7, 1, False, -2.5)
    assert (row.stated, row.right) == ((1.0, 0.6, 0.95), (1.0, 1.0, 0.0))
    assert row.inside == (1.0, 0.0)  # 95 % of the errors are within 2.45 standard deviations per axis
    assert _row(E2, {**summary, "found_right_s": []}, True, "").area == 0.0


def made_up(cell, seed):
    """A trial without a flight: the proposed planner finds one target more."""
    experiment = EXPERIMENTS[cell.experiment]
    rng = np.random.default_rng([seed, list(Planners).index(cell.planner)])
    found = np.floor(np.linspace(0.0, 10.0, 61)) + (cell.planner == "proposed") + 0.1 * rng.random()
    return Found(
        completed=True,
        reason="",
        found_over_time=tuple(found.tolist()),
        area=float(found.mean()) / experiment.targets,
        targets=experiment.targets,
        found=10,
        false=2,
        all_found=cell.planner == "proposed",
        gospa_m=1.0 + run_of(seed)[1],
        gospa_missed=4,
        gospa_false=2,
        cardinality_error=-1.5,
        stated=(0.95,) * 12,
        right=(1.0,) * 10 + (0.0,) * 2,
        inside=(1.0,) * 9 + (0.0,),
        step_s=2.5,
        sim_time_s=300.0,
    )


def test_the_summary_has_curves_intervals_differences_terrains_and_worlds(tmp_path):
    options = MultiTargetStudyOptions(
        planner=("proposed", "lawnmower"), world=("nominal", "drift"), belief=("particles", "bernoullis")
    )
    fake = replace(study(options), trial=made_up)
    result = run_study(fake, runs=12, engine=Inline(), out=tmp_path / "study")
    experiments = result.summary["experiments"]
    assert list(experiments) == ["E1", "E2"]
    for name, found in experiments.items():
        assert found["time_s"] == pytest.approx(EXPERIMENTS[name].time_s.tolist(), abs=1e-3)
        for row in found["planners"].values():
            assert len(row["found_mean"]) == len(row["found_ci95"]) == 61
            means = zip(row["found_ci95"], row["found_mean"], strict=True)
            assert all(low <= mean <= high for (low, high), mean in means)
            assert row["gospa_ci95"][0] < row["gospa_m"] == 6.5 < row["gospa_ci95"][1]
        against = found["proposed_minus"]["lawnmower"]
        assert against["conclusive"] and against["never_fewer"]
        assert against["area_difference"] == pytest.approx(1.0 / found["targets"], rel=0.1)
        assert against["least_found_difference"] == pytest.approx(1.0, abs=0.1)
        assert found["planners"]["proposed"]["all_found"] == 12
    assert "terrains" not in experiments["E1"]
    terrains = experiments["E2"]["terrains"]
    assert [row["terrain"] for row in terrains] == list(range(12)) and terrains[3]["targets"] == 14
    worlds = result.summary["worlds"]
    assert list(worlds) == ["nominal", "drift"] and "0.3 m" in worlds["drift"]["differs"]
    drift = worlds["drift"]
    # of both experiments: 10 of 18 and of 14 targets found, and 2 false ones in each of 24 runs
    assert [drift[name] for name in ("runs", "n", "right", "wrong", "undecided")] == [24, 432, 240, 48, 144]
    assert drift["interval"][0] < 240 / 432 < drift["interval"][1]
    assert list(drift["filters"]) == ["particles", "bernoullis"]
    (tenth,) = drift["calibration"]
    assert (tenth["n"], tenth["stated"], tenth["achieved"]) == (288, 0.95, pytest.approx(10 / 12, abs=1e-4))
    assert (drift["inside_95"], drift["cardinality_error"], drift["false_per_run"]) == (0.9, -1.5, 2.0)
    assert (tmp_path / "study" / "found.png").stat().st_size > 10_000


def test_a_world_deviates_in_what_its_name_says():
    base = E2.world(OPTIONS, 5)
    sensor = base.vehicles[0].payload.target_sensor
    double = world_deviating(base, OPTIONS, WORLDS["detection-double"].setting.deviation)
    changed = double.vehicles[0].payload.target_sensor
    assert changed == replace(sensor, forward_scale_m=30.0, right_scale_m=30.0)  # type: ignore[type-var]
    assert double.targets == base.targets
    biased = world_deviating(base, OPTIONS, WORLDS["bias-double"].setting.deviation)
    changed = biased.vehicles[0].payload.target_sensor
    assert changed.range_bias_m == pytest.approx(1.166, abs=1e-3)
    assert np.degrees(changed.bearing_bias_rad) == pytest.approx(4.1, abs=0.05)
    assert world_deviating(base, OPTIONS, Deviation()) == base
    with pytest.raises(PlanError, match="clutter-half"):
        study(MultiTargetStudyOptions(world=("windy",)))


def test_targets_that_walk_spread_by_what_is_stated():
    base = E2.world(OPTIONS, 5)
    walking = world_deviating(base, OPTIONS, Deviation(walk_m_sqrt_s=0.5))
    moves = []
    for target in walking.targets:
        for seed in range(20):
            path = target.motion.start(np.random.default_rng(seed))
            start = path.at(0.0)[:2]
            moves.append(np.subtract(path.at(100.0)[:2], start))
    assert np.std(moves) == pytest.approx(0.5 * 10.0, rel=0.1)


def test_the_estimator_and_the_planner_read_nothing_but_scans(monkeypatch):
    """With the recorded scans and other targets every decision is the same to the bit."""
    options = replace(E2.options(PlannerKind.EXPLORING, MultiTargetOptions().planning, seed=3), steps=12)
    world = E2.world(options, 3)
    scans, step = [], TargetSensor.step

    def recorded(sensor, time_us):
        scans.append(step(sensor, time_us))
        return scans[-1]

    monkeypatch.setattr(TargetSensor, "step", recorded)
    first = search_with_point(options, world)
    replayed = iter(scans)
    monkeypatch.setattr(TargetSensor, "step", lambda sensor, time_us: next(replayed))
    poison = (GroundTargetParameters(motion=Static(north_m=-1e6, east_m=7e5)),)
    second = search_with_point(options, replace(world, targets=poison, seed=99))
    assert sum(len(scan.detections) for scan in scans if scan) > 10
    assert first.places == second.places
    assert first.belief.targets == second.belief.targets and first.belief.targets
    assert not np.isfinite(second.score.errors_m).any()  # only the score reads the truth


def test_a_trial_with_points_has_the_row_of_a_flight():
    whole = study(MultiTargetStudyOptions(points=True, experiment=("E2",), planner=("lawnmower",)))
    row = run_trial(whole, 0, runs=1)
    assert row["completed"] is True and 8 <= row["targets"] <= 20
    assert len(row["stated"]) == len(row["right"]) >= row["found"]


@pytest.mark.slow
def test_a_trial_is_a_flight():
    whole = study(MultiTargetStudyOptions(experiment=("E2",), planner=("proposed",)))
    row = run_trial(whole, 0, runs=1)
    assert row["planner"] == "proposed" and row["experiment"] == "E2"
    assert row["completed"] is True
    assert row["found"] >= 3
