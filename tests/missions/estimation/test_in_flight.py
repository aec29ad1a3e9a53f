"""`fly --estimator`: estimates of a flight, and the replay of its own log, to the last bit."""

import json
from pathlib import Path

import numpy as np
import pytest

from estimators.logs import open_log
from flightsim.world_spec import WorldSpec
from missions.base.options import FlightOptions, Via
from missions.cli.main import run_command_line
from missions.errors import PlanError
from missions.estimation.in_flight import estimators_of
from missions.estimation.over_logs import ReplayRequest, replay_logs
from missions.library import find_mission
from missions.runs import session
from missions.runs.session import RunRequest

LEVEL = str(Path(__file__).parents[2] / "estimators" / "level.py")


def flight(tmp_path, **changes):
    options = FlightOptions(width_m=40.0, height_m=30.0, pattern="L2", vehicles=changes.pop("vehicles", 1))
    world = WorldSpec.of_team(options.vehicles, autopilot=changes.pop("autopilot", "px4"))
    request = RunRequest(options=options, world=world, out=tmp_path / "run", picture=False, **changes)
    return session.fly("lissajous", request)


def same_estimates(folder, again):
    files = sorted(path.name for path in folder.glob("estimates*.npz"))
    assert files
    for name in files:
        ours, theirs = np.load(folder / name), np.load(again / name)
        assert set(ours) == set(theirs)
        for column in ours:
            assert ours[column].tobytes() == theirs[column].tobytes(), (name, column)
            assert len(ours[column]) > 100
    return files


@pytest.mark.parametrize("vehicles", [1, 2])
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.sampled(1)
def test_flight_and_replay_of_its_log_agree_to_the_last_bit(scripted, tmp_path, flavour, vehicles):
    result = flight(tmp_path, autopilot=flavour, vehicles=vehicles, estimator=LEVEL)
    assert result.outcome == "completed", result.reason
    estimator = result.summary["estimator"]
    assert estimator["outcome"] == "completed", estimator["reason"]
    ((_, again),) = replay_logs(
        ReplayRequest(
            logs=[result.folder / "flight.tlog"], estimator=LEVEL, out=tmp_path / "again", picture=False
        )
    )
    assert len(same_estimates(result.folder, again.folder)) == vehicles
    assert json.loads((result.folder / "summary.json").read_text())["estimator"]["samples"] > 100


@pytest.mark.parametrize(
    ("estimator", "chosen", "settings"),
    [
        ("lissajous", (), ["omega_x_rad_s=0.0419", "omega_y_rad_s=0.0838"]),
        ("lissajous", ("omega_y_rad_s=0.1",), ["omega_x_rad_s=0.0419", "omega_y_rad_s=0.1"]),
        ("attitude", (), []),
    ],
)
def test_what_a_pattern_says_of_an_estimators_parameters_is_set(estimator, chosen, settings):
    """`fly lissajous --period 150` knows its frequencies; what was chosen with --set counts all the same."""
    options = FlightOptions(pattern="L2", period_s=150.0, via=Via.SETPOINTS)
    known = find_mission("lissajous").estimator_settings(options)
    request = RunRequest(options=options, estimator=estimator, estimator_settings=chosen)
    found = estimators_of(request, known).fleet.parameters
    for setting in settings:
        name, value = setting.split("=")
        assert getattr(found, name) == pytest.approx(float(value), rel=2e-3)
    assert settings or not hasattr(found, "omega_x_rad_s")
    assert find_mission("lissajous").estimator_settings(FlightOptions()) == {}


def test_estimates_are_reported_on_the_link_and_logged_as_a_component_of_the_vehicle(scripted, tmp_path):
    result = flight(tmp_path, estimator=LEVEL)
    log = open_log(result.folder / "flight.tlog")
    reported = log.table("ATTITUDE", system_id=1, component_id=191)
    times = reported.time_us
    assert 8.0 < 1e6 / np.median(np.diff(times)) <= 10.1
    assert log.rate_hz("HEARTBEAT", system_id=1, component_id=191) == pytest.approx(1.0, abs=0.02)
    assert scripted[0].autopilots[0].heartbeats_received > len(
        log.table("HEARTBEAT", system_id=255, component_id=190)
    )
    # one component on one link has one sequence
    assert not any(loss.lost for loss in log.source.losses if loss.component_id == 191)


def test_rates_are_requested(scripted, tmp_path):
    """A firmware that streams nothing by itself gets requests for what the estimator needs."""
    result = flight(tmp_path, autopilot="ardupilot", estimator=LEVEL)
    log = open_log(result.folder / "flight.tlog")
    requested = log.table("COMMAND_LONG", system_id=1, component_id=191)
    assert set(requested["command"].tolist()) == {511}
    assert result.summary["estimator"]["needs"][0]["met"]


@pytest.mark.slow
def test_the_same_flight_twice_gives_the_same_log(scripted, tmp_path):
    logs = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        logs.append(flight(tmp_path / name, estimator=LEVEL).folder / "flight.tlog")
    assert logs[0].read_bytes() == logs[1].read_bytes()


def test_an_estimator_that_fails_does_not_end_the_flight(scripted, tmp_path):
    path = tmp_path / "broken.py"
    text = Path(LEVEL).read_text(encoding="utf-8")
    path.write_text(text.replace("w = self.parameters.weight", "w = 1.0 / (20_000_000 > time_us)"))
    result = flight(tmp_path, estimator=str(path))
    assert result.outcome == "completed"
    estimator = result.summary["estimator"]
    assert estimator["partial"]
    assert "ZeroDivisionError" in estimator["reason"]
    assert estimator["samples"] > 100


def test_a_wrong_estimator_is_refused_before_the_flight(scripted, tmp_path):
    with pytest.raises(PlanError, match="'altitude' is not known; there are attitude"):
        flight(tmp_path, estimator="altitude")
    with pytest.raises(PlanError, match="is for an estimator; name one with `estimator`"):
        flight(tmp_path, estimator_settings=("weight=1",))
    assert not scripted
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.slow
def test_attitude_in_an_embedded_flight_equals_its_replay(tmp_path, capfd, autopilot):
    """The whole stack: our SITL, the attitude filter beside the flight, and over its log."""
    command = ["fly", "lissajous", "--size", "40x30", "--pattern", "L2", "--seed", "5"]
    command += ["--autopilot", autopilot, "--estimator", "attitude", "--out", str(tmp_path / "run")]
    assert run_command_line([*command, "--no-picture"]) == 0, capfd.readouterr().err
    assert "attitude, vehicle 1:" in capfd.readouterr().out
    log = str(tmp_path / "run" / "flight.tlog")
    assert run_command_line(["replay", log, "--estimator", "attitude", "--out", str(tmp_path / "again")]) == 0
    assert same_estimates(tmp_path / "run", tmp_path / "again")
    summary = json.loads((tmp_path / "again" / "summary.json").read_text())
    assert set(summary["against"]) == {"autopilot", "truth"}
