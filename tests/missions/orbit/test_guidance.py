"""Guidance against closed forms, and around the circle on a point-mass aircraft in wind and gusts."""

import math

import numpy as np
import pytest

from estimators.orbit_target.attitude import AutopilotAttitude
from estimators.orbit_target.relative_target import RelativeState
from estimators.orbit_target.tracker import TargetStatus, TargetTracker
from missions.planning.orbit_guidance import (  # type: ignore[attr-defined]
    GRAVITY_M_S2,
    OrbitGuidance,
    OrbitParameters,
    bearing_off_velocity_rad,
)
from tests.missions.orbit.coordinated_turn import PointMass
from tests.slow import slow_after

ENTRIES = [
    # bearing from the target, distance, heading of the nose
    (180, 400, 0), (90, 300, 0), (0, 500, 200), (270, 150, 0), (45, 600, 225),
    (135, 60, 90), (225, 250, 45), (315, 350, 315), (10, 450, 100), (200, 200, 290),
]  # fmt: skip


def state(offset, velocity, time_us=0):
    return RelativeState(
        time_us=time_us, offset_ne_m=offset, offset_rate_ne_m_s=(-velocity[0], -velocity[1]), offset_std_m=1.0
    )


def settled(parameters, offset, velocity, heading):
    """The command when the roll rate limit no longer matters."""
    guidance = OrbitGuidance(parameters)
    for k in range(200):
        command = guidance.command(state(offset, velocity, k * 20_000), heading, 0.0)
    return command


def test_the_angle_has_a_sign():
    """Target abeam to the right: +90 degrees; to the left: -90; ahead 0."""
    assert bearing_off_velocity_rad((20.0, 0.0), (0.0, 5.0)) == pytest.approx(math.pi / 2)
    assert bearing_off_velocity_rad((20.0, 0.0), (0.0, -5.0)) == pytest.approx(-math.pi / 2)
    assert bearing_off_velocity_rad((0.0, 20.0), (0.0, 5.0)) == pytest.approx(0.0)


@pytest.mark.parametrize("direction", [1, -1])
def test_on_the_circle_the_bank_is_that_of_the_circle(direction):
    """tan(phi) = v^2 / (g rho) in still air: Tolman et al. 2021 print it without the square."""
    parameters = OrbitParameters(radius_m=150.0, direction=direction)
    command = settled(parameters, (0.0, direction * 150.0), (25.0, 0.0), 0.0)
    assert command.chi_error_rad == pytest.approx(0.0, abs=1e-12)
    assert math.tan(command.roll_rad) == pytest.approx(direction * 25.0**2 / (GRAVITY_M_S2 * 150.0))


def test_in_a_cross_wind_the_bank_makes_up_for_the_crab():
    """Lift pulls across the nose: only cos(crab) of it turns the path."""
    parameters = OrbitParameters(radius_m=150.0)
    command = settled(parameters, (0.0, 150.0), (24.0, 0.0), math.radians(-15.0))
    assert math.tan(command.roll_rad) == pytest.approx(
        24.0**2 / (GRAVITY_M_S2 * 150.0 * math.cos(math.radians(15.0)))
    )


def test_limits_of_bank_and_of_its_rate():
    parameters = OrbitParameters(radius_m=150.0, bank_max_rad=0.5, bank_rate_max_rad_s=1.0)
    guidance = OrbitGuidance(parameters)
    rolls = [
        guidance.command(state((-500.0, 300.0), (25.0, 0.0), k * 20_000), 0.0, 0.0).roll_rad
        for k in range(60)
    ]
    assert max(np.abs(np.diff([0.0, *rolls]))) <= 0.02 + 1e-9
    assert rolls[-1] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"radius_m": 0.0}, "radius 0"),
        ({"direction": 2}, "direction 2"),
        ({"bank_max_rad": 2.0}, "bank limit"),
    ],
)
def test_parameters_are_checked(change, words):
    with pytest.raises(ValueError, match=words):
        OrbitParameters(**({"radius_m": 150.0} | change))


def fly(direction, entry, *, seconds=150.0, **world):
    """Orbit on what the tracker makes of noisy, late images; (n, 2): time, true radius; and the tracker."""
    bearing, distance, heading = entry
    b = math.radians(bearing)
    aircraft = PointMass(
        position=(distance * math.cos(b), distance * math.sin(b)), heading=math.radians(heading), **world
    )
    attitude = AutopilotAttitude()
    tracker = TargetTracker(attitude)
    guidance = OrbitGuidance(OrbitParameters(radius_m=150.0, direction=direction))
    offset = aircraft.target - aircraft.p + np.array((12.0, -9.0))
    drift = aircraft.target_velocity - aircraft.wind + np.array((1.0, 0.5))
    tracker.start(
        0, offset_ne_m=tuple(offset), offset_std_m=20.0, drift_ne_m_s=tuple(drift), drift_std_m_s=2.0
    )
    roll, flown = 0.0, []
    while aircraft.time_us < seconds * 1e6:
        now, gimbal, airspeed, height, detections = aircraft.step(roll)
        attitude.add(*now)
        tracker.gimbal(gimbal)
        tracker.height(height)
        for detection in detections:
            tracker.detect(detection)
        if aircraft.time_us % 40_000 == 0:  # 25 Hz, as the mission does
            tracker.step(aircraft.time_us, airspeed)
            command = guidance.command(tracker.state(aircraft.time_us), now[3], now[1])
            roll = command.roll_rad
            aircraft.pointed = tracker.pointing(aircraft.time_us, 0.1)
        flown.append((aircraft.time_us * 1e-6, aircraft.radius))
    return np.array(flown), tracker


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("number", slow_after(3, range(len(ENTRIES))))
@pytest.mark.sampled(1)
def test_the_circle_is_reached_from_everywhere_and_held(direction, number):
    """4 m/s of wind from somewhere, gusts of 0.7 m/s; every other target moves at 2 m/s."""
    wind, course = 1.3 * number, 0.7 * number
    flown, tracker = fly(
        direction,
        ENTRIES[number],
        seed=number,
        wind=(4.0 * math.cos(wind), 4.0 * math.sin(wind)),
        target_velocity=(2.0 * math.cos(course), 2.0 * math.sin(course)) if number % 2 else (0.0, 0.0),
    )
    radius = flown[flown[:, 0] > 60.0, 1]
    assert abs(radius.mean() / 150.0 - 1.0) < 0.02
    assert radius.std() < 4.0
    assert tracker.status is TargetStatus.SEEN


@pytest.mark.slow
def test_a_leaning_gimbal_costs_some_radius_but_not_the_orbit():
    """One degree of roll error is 5.7 m at this height."""
    flown, _ = fly(1, ENTRIES[0], roll_error=math.radians(1.0))
    radius = flown[flown[:, 0] > 60.0, 1]
    assert 4.0 < abs(radius.mean() - 150.0) < 10.0


@pytest.mark.slow
def test_false_detections_do_not_lead_it_astray():
    flown, _ = fly(1, ENTRIES[0], clutter=0.5)
    assert abs(flown[flown[:, 0] > 60.0, 1].mean() / 150.0 - 1.0) < 0.02


@pytest.mark.slow
def test_half_the_detections_are_enough():
    flown, _ = fly(-1, ENTRIES[1], detection=0.4)
    assert abs(flown[flown[:, 0] > 60.0, 1].mean() / 150.0 - 1.0) < 0.02
