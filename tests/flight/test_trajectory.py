"""Jerk-limited trajectories: limits, arrival, smoothness."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.multicopter.trajectory import TrajectoryGenerator, braking_speed
from autopilot_bridge.flight.multicopter.yaw import YawSteering
from autopilot_bridge.flight.parameters import FlightParameters
from flightsim.foundation.vectors import wrap_pi

DT_S = 0.02


@example(target=(2.0, 0.0, 0.0), velocity=(0.0, 1.0, 0.0), cruise=1.0, acc=2.0, jerk=2.0)
@settings(max_examples=60, deadline=None)
@given(
    target=st.tuples(*[st.floats(-60.0, 60.0)] * 2, st.floats(-30.0, 30.0)),
    velocity=st.tuples(*[st.floats(-4.0, 4.0)] * 2, st.floats(-1.0, 1.0)),
    cruise=st.floats(1.0, 10.0),
    acc=st.floats(1.0, 5.0),
    jerk=st.floats(2.0, 15.0),
)
@pytest.mark.slow
def test_limits_hold_and_the_target_is_reached(
    target: tuple[float, float, float],
    velocity: tuple[float, float, float],
    cruise: float,
    acc: float,
    jerk: float,
) -> None:
    p = FlightParameters(cruise_speed_m_s=cruise, acceleration_m_s2=acc, jerk_m_s3=jerk)
    generator = TrajectoryGenerator(p)
    start = np.zeros(3)
    generator.reset(start, np.array(velocity))
    end = np.array(target)
    acceleration = generator.acceleration_ned_m_s2.copy()
    start_speed = math.hypot(velocity[0], velocity[1])
    for _ in range(int(120.0 / DT_S)):
        generator.follow_leg(start, end, 0.0, DT_S)
        v, a = generator.velocity_ned_m_s, generator.acceleration_ned_m_s2
        # acceleration is taken back at the jerk limit: until then a turn may exceed the speed
        overshoot = min(0.25, acc * acc / (2.0 * jerk))
        assert math.hypot(v[0], v[1]) <= max(cruise, start_speed) * 1.05 + overshoot
        assert -p.climb_speed_m_s * 1.05 <= v[2] <= p.descend_speed_m_s * 1.05
        assert math.hypot(a[0], a[1]) <= acc + 1e-9
        assert -p.acceleration_up_m_s2 - 1e-9 <= a[2] <= p.acceleration_down_m_s2 + 1e-9
        change = a - acceleration
        assert math.hypot(change[0], change[1]) <= jerk * DT_S + 1e-9
        assert abs(change[2]) <= jerk * DT_S + 1e-9
        acceleration = a.copy()
    assert generator.position_ned_m == pytest.approx(end, abs=0.05)
    assert np.abs(generator.velocity_ned_m_s).max() < 0.02


@settings(max_examples=40, deadline=None)
@given(
    distance=st.floats(1.0, 80.0),
    cruise=st.floats(2.0, 12.0),
    acc=st.floats(1.5, 5.0),
    jerk=st.floats(2.0, 20.0),
)
def test_straight_legs_overshoot_little(distance: float, cruise: float, acc: float, jerk: float) -> None:
    p = FlightParameters(cruise_speed_m_s=cruise, acceleration_m_s2=acc, jerk_m_s3=jerk)
    generator = TrajectoryGenerator(p)
    end = np.array([distance, 0.0, 0.0])
    farthest = 0.0
    for _ in range(int(60.0 / DT_S)):
        generator.follow_leg(np.zeros(3), end, 0.0, DT_S)
        farthest = max(farthest, float(generator.position_ned_m[0]))
    assert farthest < distance + 0.1


def test_near_time_optimal() -> None:
    """30 m with 2.5 m/s^2 and 5 m/s^3: the S-curve's own time is 2 (v/a + a/j) = 7.4 s."""
    p = FlightParameters(cruise_speed_m_s=10.0, acceleration_m_s2=2.5, jerk_m_s3=5.0)
    generator = TrajectoryGenerator(p)
    end = np.array([30.0, 0.0, 0.0])
    steps = 0
    while abs(generator.position_ned_m[0] - 30.0) > 0.3:
        generator.follow_leg(np.zeros(3), end, 0.0, DT_S)
        steps += 1
    assert 6.5 < steps * DT_S < 8.3


def test_offset_from_the_leg_is_flown_out() -> None:
    generator = TrajectoryGenerator(FlightParameters())
    generator.reset(np.array([0.0, 3.0, 0.0]), np.array([5.0, 0.0, 0.0]))
    end = np.array([100.0, 0.0, 0.0])
    east = []
    for _ in range(400):
        generator.follow_leg(np.zeros(3), end, 5.0, DT_S)
        east.append(float(generator.position_ned_m[1]))
    assert abs(east[-1]) < 0.1
    assert min(east) > -0.15


def test_inclined_leg_stays_on_its_line() -> None:
    generator = TrajectoryGenerator(FlightParameters())
    end = np.array([40.0, 0.0, -12.0])
    for _ in range(2000):
        generator.follow_leg(np.zeros(3), end, 0.0, DT_S)
        n, _, d = generator.position_ned_m
        assert abs(d + 0.3 * n) < 0.4
    assert generator.position_ned_m == pytest.approx(end, abs=0.05)


def test_braking_speed_is_monotonic_and_ends_at_the_end_speed() -> None:
    d = np.linspace(0.0, 50.0, 200)
    v = np.array([braking_speed(x, 2.0, 3.0, 4.0, 1.0) for x in d])
    assert v[0] == 2.0
    assert (np.diff(v) >= 0.0).all()


def test_a_vehicle_left_behind_is_waited_for() -> None:
    generator = TrajectoryGenerator(FlightParameters())
    generator.reset(np.array([3.0, 0.0, 0.0]), np.array([5.0, 0.0, 0.0]))
    generator.wait_for(np.zeros(3), 2.0)
    before = generator.position_ned_m.copy()
    generator.follow_leg(np.zeros(3), np.array([50.0, 0.0, 0.0]), 0.0, DT_S)
    assert generator.position_ned_m == pytest.approx(before)
    setpoint = np.zeros(20)
    generator.write(setpoint)
    assert setpoint[sp.VEL] == 0.0


@settings(max_examples=60, deadline=None)
@given(start=st.floats(-3.1, 3.1), target=st.floats(-10.0, 10.0))
def test_heading_turns_the_short_way_within_its_rate(start: float, target: float) -> None:
    p = FlightParameters()
    heading = YawSteering()
    heading.reset(start)
    turned = 0.0
    for _ in range(700):
        before = heading.yaw_rad
        heading.turn_to(target, p, DT_S)
        turned += wrap_pi(heading.yaw_rad - before)
        assert abs(heading.rate_rad_s) <= p.yaw_rate_max_rad_s + 1e-9
    assert abs(wrap_pi(heading.yaw_rad - target)) < 0.02
    assert abs(turned) < math.pi + 0.1
