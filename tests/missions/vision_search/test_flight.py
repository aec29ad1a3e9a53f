"""Whole searches in embedded worlds: a target that is found and localized, a team over a lossy link."""

import json
import math
import threading
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from autopilot_bridge.mavlink.search_likelihood import SEARCH_LIKELIHOOD_PAYLOAD, read_search_likelihood
from autopilot_bridge.tlog import TlogReader
from estimators.library import make_estimator
from estimators.log_replay import replay
from estimators.logs import open_log
from estimators.messages import read_message
from flightsim.payload import PayloadParameters, PinholeModel
from flightsim.world_spec import WorldSpec
from missions.base.request import RunRequest
from missions.cli.main import run_command_line
from missions.runs.session import fly
from missions.search.area import edges
from missions.vision_search.mission import VisionSearchMission
from missions.vision_search.options import VisionSearchOptions
from missions.vision_search.world import HiddenTag, vision_search_world  # type: ignore[attr-defined]
from missions.worlds.payloads import carrying
from missions.worlds.search_camera import search_camera
from tests.clients.sent_again import send_again
from tests.clients.sitl_process import free_port
from tests.missions.held_options import with_fields

SMALL = {"altitude_m": 15.0, **edges((-20.0, -20.0, 20.0, 20.0)), "step_m": 8.0, "target_size_m": 0.6}


def flown(out, *, hidden=None, picture=False, flights=None, **changes):
    options = with_fields(VisionSearchOptions(), **{**SMALL, **changes})
    world = vision_search_world(WorldSpec.of_team(options.vehicles, seed=4), options, hidden)
    request = RunRequest(options=options, world=world, out=out, picture=picture, estimator="vision-search")
    return fly(VisionSearchMission(), request, None if flights is None else flights.append)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    flights = []
    hidden = HiddenTag(place_ne_m=(8.0, -5.0))
    out = tmp_path_factory.mktemp("runs") / "run"
    return flown(out, hidden=hidden, picture=True, flights=flights, passes=2), flights[-1]


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
    result, flight = run
    with np.load(result.folder / "estimates.npz") as file:
        recorded = {name: file[name] for name in file.files}
    states = flight.mission.team.search.states[0]
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
    options = with_fields(VisionSearchOptions(), **SMALL, search_time_s=60.0, tag_id=3)
    world = vision_search_world(WorldSpec.of_team(1, seed=4), with_fields(VisionSearchOptions(), **SMALL))
    request = RunRequest(options=options, world=world, out=tmp_path / "run", picture=True)
    result = fly(VisionSearchMission(), request)
    summary = result.summary
    assert result.outcome == "completed"
    assert not summary["localized"] and summary["search_end"] == "the search time is over"
    assert summary["beliefs"][0]["probability_of_detection"] > 0.8
    assert summary["beliefs"][0]["estimator_remarks"]["detections_of_other_tags"] > 0


@pytest.mark.slow
def test_live_on_a_link_and_replayed_it_has_the_same_numbers_too(run, tmp_path):
    result, _ = run
    port, live, again = free_port(), tmp_path / "live", tmp_path / "again"
    settings = [f"--set={setting}" for setting in result.summary["estimator"]["settings"]]
    own = result.folder / "flight.tlog", port, (1, 100)
    sender = threading.Thread(target=send_again, args=own, daemon=True)
    sender.start()
    link = ["--connect", f"udpin:127.0.0.1:{port}", "--silence", "3"]
    run_command_line(["estimate", "vision-search", *link, *settings, "--no-picture", "--out", str(live)])
    sender.join()
    log = [str(live / "flight.tlog"), "--estimator", "vision-search"]
    assert run_command_line(["replay", *log, *settings, "--no-picture", "--out", str(again)]) == 0
    embedded, *others = (np.load(folder / "estimates.npz") for folder in (result.folder, live, again))
    for column in embedded.files:
        for other in others:
            assert np.array_equal(other[column], embedded[column], equal_nan=True), column


