"""Whole searches in embedded worlds: a target that is found and localized, a team over a lossy link."""

import json
from functools import partial

import numpy as np
import pytest

from estimators.library import make_estimator
from estimators.log_replay import replay
from estimators.logs import open_log
from flightsim.world_spec import WorldSpec
from missions.embedded import HiddenTag, vision_search_world
from missions.runs.request import RunRequest
from missions.runs.session import fly
from missions.vision_search.mission import VisionSearchMission
from missions.vision_search.options import VisionSearchOptions

SMALL = {"altitude_m": 15.0, "area_m": (-20.0, -20.0, 20.0, 20.0), "step_m": 8.0, "tag_size_m": 0.6}


def flown(out, *, hidden=None, picture=False, mission=None, **changes):
    options = VisionSearchOptions(**{**SMALL, **changes})
    world = vision_search_world(WorldSpec.of_team(options.vehicles, seed=4), options, hidden)
    request = RunRequest(options=options, world=world, out=out, picture=picture, estimator="vision-search")
    return fly(mission or VisionSearchMission(), request)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    mission = VisionSearchMission()
    hidden = HiddenTag(place_ne_m=(8.0, -5.0))
    out = tmp_path_factory.mktemp("runs") / "run"
    return flown(out, hidden=hidden, picture=True, mission=mission, passes=2), mission


def test_the_target_is_found_and_localized(run):
    result, _ = run
    summary = result.summary
    assert (result.outcome, result.reason) == ("completed", "")
    assert summary["localized"] and summary["search_end"] == "all passes are flown"
    assert summary["error_m"] < 1.0
    assert summary["sigma_m"] < 1.0
    assert (summary["target_north_m"], summary["target_east_m"]) == pytest.approx((8.0, -5.0), abs=0.5)
    assert summary["beliefs"][0]["detections"] >= 3
    assert 0.0 < summary["pose_errors"]["1"]["pitch_rad"] < 0.01
    assert {path.name for path in result.folder.iterdir()} >= {"flight.tlog", "summary.json", "track.png"}
    json.dumps(summary, allow_nan=False)


def test_the_mission_and_the_estimator_beside_it_and_a_replay_have_the_same_numbers(run):
    result, mission = run
    with np.load(result.folder / "estimates.npz") as file:
        recorded = {name: file[name] for name in file.files}
    states = mission._flown.team.search.states[0]
    rows = np.array([state.row() for state in states])
    names = states[0].COLUMNS
    index = np.searchsorted(recorded["time_us"], [state.time_us for state in states])
    assert len(states) > 8
    for name, values in zip(names, rows.T, strict=True):
        assert np.array_equal(recorded[name][index], values)
    settings = result.summary["estimator"]["settings"]
    done = replay(open_log(result.folder / "flight.tlog"), partial(make_estimator, "vision-search", settings))
    (runner,) = done.fleet.runners.values()
    (table,) = runner.tables.values()
    assert np.array_equal(recorded["time_us"], table.time_us)
    for column in table.columns:
        assert np.array_equal(recorded[column], table[column])


@pytest.mark.slow
@pytest.mark.parametrize("belief", ["grid", "particles"])
def test_a_team_over_a_lossy_link_finds_the_target(tmp_path, belief):
    """A third of the likelihoods is lost, the others are late, and each is sent twice."""
    result = flown(
        tmp_path / "run", vehicles=2, passes=4, belief=belief, link_loss=0.3, link_delay_s=1.0, link_repeats=2
    )
    summary = result.summary
    assert result.outcome == "completed"
    assert summary["localized"]
    counts = summary["likelihoods"]
    assert 0.25 < counts["lost"] / counts["sent"] < 0.35
    for belief in summary["beliefs"]:
        assert belief["error_m"] < 1.5
        remarks = belief["estimator_remarks"]
        assert remarks["frames_repeated"] > 20 and remarks["frames_late"] > 20
    assert summary["beliefs_apart_m"] < 0.5


@pytest.mark.slow
def test_vehicles_with_a_lossless_link_agree(tmp_path):
    summary = flown(tmp_path / "run", vehicles=2, passes=2).summary
    assert summary["beliefs_apart_m"] < 0.05
    assert summary["likelihoods"] == {
        "delivered": summary["likelihoods"]["sent"], "sent": summary["likelihoods"]["sent"]
    }  # fmt: skip


@pytest.mark.slow
def test_a_search_without_a_target_ends_with_its_time(tmp_path):
    """The tag of another number is not the target."""
    options = VisionSearchOptions(**SMALL, search_time_s=60.0, tag_id=3)
    world = vision_search_world(WorldSpec.of_team(1, seed=4), VisionSearchOptions(**SMALL))
    request = RunRequest(options=options, world=world, out=tmp_path / "run", picture=True)
    result = fly(VisionSearchMission(), request)
    summary = result.summary
    assert result.outcome == "completed"
    assert not summary["localized"] and summary["search_end"] == "the search time is over"
    assert summary["beliefs"][0]["probability_of_detection"] > 0.8
    assert summary["beliefs"][0]["estimator_remarks"]["detections_of_other_tags"] > 0
