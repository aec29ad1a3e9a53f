"""Orbits that can't be flown are refused with what to change; the command line makes the options it says."""

import math

import pytest
from click.testing import CliRunner

from missions.cli.fly import fly
from missions.errors import PlanError
from missions.orbit.checks import check_camera, check_vehicle
from missions.orbit.options import OrbitOptions
from missions.vehicle.limits import FixedWingLimits, MulticopterLimits
from tests.missions.held_options import with_fields

WINGS = FixedWingLimits(
    airspeed_min_m_s=18.0,
    airspeed_trim_m_s=25.0,
    airspeed_max_m_s=30.0,
    bank_max_rad=math.radians(45.0),
    bank_parameter="FW_R_LIM",
    wind_m_s=4.0,
    air_altitude_m=600.0,
)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"radius_m": 80.0}, r"radius 80 m can't be held.*45 degrees of bank \(FW_R_LIM\).*`radius_m` 110"),
        ({"radius_m": 125.0, "target_speed_m_s": 10.0}, "around a target that moves at 10 m/s"),
        ({"radius_m": 2000.0}, "2.9 degrees below the horizon.*`altitude_m` or a smaller `radius_m`"),
        ({"airspeed_m_s": 12.0}, "airspeed 12 m/s is not in 18..30 m/s"),
        ({"altitude_m": 500.0}, "altitude 500 m is not in 20..120 m"),
        ({"target_ne_m": (60_000.0, 0.0)}, "60400 m from home, more than"),
        ({"target_ground_m": 150.0}, "not below the aircraft"),
    ],
)
def test_what_can_not_be_flown_is_refused(change, words):
    with pytest.raises(PlanError, match=words):
        check_vehicle(with_fields(OrbitOptions(), **change), WINGS)


def test_the_defaults_can_be_flown_and_hovering_is_no_orbit():
    check_vehicle(OrbitOptions(), WINGS)
    with pytest.raises(PlanError, match="choose `model=aerosonde`"):
        check_vehicle(OrbitOptions(), MulticopterLimits())


def test_the_smallest_radius_is_that_of_the_fastest_place_on_the_circle():
    """1.2 (V + w + v)^2 / (g tan(bank)), with true airspeed."""
    fastest = 25.0 * math.sqrt(1.225 / 1.15587) + 4.0 + 2.0  # density of ISO 2533 at 600 m
    least = 1.2 * fastest**2 / (9.80665 * math.tan(math.radians(45.0)))
    check_vehicle(with_fields(OrbitOptions(), radius_m=least + 0.1, target_speed_m_s=2.0), WINGS)
    with pytest.raises(PlanError, match="can't be held"):
        check_vehicle(with_fields(OrbitOptions(), radius_m=least - 0.1, target_speed_m_s=2.0), WINGS)


def test_a_target_outside_what_the_gimbal_reaches_is_refused():
    """Abeam at 34 degrees below the horizon, with 17 to 31 degrees of bank."""
    options = OrbitOptions()
    check_camera(options, WINGS, math.radians(-90.0), math.radians(30.0))
    with pytest.raises(PlanError, match="outside what the camera's gimbal reaches"):
        check_camera(options, WINGS, math.radians(-90.0), math.radians(-20.0))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("--radius 0", "--radius 0 is not possible"),
        ("--duration nan", "--duration nan"),
        ("--duration 1e9", "--duration 1e+09 s is not in"),
        ("--direction left", "'cw', 'ccw'"),
        ("--target 5", "'--target': '5' is not"),
        ("--target here", "'--target': 'here' is not"),
        ("--target-speed 90", "--target-speed 90 m/s is not in 0..15 m/s"),
        ("--target-heading nan", "'--target-heading': nan is not an angle"),
        ("--entry-heading inf", "'--entry-heading': inf is not an angle"),
        ("--target-motion circle", "--target-motion circle needs a --target-speed"),
        ("--target-motion static --target-speed 2", "static leaves no --target-speed"),
        ("--pattern L2", "--pattern is for lissajous, not for orbit"),
        ("--model iris", "choose --model aerosonde"),
        ("--arg a=1", "--arg is for a mission of your own, not for orbit"),
        ("--vehicles 3 --model aerosonde,aerosonde", "2 models for 3 vehicles"),
    ],
)
def test_the_command_line_says_what_is_wrong(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(fly, ["orbit", *arguments.split()])
    assert result.exit_code == 2, result.output
    assert words in " ".join(result.output.split())
    assert list(tmp_path.iterdir()) == []


def test_options_of_other_missions_are_refused_everywhere():
    result = CliRunner().invoke(fly, ["lissajous", "--radius", "100"])
    assert result.exit_code == 2
    assert "--radius is for orbit, handoff, not for lissajous" in result.output


def test_help_is_the_missions_own():
    text = CliRunner().invoke(fly, ["orbit", "--help"]).output
    assert "--radius" in text
    assert "--seed" in text
    assert "--pattern" not in text