@pytest.mark.slow
def test_what_each_vehicle_received_of_the_others_is_in_the_log(tmp_path):
    """A replay as one of the vehicles has the belief that it had, to the bit, over a lossy link too."""
    flights = []
    result = flown(tmp_path / "run", flights=flights, vehicles=2, passes=2, link_loss=0.3, link_delay_s=0.5)
    log = result.folder / "flight.tlog"
    received = [
        (message.src_system, message.target_system, read_search_likelihood(  # type: ignore[attr-defined]
            message.payload_type, message.payload_length, message.payload))  # type: ignore[attr-defined]
        for _, frame in TlogReader(log) if frame.definition.name == "TUNNEL"
        for message in [read_message(frame)] if message.payload_type == SEARCH_LIKELIHOOD_PAYLOAD  # type: ignore[attr-defined]
    ]  # fmt: skip
    assert len(received) == result.summary["likelihoods"]["delivered"] > 100
    assert {(sender, target) for sender, target, _ in received} == {(1, 2), (2, 1)}
    assert all(likelihood is not None for _, _, likelihood in received)
    for index in range(2):
        settings = [
            setting for setting in result.summary["estimator"]["settings"] if "own_vehicle" not in setting
        ]
        settings += [f"own_vehicle={index + 1}"]
        done = replay(open_log(log), partial(make_estimator, "vision-search", settings))
        (table,) = next(iter(done.fleet.runners.values())).tables.values()
        states = flights[-1].mission.team.search.states[index]
        rows = np.array([state.row() for state in states])
        assert len(rows) > 20
        for name, values in zip(states[0].COLUMNS, rows.T, strict=True):
            assert np.array_equal(table[name][: len(rows)], values), (
                name
            )  # the flight goes on after the search


@pytest.mark.slow
def test_a_film_of_a_flight_has_the_estimates_of_the_flight(tmp_path):
    """The pictures of the camera, kept without loss, give the same detections and estimates, to the bit."""
    options = with_fields(
        VisionSearchOptions(), **{**SMALL, "target_size_m": 1.5}, passes=1, search_time_s=60.0
    )
    small = PinholeModel(width_px=320, height_px=180, horizontal_fov_rad=math.radians(70.0))
    camera = replace(search_camera(1.5, film=True), model=small)
    world = carrying(WorldSpec.of_team(1, seed=4), PayloadParameters(camera=camera))
    world = vision_search_world(world, options, HiddenTag(place_ne_m=(8.0, -5.0)))
    request = RunRequest(
        options=options, world=world, out=tmp_path / "run", picture=False, estimator="vision-search"
    )
    result = fly(VisionSearchMission(), request)
    film, log = result.folder / "camera1.mp4", result.folder / "flight.tlog"
    words = [str(film), "--camera", str(film.with_suffix(".toml")), "--log", str(log), "--tag-size", "1.5"]
    assert run_command_line(["vision", *words, "--out", str(tmp_path / "again")]) == 0
    copy = tmp_path / "again" / "flight.tlog"

    def of_camera(path):
        return [frame.payload for _, frame in TlogReader(path) if frame.component_id == 100
                and frame.definition.name in ("LANDING_TARGET", "TUNNEL")]  # fmt: skip

    flown_frames, seen_again = of_camera(log), of_camera(copy)
    assert len(seen_again) > 100
    assert seen_again == flown_frames[: len(seen_again)]
    assert len(flown_frames) - len(seen_again) <= 2  # the log ends before they would have been received
    settings = result.summary["estimator"]["settings"]
    done = replay(open_log(copy), partial(make_estimator, "vision-search", settings))
    (table,) = next(iter(done.fleet.runners.values())).tables.values()
    with np.load(result.folder / "estimates.npz") as recorded:
        for column in table.columns:
            assert np.array_equal(table[column], recorded[column][: len(table.time_us)]), column
