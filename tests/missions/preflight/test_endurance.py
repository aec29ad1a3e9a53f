"""A mission that takes longer than the battery lasts is named before the takeoff, and refused on hardware."""

import pytest

from flightsim.hover_figures import hover_endurance_s
from flightsim.world_spec import VehicleSpec, WorldSpec
from missions.base.options import FlightOptions
from missions.base.request import RunRequest
from missions.cli.main import run_command_line
from missions.errors import MissionError
from missions.kind import VehicleKind
from missions.planning.outline import Outline
from missions.preflight.endurance import Endurance, endurance_finding, reported_endurance, too_long
from missions.preflight.finding import Level
from missions.preflight.snapshot import Snapshot
from missions.runs.session import fly

OUTLINE = Outline(duration_s=600.0)


@pytest.mark.parametrize(
    ("seconds", "level", "words"),
    [
        (500.0, Level.PROBLEM, "the mission takes longer than the battery lasts: about 10.0 min"),
        (700.0, Level.PROBLEM, "leaves no reserve of 30 %"),
        (800.0, Level.OK, "13.3 min of battery (given)"),
        (None, Level.WARNING, "it is not known how long the battery lasts"),
    ],
)
def test_the_finding(seconds, level, words):
    endurance = None if seconds is None else Endurance(seconds=seconds, source="given")
    finding = endurance_finding(OUTLINE, endurance)
    assert finding.level is level and words in finding.text
    assert bool(too_long(OUTLINE, endurance)) == (level is Level.PROBLEM)


@pytest.mark.parametrize(
    ("flavour", "messages", "parameters", "seconds"),
    [
        ("px4", {"BATTERY_STATUS": {"time_remaining": 420}}, {}, 420.0),
        (
            "px4",
            {"SYS_STATUS": {"battery_remaining": 50}},
            {"BAT1_CAPACITY": 5000.0, "BAT_AVRG_CURRENT": 10.0},
            900.0,
        ),
        (
            "px4",
            {"SYS_STATUS": {"battery_remaining": 50}},
            {"BAT1_CAPACITY": -1.0, "BAT_AVRG_CURRENT": 10.0},
            None,
        ),
        (
            "px4",
            {"SYS_STATUS": {"battery_remaining": -1}},
            {"BAT1_CAPACITY": 5000.0, "BAT_AVRG_CURRENT": 10.0},
            None,
        ),
        ("ardupilot", {"SYS_STATUS": {"battery_remaining": 50}}, {"BATT_CAPACITY": 5000.0}, None),
    ],
)
def test_what_a_vehicle_reports(flavour, messages, parameters, seconds):
    snapshot = Snapshot(
        flavour=flavour, kind=VehicleKind.MULTICOPTER, messages=messages, parameters=parameters
    )
    endurance = reported_endurance(snapshot)
    assert (None if endurance is None else endurance.seconds) == pytest.approx(seconds)


def test_the_model_s_endurance_is_that_of_its_flights():
    """Hovering takes 13 to 14 A by SYS_STATUS of embedded flights (3.5 Ah)."""
    assert hover_endurance_s("iris") == pytest.approx(3.5 / 13.5 * 3600.0, rel=0.05)
    assert hover_endurance_s("iris", battery_ah=1.75) == pytest.approx(
        0.5 * hover_endurance_s("iris"),  # type: ignore[operator]
        rel=0.01,  # type: ignore[operator]
    )
    assert hover_endurance_s("aerosonde") is None


def test_an_embedded_mission_is_remarked_before_its_takeoff(tmp_path):
    said = []

    def stop(text):
        said.append(text)
        raise MissionError("read")

    world = WorldSpec(vehicles=(VehicleSpec(autopilot="ardupilot", battery_ah=1.0),))
    options = FlightOptions(width_m=300.0, height_m=300.0)
    request = RunRequest(options=options, world=world, out=tmp_path / "run", picture=False, on_remark=stop)
    result = fly("parallel-sweep", request)
    assert "vehicle 1: the mission takes longer than the battery lasts" in said[0]
    assert "4.5 min of battery (by the model, in hover)" in said[0]
    assert result.summary["vehicles"][0]["phases"] == []
    assert any("longer than the battery" in text for text in result.summary["vehicles"][0]["warnings"])


def test_a_given_endurance_is_remarked_of_a_simulation(elsewhere, tmp_path, capsys):
    words = ["fly", "parallel-sweep", "--size", "80", "--connect", "udpin:127.0.0.1:14550", "--no-picture"]
    assert run_command_line([*words, "--endurance", "1.5", "--out", str(tmp_path / "run")]) == 0
    assert "vehicle 1: the mission takes longer than the battery lasts" in capsys.readouterr().err


def test_on_a_vehicle_that_may_be_real_it_is_refused(elsewhere, tmp_path, capsys):
    elsewhere.version = None
    words = ["fly", "sector", "--size", "60", "--connect", "udpin:127.0.0.1:14550", "--yes", "--no-picture"]
    assert run_command_line([*words, "--endurance", "0.5", "--out", str(tmp_path / "run")]) == 1
    assert "the mission takes longer than the battery lasts" in capsys.readouterr().err
    assert not elsewhere.items and not elsewhere.armed
