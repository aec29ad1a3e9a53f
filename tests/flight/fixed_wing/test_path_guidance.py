"""Path guidance against the kinematics of turns and winds."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.flight.fixed_wing import FixedWingFlightParameters, LoiterTask, PathGuidance
from autopilot_bridge.flight.fixed_wing.circle import Circle
from autopilot_bridge.flight.fixed_wing.state import AircraftState
from tests.flight.fixed_wing.kinematic import PointMass, wrap

P = FixedWingFlightParameters()


def state_at(
    north: float, east: float, heading: float, wind: tuple[float, float] = (0.0, 0.0), airspeed: float = 25.0
) -> AircraftState:
    mass = PointMass((north, east, -100.0), heading, wind)
    mass.airspeed = airspeed
    mass.observe()
    state = AircraftState()
    state.read(mass.ctx)
    return state


def test_far_from_the_path_it_flies_square_to_it_and_on_it_along_it() -> None:
    guidance = PathGuidance(P)
    guidance.follow_line(state_at(0.0, 5000.0, 0.0), 0.0, 0.0, 1.0, 0.0)
    assert guidance.course_rad == pytest.approx(-0.5 * math.pi)
    assert guidance.track_error_m == pytest.approx(5000.0)
    guidance.follow_line(state_at(0.0, 0.0, 0.0), 0.0, 0.0, 1.0, 0.0)
    assert guidance.course_rad == pytest.approx(0.0)
    assert guidance.lateral_acceleration_m_s2 == 0.0


@given(
    st.floats(-3000.0, 3000.0),
    st.floats(-3.1, 3.1),
    st.floats(-3.1, 3.1),
    st.floats(0.0, 40.0),
    st.floats(-3.1, 3.1),
    st.sampled_from([0.0, 0.01, -0.01, 0.2]),
)
def test_course_lies_between_the_path_and_the_way_to_it(
    error: float, tangent: float, heading: float, wind: float, wind_from: float, curvature: float
) -> None:
    c, s = math.cos(tangent), math.sin(tangent)
    guidance = PathGuidance(P)
    state = state_at(-error * s, error * c, heading, (wind * math.cos(wind_from), wind * math.sin(wind_from)))
    guidance.follow(state, 0.0, 0.0, c, s, curvature)
    off = wrap(guidance.course_rad - tangent)
    assert -0.5 * math.pi - 1e-6 <= off <= 0.5 * math.pi + 1e-6
    assert off * error <= 1e-6  # towards the path
    assert math.isfinite(guidance.lateral_acceleration_m_s2)
    assert 0.0 <= guidance.feasibility <= 1.0


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_acceleration_on_a_circle_in_calm_air_is_centripetal(direction: float) -> None:
    guidance = PathGuidance(P)
    # north of the centre, flying east is clockwise
    state = state_at(150.0, 0.0, direction * 0.5 * math.pi)
    guidance.follow_circle(state, 0.0, 0.0, 150.0, direction)
    assert guidance.lateral_acceleration_m_s2 == pytest.approx(direction * 25.0**2 / 150.0, rel=1e-6)
    assert guidance.course_rad == pytest.approx(direction * 0.5 * math.pi)


def test_a_wind_stronger_than_the_airspeed_is_not_fought() -> None:
    guidance = PathGuidance(P)
    state = state_at(0.0, 0.0, 0.0, wind=(-30.0, 0.0))
    guidance.follow(state, 0.0, 0.0, 1.0, 0.0, 0.01)
    assert guidance.feasibility == 0.0
    assert guidance.lateral_acceleration_m_s2 == 0.0


def test_a_slow_roll_stretches_the_period() -> None:
    slow = FixedWingFlightParameters(roll_time_constant_s=2.5)
    guidance = PathGuidance(slow)
    guidance.follow_line(state_at(0.0, 0.0, 0.0), 0.0, 0.0, 1.0, 0.0)
    assert guidance.period_s == pytest.approx(1.5 * math.pi * 2.5 / 0.7)
    guidance.set_parameters(FixedWingFlightParameters(guidance_period_lower_bound=False))
    guidance.follow_line(state_at(0.0, 0.0, 0.0), 0.0, 0.0, 1.0, 0.0)
    assert guidance.period_s == 10.0


@pytest.mark.parametrize("wind", [(0.0, 0.0), (0.0, 8.0), (-9.0, 3.0)])
@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("radius", [140.0, 250.0])
@pytest.mark.sampled(4)
def test_circle_is_held_in_wind(wind: tuple[float, float], direction: float, radius: float) -> None:
    mass = PointMass((-600.0, 50.0, -100.0), 0.7, wind)
    task = LoiterTask(np.array([0.0, 0.0, -100.0]), direction * radius)
    mass.fly(task)
    mass.run(60.0)
    assert task.circling
    log = mass.run(60.0)
    error = np.hypot(log[:, 0], log[:, 1]) / radius - 1.0
    assert abs(error.mean()) < 0.02
    assert np.abs(error).max() < 0.06
    angle = np.unwrap(np.arctan2(log[:, 1], log[:, 0]))
    assert (angle[-1] - angle[0]) * direction > 2.0


@pytest.mark.parametrize("bearing_deg", range(0, 360, 36))
@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.sampled(8)
def test_circle_is_entered_along_its_tangent(bearing_deg: int, direction: float) -> None:
    bearing = math.radians(bearing_deg)
    mass = PointMass((500.0 * math.cos(bearing), 500.0 * math.sin(bearing), -100.0), 1.0, (4.0, -3.0))
    task = LoiterTask(np.array([0.0, 0.0, -120.0]), direction * 150.0)
    mass.fly(task)
    log = mass.run(50.0)
    away = np.hypot(log[:, 0], log[:, 1])
    assert task.circling
    assert away.min() > 130.0  # not across the circle
    assert abs(away[-1] - 150.0) < 6.0
    assert log[-1, 2] == pytest.approx(-120.0, abs=1.0)


def test_tangent_of_a_circle_touches_it() -> None:
    circle = Circle(0.0, 0.0, -100.0)
    state = state_at(-400.0, 0.0, 0.0)
    circle.begin(state)
    guidance = PathGuidance(P)
    circle.follow(state, guidance, 0.5)
    # counter-clockwise: the centre is passed on the left, so the way to it is to its right
    assert guidance.course_rad == pytest.approx(math.asin(100.0 / 400.0))


def test_turns_are_counted_from_the_capture_on() -> None:
    mass = PointMass((300.0, 0.0, -100.0))
    task = LoiterTask(np.array([0.0, 0.0, -100.0]), 100.0, turns=2.0)
    mass.fly(task)
    mass.run(2.0)
    assert task.turns_done == 0.0
    while not mass.ctx.events:
        mass.run(1.0)
        assert len(mass.log) < 50 * 120
    assert task.turns_done == pytest.approx(2.0, abs=0.05)
    assert len(mass.ctx.events) == 1
    mass.run(10.0)
    assert task.circling and len(mass.ctx.events) == 1
