"""Whole handoffs of two aircraft in an embedded world."""

import json
from functools import partial

import numpy as np
import pytest

from autopilot_bridge.tlog import TlogReader
from estimators.library import make_estimator
from estimators.log_replay import replay
from estimators.logs import open_log
from flightsim.world_spec import WorldSpec
from missions.base.request import RunRequest
from missions.cli.main import run_command_line
from missions.handoff.mission import HandoffMission
from missions.handoff.options import HandoffOptions
from missions.handoff.walking_targets import PointSource, WalkingTargets
from missions.handoff.world import handoff_world
from missions.runs.session import fly


def flown(out, *, seed=2, picture=False, settings=(), walking=None, **changes):
    options = HandoffOptions(**{"vehicles": 2, "takeover_s": 20.0, **changes})
    world = handoff_world(WorldSpec.of_team(2, seed=seed, model="aerosonde"), options, walking)
    request = RunRequest(
        options=options,
        world=world,
        out=out,
        picture=picture,
        estimator="handoff",
        estimator_settings=settings,
    )
    return fly(HandoffMission(), request)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return flown(tmp_path_factory.mktemp("runs") / "run", picture=True, timeout_s=200.0)


@pytest.mark.slow
def test_the_target_is_handed_over_and_the_tracker_released(run):
    summary = run.summary
    assert (run.outcome, run.reason) == ("completed", "")
    assert 0.0 < summary["converged_after_s"] < 120.0
    assert summary["decided"] and summary["released"] and summary["correct"]
    assert summary["probability"] >= 0.99
    assert summary["decided_after_s"] <= summary["handed_over_after_s"]
    assert summary["tracker"]["messages_decisions"] > 0
    assert (run.folder / "track.png").stat().st_size > 50_000
    json.dumps(summary, allow_nan=False)


@pytest.fixture(scope="module")
def pixel_run(tmp_path_factory):
    """A handoff whose points are found in rendered pictures, which are kept."""
    out = tmp_path_factory.mktemp("runs") / "pixels"
    walking = WalkingTargets(camera=PointSource.PIXELS, film=True)
    return flown(out, picture=True, walking=walking, timeout_s=90.0, takeover_s=5.0)


@pytest.mark.slow
@pytest.mark.timeout(1200)  # pictures take longer than the flight
def test_a_film_of_a_handoff_has_the_points_of_the_flight(pixel_run, tmp_path):
    folder = pixel_run.folder
    assert all((folder / f"camera{k}.png").stat().st_size > 50_000 for k in (1, 2))
    film, log = folder / "camera1.mp4", folder / "flight.tlog"
    words = [str(film), "--camera", str(film.with_suffix(".toml")), "--log", str(log), "--system-id", "1"]
    assert run_command_line(["vision", *words, "--detect", "motion", "--out", str(tmp_path / "again")]) == 0

    def of_camera(path):
        return [frame.payload for _, frame in TlogReader(path) if frame.component_id == 28
                and frame.system_id == 1 and frame.definition.name == "TUNNEL"]  # fmt: skip

    flown_points, found_again = of_camera(log), of_camera(tmp_path / "again" / "flight.tlog")
    assert len(found_again) > 500
    assert found_again == flown_points[: len(found_again)]
    assert len(flown_points) - len(found_again) <= 2  # the log ends before they would have been received


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("which", ["run", "pixel_run"])
def test_the_estimator_beside_the_flight_and_a_replay_have_the_same_numbers(which, request):
    run = request.getfixturevalue(which)
    with np.load(run.folder / "estimates.npz") as file:
        recorded = {name: file[name] for name in file.files}
    settings = run.summary["estimator"]["settings"]
    done = replay(open_log(run.folder / "flight.tlog"), partial(make_estimator, "handoff", settings))
    (runner,) = done.fleet.runners.values()
    (table,) = runner.tables.values()
    assert np.array_equal(recorded["time_us"], table.time_us)
    for column in table.columns:
        assert np.array_equal(recorded[column], table[column], equal_nan=True)
    assert recorded["converged"].any()


@pytest.mark.slow
def test_without_a_decision_in_time_the_flight_fails_and_both_aircraft_land(tmp_path):
    result = flown(tmp_path / "run", timeout_s=5.0)
    assert result.outcome == "failed" and "no track was decided for within 5 s" in result.reason
    assert not result.summary["decided"] and not result.summary["released"]
