"""Trajectories keep the vehicle's limits, are consistent with themselves, and stay on their curve."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.errors import PlanError
from missions.patterns import (
    ArcLengthTable,
    Lap,
    Lissajous,
    Polyline,
    expanding_square,
    named_lissajous,
    parallel_sweep,
    sector,
)
from missions.planning import (
    leg_speeds,
    line_trajectory,
    natural_trajectory,
    plan_trajectory,
    waypoints_along,
)
from missions.vehicle.limits import MulticopterLimits

LIMITS = MulticopterLimits()
CURVES = {
    "L1": named_lissajous("L1", width_m=100.0, height_m=100.0),
    "L2": named_lissajous("L2", width_m=100.0, height_m=100.0),
    "L3": named_lissajous("L3", width_m=100.0, height_m=60.0),
    "L4": named_lissajous("L4", width_m=100.0, height_m=100.0),
    "small L2": named_lissajous("L2", width_m=12.0, height_m=8.0),
    "retraced": Lissajous(amplitude_x_m=50.0, amplitude_y_m=40.0, ratio_x=1, ratio_y=3),
    "sector": sector(radius_m=50.0).rounded(2.0),
    "sweep": parallel_sweep(width_m=100.0, height_m=60.0, spacing_m=10.0).rounded(2.0),
    "square": expanding_square(size_m=60.0, spacing_m=10.0).rounded(1.0),
    "sharp": sector(radius_m=30.0),
}


def assert_within(trajectory, limits, speed):
    assert trajectory.max_speed_m_s <= speed * 1.005
    assert trajectory.max_acceleration_m_s2 <= limits.acceleration_m_s2 * 1.005
    assert np.abs(trajectory.velocity_ned_m_s[[0, -1]]).max() < 0.02


def assert_consistent(trajectory):
    """Velocity is the derivative of position, and acceleration of velocity."""
    dt = trajectory.step_s
    velocity = np.gradient(trajectory.position_ned_m, dt, axis=0)
    acceleration = np.gradient(trajectory.velocity_ned_m_s, dt, axis=0)
    inner = slice(2, -2)
    assert np.abs(velocity - trajectory.velocity_ned_m_s)[inner].max() < 0.08
    error = np.abs(acceleration - trajectory.acceleration_ned_m_s2)[inner]
    assert np.sqrt((error**2).mean()) < 0.05


@pytest.mark.parametrize("speed", [2.0, 5.0, 11.0])
@pytest.mark.parametrize("name", CURVES)
def test_limits_are_kept_on_every_pattern(name, speed):
    trajectory = plan_trajectory(CURVES[name], altitude_m=10.0, speed_m_s=speed, limits=LIMITS)
    assert_within(trajectory, LIMITS, speed)
    assert_consistent(trajectory)
    assert np.abs(trajectory.yaw_rate_rad_s).max() <= LIMITS.yaw_rate_rad_s * 1.01
    assert trajectory.length_m == pytest.approx(ArcLengthTable.of(CURVES[name]).length_m, rel=2e-3)
    assert np.all(trajectory.position_ned_m[:, 2] == -10.0)


@settings(max_examples=30, deadline=None)
@given(
    st.floats(20.0, 150.0),
    st.floats(20.0, 150.0),
    st.integers(1, 5),
    st.integers(1, 5),
    st.floats(0.0, 3.0),
    st.floats(1.0, 12.0),
    st.floats(0.5, 5.0),
)
def test_limits_are_kept_on_any_lissajous_curve(width, height, rx, ry, phase, speed, acceleration):
    curve = Lissajous(
        amplitude_x_m=0.5 * width, amplitude_y_m=0.5 * height, ratio_x=rx, ratio_y=ry, phase_x_rad=phase
    )
    limits = MulticopterLimits(acceleration_m_s2=acceleration)
    trajectory = plan_trajectory(curve, altitude_m=10.0, speed_m_s=speed, limits=limits)
    assert_within(trajectory, limits, speed)


def test_speed_is_held_where_the_curve_allows_it():
    trajectory = plan_trajectory(CURVES["L1"], altitude_m=10.0, speed_m_s=5.0, limits=LIMITS)
    speed = np.linalg.norm(trajectory.velocity_ned_m_s, axis=1)
    middle = speed[200:-200]
    assert middle == pytest.approx(np.full(len(middle), 5.0), abs=1e-3)
    inward = -trajectory.position_ned_m[1000, :2] / 50.0
    assert trajectory.acceleration_ned_m_s2[1000, :2] @ inward == pytest.approx(25.0 / 50.0, rel=1e-3)


def test_jerk_is_bounded_by_the_smoothing():
    for name in ("L1", "L3", "L4"):
        trajectory = plan_trajectory(CURVES[name], altitude_m=10.0, speed_m_s=5.0, limits=LIMITS)
        jerk = np.linalg.norm(np.diff(trajectory.acceleration_ned_m_s2, axis=0), axis=1) / trajectory.step_s
        assert jerk.max() <= 2.0 * LIMITS.acceleration_m_s2 / LIMITS.smoothing_s


def test_nose_along_the_path():
    trajectory = plan_trajectory(CURVES["L3"], altitude_m=10.0, speed_m_s=5.0, limits=LIMITS)
    v = trajectory.velocity_ned_m_s
    moving = np.hypot(v[:, 0], v[:, 1]) > 0.5
    error = np.angle(np.exp(1j * (np.arctan2(v[:, 1], v[:, 0]) - trajectory.yaw_rad)))[moving]
    assert np.abs(error).max() < 1e-9


def test_the_vehicle_stops_and_turns_at_a_sharp_corner():
    line = Polyline(((0.0, 0.0), (40.0, 0.0), (40.0, 30.0)))
    trajectory = plan_trajectory(line, altitude_m=10.0, speed_m_s=5.0, limits=LIMITS)
    at_corner = np.linalg.norm(trajectory.position_ned_m[:, :2] - (40.0, 0.0), axis=1) < 1e-6
    assert np.abs(trajectory.velocity_ned_m_s[at_corner]).max() < 0.05
    turning = trajectory.yaw_rad[at_corner]
    assert turning[0] == pytest.approx(0.0, abs=1e-9)
    assert turning[-1] == pytest.approx(math.pi / 2, abs=0.02)


@settings(max_examples=25, deadline=None)
@given(st.floats(8.0, 400.0), st.sampled_from(["L2", "sweep", "sharp"]))
def test_search_time_ends_at_rest_in_time(seconds, name):
    trajectory = plan_trajectory(
        CURVES[name], altitude_m=10.0, speed_m_s=5.0, limits=LIMITS, duration_s=seconds
    )
    whole = plan_trajectory(CURVES[name], altitude_m=10.0, speed_m_s=5.0, limits=LIMITS)
    assert trajectory.duration_s <= min(seconds, whole.duration_s) + 0.2  # samples, once for each stop
    assert trajectory.duration_s >= min(seconds, whole.duration_s) - 8.0
    assert_within(trajectory, LIMITS, 5.0)


def test_interpolated_point_and_ends():
    trajectory = plan_trajectory(CURVES["L1"], altitude_m=10.0, speed_m_s=5.0, limits=LIMITS)
    k = 1234
    point = trajectory.at((k + 0.5) * trajectory.step_s)
    expected = 0.5 * (trajectory.position_ned_m[k] + trajectory.position_ned_m[k + 1])
    assert point.position_ned_m == pytest.approx(tuple(expected))
    assert -math.pi <= point.yaw_rad <= math.pi
    assert trajectory.at(-1.0).position_ned_m == tuple(trajectory.position_ned_m[0])
    assert trajectory.at(1e9).position_ned_m == pytest.approx(tuple(trajectory.position_ned_m[-1]))


def test_natural_law_is_harmonic():
    curve = CURVES["L2"]
    period = 120.0
    trajectory = natural_trajectory(curve, fundamental_period_s=period, altitude_m=10.0, limits=LIMITS)
    assert_within(trajectory, LIMITS, LIMITS.speed_m_s)
    assert_consistent(trajectory)
    k = len(trajectory.yaw_rad) // 2
    w = math.tau / period
    n, e, _ = trajectory.position_ned_m[k]
    a_n, a_e, _ = trajectory.acceleration_ned_m_s2[k]
    assert a_n == pytest.approx(-((2 * w) ** 2) * n, abs=1e-9)  # equation 12: x'' = -w^2 x
    assert a_e == pytest.approx(-(w**2) * e, abs=1e-9)


def test_too_short_a_period_names_one_that_can_be_flown():
    with pytest.raises(PlanError, match=r"`period_s` (\d+)") as refused:
        natural_trajectory(CURVES["L2"], fundamental_period_s=5.0, altitude_m=10.0, limits=LIMITS)
    possible = float(str(refused.value).split("`period_s` ")[1].split()[0])
    natural_trajectory(CURVES["L2"], fundamental_period_s=possible, altitude_m=10.0, limits=LIMITS)
    with pytest.raises(PlanError):
        natural_trajectory(CURVES["L2"], fundamental_period_s=possible - 2.0, altitude_m=10.0, limits=LIMITS)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"speed_m_s": 40.0}, r"speed 40 m/s is not in 0\.\.12 m/s.*`speed_m_s`"),
        ({"speed_m_s": 0.0}, "speed 0 m/s"),
        ({"altitude_m": 500.0}, r"altitude 500 m is not in 1\.5\.\.120 m.*`altitude_m`"),
        ({"altitude_m": -3.0}, "altitude -3 m"),
        ({"curve": named_lissajous("L1", width_m=2e5, height_m=10.0)}, "reaches 100000 m from home"),
        ({"duration_s": 0.1}, "too short"),
    ],
)
def test_impossible_patterns_name_the_value_and_the_remedy(changes, message):
    arguments = {"curve": CURVES["L1"], "altitude_m": 10.0, "speed_m_s": 5.0, "limits": LIMITS} | changes
    with pytest.raises(PlanError, match=message):
        plan_trajectory(arguments.pop("curve"), **arguments)


def test_line_is_straight_and_within_limits():
    line = line_trajectory((0.0, 0.0, -10.0), (30.0, 40.0, -10.0), speed_m_s=5.0, limits=LIMITS)
    assert_within(line, LIMITS, 5.0)
    assert line.position_ned_m[-1] == pytest.approx((30.0, 40.0, -10.0), abs=1e-3)
    assert line.yaw_rad[0] == pytest.approx(math.atan2(40.0, 30.0))
    cross = line.position_ned_m[:, 0] * 0.8 - line.position_ned_m[:, 1] * 0.6
    assert np.abs(cross).max() < 1e-9


@pytest.mark.parametrize("name", ["L1", "L2", "L3", "L4"])
def test_waypoints_are_on_the_curve_and_the_legs_near_it(name):
    curve = CURVES[name]
    points = np.array(waypoints_along(curve, deviation_m=0.3))
    table = ArcLengthTable.of(curve, 0.1)
    for a, b in itertools.pairwise(points):
        middle = 0.5 * (a + b)
        # 0.3 m where the shortest leg (3 m) allows it: its sagitta in a bend of 1.3 m is 0.7 m
        assert np.hypot(*(table.points_m - middle).T).min() < (0.75 if name == "L4" else 0.45)
    for point in points:
        assert np.hypot(*(table.points_m - point).T).min() < 0.06
    assert points[0] == pytest.approx(points[-1], abs=1e-6)
    legs = np.hypot(*np.diff(points, axis=0).T)
    assert legs.max() <= 25.0 * 1.01


def test_waypoints_of_a_polyline_are_its_corners_cut_at_the_length():
    line = expanding_square(size_m=40.0, spacing_m=10.0)
    assert waypoints_along(line) == list(line.vertices_m)
    cut = waypoints_along(line, length_m=25.0)
    assert np.array(cut) == pytest.approx(np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (5.0, 10.0)]))


def test_laps_are_one_continuous_flight():
    once = plan_trajectory(CURVES["L1"], altitude_m=10.0, speed_m_s=5.0, limits=LIMITS)
    thrice = plan_trajectory(Lap(curve=CURVES["L1"], laps=3), altitude_m=10.0, speed_m_s=5.0, limits=LIMITS)
    round_s = ArcLengthTable.of(CURVES["L1"]).length_m / 5.0
    assert thrice.duration_s == pytest.approx(once.duration_s + 2 * round_s, abs=0.1)


def test_leg_speeds_are_those_of_the_plan():
    curve = CURVES["L4"]
    trajectory = plan_trajectory(curve, altitude_m=10.0, speed_m_s=5.0, limits=LIMITS)
    points = waypoints_along(curve)
    speeds = leg_speeds(points, trajectory)
    assert len(speeds) == len(points)
    assert max(speeds) == pytest.approx(5.0)
    assert speeds[0] == speeds[1]
    assert min(speeds) > 1.0  # the smooth start and stop don't count
    sharpest = np.abs(ArcLengthTable.of(curve).curvature_per_m).max()
    assert min(speeds) <= math.sqrt(LIMITS.lateral_m_s2 / sharpest) * 1.1
