"""The study of the multi-target search: its worlds, its row, its summary, and one trial."""

import numpy as np
import pytest

from flightsim.payload import TerrainSpec
from flightsim.world_spec import WorldSpec
from missions.multi_target.options import MultiTargetOptions
from missions.multi_target.world import terrain_targets_world
from missions.search.area import edges
from missions.studies import Inline, run_study, run_trial
from missions.studies.design import grid
from missions.studies.multi_target_search import study, summarise
from missions.studies.multi_target_trial import EXPERIMENTS, PLANNERS, Found, _row
from missions.studies.study import Study
from tests.missions.held_options import with_fields

E2 = EXPERIMENTS["E2"]
OPTIONS = with_fields(MultiTargetOptions(), **edges(E2.area_m))


def places(seed, number):
    world = terrain_targets_world(WorldSpec(seed=seed), OPTIONS, number, count=14, clusters=2)
    return np.array([(t.motion.north_m, t.motion.east_m) for t in world.targets])


@pytest.mark.parametrize("number", range(6))
def test_targets_lie_low_on_even_terrains_and_high_on_odd_ones(number):
    south_m, west_m, north_m, east_m = E2.area_m
    spec = TerrainSpec(
        south_m=south_m, west_m=west_m, north_m=north_m, east_m=east_m, relief_m=25.0, stream=number
    )
    terrain = spec.made(0)
    found = np.vstack([places(seed, number) for seed in range(5)])
    heights = terrain.at(found[:, 0], found[:, 1])
    sign = -1.0 if number % 2 == 0 else 1.0
    assert sign * (heights.mean() - terrain.height_m.mean()) > 0.5 * 25.0


def test_the_terrain_is_that_of_its_number_and_the_targets_are_those_of_the_seed():
    assert not np.array_equal(places(1, 0), places(2, 0))
    assert np.array_equal(places(1, 0), places(1, 0))
    assert not np.array_equal(places(1, 0), places(1, 1))


def test_the_row_counts_targets_at_the_times_of_the_experiment():
    summary = {
        "found_right_s": [[13.0, 2], [130.0, 7]],
        "targets_found_right": 7,
        "targets_found": 8,
        "gospa_end_m": 3.0,
        "step_s_mean": 2.5,
        "sim_time_s": 300.0,
    }
    row = _row(E2, summary, True, "", 3)
    time_s = E2.time_s
    assert time_s[-1] == pytest.approx(260.0)
    assert row.found_over_time == tuple(np.where(time_s >= 130.0, 7.0, np.where(time_s >= 13.0, 2.0, 0.0)))
    assert row.area == pytest.approx(np.mean(row.found_over_time) / 14)
    assert (row.found, row.false, row.all_found) == (7, 1, False)
    assert _row(E2, {**summary, "found_right_s": []}, True, "", 3).area == 0.0


def made_up(cell, seed):
    """A trial without a flight: the proposed planner finds one target more."""
    experiment = EXPERIMENTS[cell["experiment"]]
    rng = np.random.default_rng([seed, list(PLANNERS).index(cell["planner"])])
    found = np.floor(np.linspace(0.0, 10.0, 61)) + (cell["planner"] == "proposed") + 0.1 * rng.random()
    return Found(
        completed=True,
        reason="",
        found_over_time=tuple(found.tolist()),
        area=float(found.mean()) / experiment.targets,
        found=10,
        false=0,
        all_found=cell["planner"] == "proposed",
        terrain=seed % 6,
        gospa_m=1.0,
        step_s=2.5,
        sim_time_s=300.0,
    )


def test_the_summary_has_curves_intervals_and_differences(tmp_path):
    whole = study()
    fake = Study(
        name="multi-target",
        trial=made_up,
        row=Found,
        design=grid(experiment=tuple(EXPERIMENTS)) * grid(planner=tuple(PLANNERS)),
        success="completed",
        metrics=(),
        summarise=summarise,
        report=whole.report,
        draw=whole.draw,
    )
    result = run_study(fake, runs=12, engine=Inline(), out=tmp_path / "study")
    experiments = result.summary["experiments"]
    assert list(experiments) == ["E1", "E2"]
    for name, found in experiments.items():
        assert found["time_s"] == pytest.approx(EXPERIMENTS[name].time_s.tolist(), abs=1e-3)
        for planner in PLANNERS:
            row = found["planners"][planner]
            assert len(row["found_mean"]) == len(row["found_ci95"]) == 61
            assert all(low <= mean <= high for (low, high), mean in zip(row["found_ci95"], row["found_mean"],
                                                                        strict=True))  # fmt: skip
        against = found["proposed_minus"]["lawnmower"]
        assert against["conclusive"] and against["never_fewer"]
        assert against["area_difference"] == pytest.approx(1.0 / found["targets"], rel=0.1)
        assert against["least_found_difference"] == pytest.approx(1.0, abs=0.1)
        assert found["planners"]["proposed"]["all_found"] == 12
    assert len(experiments["E2"]["maps"]) == 6
    assert (tmp_path / "study" / "found.png").stat().st_size > 10_000


@pytest.mark.slow
def test_a_trial_is_a_flight():
    number = 3  # the first run of E2, proposed
    row = run_trial(study(), number, runs=1)
    assert row["planner"] == "proposed" and row["experiment"] == "E2"
    assert row["completed"] is True
    assert row["found"] >= 3
