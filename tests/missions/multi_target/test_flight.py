"""Whole searches in embedded worlds: found targets, the same numbers on every way, a silent sensor."""

import json
import threading
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from autopilot_bridge.mavlink import dialect
from estimators.library import make_estimator
from estimators.log_replay import replay
from estimators.logs import open_log
from flightsim.payload import ScanDisturbance
from flightsim.world_spec import WorldSpec
from missions.base.request import RunRequest
from missions.cli.main import run_command_line
from missions.multi_target.mission import MultiTargetMission
from missions.multi_target.options import MultiTargetOptions
from missions.multi_target.world import TargetField, multi_target_world  # type: ignore[attr-defined]
from missions.runs.session import fly
from missions.search.area import edges
from missions.search.options import StepLawKind
from tests.clients.sent_again import send_again
from tests.clients.sitl_process import free_port
from tests.missions.held_options import with_fields
from tests.slow import slow

SMALL = with_fields(
    MultiTargetOptions(altitude_m=8.0, start_ne_m=(0.0, 0.0), steps=12),
    expected_targets=4.0,
    **edges((-20.0, -20.0, 60.0, 60.0)),
)
FIELD = TargetField(count=4, clusters=1, cluster_sigma_m=12.0)


def flown(out, options=SMALL, *, picture=False, disturbances=(), flights=None, **values):
    world = multi_target_world(
        WorldSpec.of_team(options.vehicles, seed=2, **values), options, FIELD, disturbances=disturbances
    )
    request = RunRequest(options=options, world=world, out=out, picture=picture, estimator="multi-target")
    return fly(MultiTargetMission(), request, None if flights is None else flights.append)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    flights = []
    result = flown(tmp_path_factory.mktemp("runs") / "run", picture=True, flights=flights)
    return result, flights[-1]


def test_targets_are_found_and_the_vehicle_is_home(run):
    result, _ = run
    summary = result.summary
    assert (result.outcome, result.reason) == ("completed", "")
    assert summary["targets_true"] == 4
    assert summary["targets_found_right"] >= 3
    assert summary["steps"] == 12
    assert 1.5 < summary["step_s_mean"] < 4.0
    assert summary["late_steps"] == 0
    assert [phase["name"] for phase in summary["vehicles"][0]["phases"]][-2:] == ["search", "return"]
    assert {path.name for path in result.folder.iterdir()} >= {"flight.tlog", "summary.json", "track.png"}
    json.dumps(summary, allow_nan=False)


def test_the_mission_and_the_estimator_beside_it_have_the_same_numbers(run):
    result, flight = run
    with np.load(result.folder / "estimates-MultiTargetEstimate.npz") as file:
        recorded = {name: file[name] for name in file.files}
    states = flight.mission.team.search.states
    for state in states:
        rows = recorded["time_us"] == state.time_us
        kept = rows & (recorded["target_index"] >= 0)
        values = [(t.north_m, t.east_m, t.mass, t.width_m, float(t.found)) for t in state.targets]
        found = np.column_stack(
            [recorded[name][kept] for name in ("north_m", "east_m", "mass", "width_m", "found")]
        )
        assert rows.any()
        assert np.array_equal(found, np.array(values).reshape(-1, 5))
    assert len(states) > 20


def test_a_replay_of_the_log_has_the_same_numbers(run):
    result, _ = run
    settings = result.summary["estimator"]["settings"]
    done = replay(open_log(result.folder / "flight.tlog"), partial(make_estimator, "multi-target", settings))
    (runner,) = done.fleet.runners.values()
    for name, table in runner.tables.items():
        with np.load(result.folder / f"estimates-{name}.npz") as file:
            assert np.array_equal(file["time_us"], table.time_us)
            for column in table.columns:
                assert np.array_equal(file[column], table[column], equal_nan=True)


@pytest.mark.slow
def test_a_sensor_that_is_off_stops_the_search_and_the_vehicle_waits(tmp_path):
    """Off for a minute from 30 s: the vehicle holds its place and goes on afterwards."""
    pause = ScanDisturbance(start_s=30.0, duration_s=60.0)
    result = flown(tmp_path / "run", replace(SMALL, steps=6), disturbances=(pause,))
    assert (result.outcome, result.reason) == ("completed", "")
    assert result.summary["search_s"] > 60.0
    assert result.summary["steps"] == 6


@pytest.mark.slow
def test_a_sensor_that_stays_off_ends_the_search(tmp_path):
    pause = ScanDisturbance(start_s=30.0, duration_s=1000.0)
    options = replace(SMALL, sensor_limit_s=10.0)
    result = flown(tmp_path / "run", options, disturbances=(pause,))
    assert result.outcome == "failed"
    assert "no scan was received for 1" in result.reason
    assert result.summary["vehicles"][0]["phases"][-1]["name"] == "return"


@pytest.mark.parametrize(
    ("autopilot", "changes"),
    [
        slow("px4", {"law": StepLawKind.BACKSTEPPING}),
        slow("ardupilot", {}),
        slow("px4", {"vehicles": 2, "horizon": 3}),
    ],
)
def test_other_laws_autopilots_and_teams_search_too(tmp_path, autopilot, changes):
    result = flown(tmp_path / "run", replace(SMALL, **changes), autopilot=autopilot)
    assert (result.outcome, result.reason) == ("completed", "")
    assert result.summary["targets_found_right"] >= 3


def test_a_vehicle_without_the_sensor_is_refused_on_the_ground(tmp_path):
    request = RunRequest(options=SMALL, world=WorldSpec(), out=tmp_path / "run", picture=False)
    result = fly("multi-target", request)
    assert result.outcome == "failed"
    assert "no target sensor (26)" in result.reason
    assert dialect.MAV_COMP_ID_USER2 == 26


@pytest.mark.slow
def test_live_on_a_link_and_replayed_it_has_the_same_numbers_too(run, tmp_path):
    result, _ = run
    port, live, again = free_port(), tmp_path / "live", tmp_path / "again"
    settings = [f"--set={setting}" for setting in result.summary["estimator"]["settings"]]
    own = result.folder / "flight.tlog", port, (1, dialect.MAV_COMP_ID_USER2)
    sender = threading.Thread(target=send_again, args=own, daemon=True)
    sender.start()
    link = ["--connect", f"udpin:127.0.0.1:{port}", "--silence", "3"]
    run_command_line(["estimate", "multi-target", *link, *settings, "--no-picture", "--out", str(live)])
    sender.join()
    log = [str(live / "flight.tlog"), "--estimator", "multi-target"]
    assert run_command_line(["replay", *log, *settings, "--no-picture", "--out", str(again)]) == 0
    name = "estimates-MultiTargetEstimate.npz"
    embedded, *others = (np.load(folder / name) for folder in (result.folder, live, again))
    for column in embedded.files:
        for other in others:
            assert np.array_equal(other[column], embedded[column], equal_nan=True), column
