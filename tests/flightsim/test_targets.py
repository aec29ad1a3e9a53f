"""Ground targets: closed forms, the box, streams, and that asking often changes nothing."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from flightsim.foundation.random_streams import RandomStreams
from flightsim.payload import (
    Circle,
    ConstantVelocity,
    GroundTargetParameters,
    GroundTargets,
    RandomWalk,
    Static,
    TargetMotion,
)

Array = NDArray[np.float64]
S = 1_000_000

BOX = {"south_m": -70.0, "west_m": -135.0, "north_m": 70.0, "east_m": 135.0}
WALK = RandomWalk(**BOX, speed_m_s=2.0, leg_s=7.0)
MOTIONS: list[TargetMotion] = [
    Static(north_m=3.0, east_m=-4.0),
    ConstantVelocity(north_m=1.0, east_m=2.0, speed_m_s=3.0, course_rad=2.0),
    Circle(north_m=5.0, east_m=6.0, radius_m=40.0, speed_m_s=4.0, bearing_rad=1.0),
    Circle(north_m=5.0, east_m=6.0, radius_m=40.0, speed_m_s=4.0, clockwise=False),
    WALK,
]


def make(*motions: TargetMotion, seed: int = 1) -> GroundTargets:
    streams = RandomStreams(seed)
    return GroundTargets(
        [GroundTargetParameters(motion=motion) for motion in motions],
        seeds=lambda index: streams.child("target", index),
    )


def track(targets: GroundTargets, times_s: Array) -> Array:
    """(times, targets, 6): positions and velocities."""
    rows = []
    for time_s in times_s:
        targets.step(round(time_s * S))
        rows.append(np.concatenate([targets.positions_ned_m, targets.velocities_ned_m_s], axis=1))
    return np.array(rows)


def test_closed_forms() -> None:
    targets = make(*MOTIONS[:4])
    targets.step(10 * S)
    static, straight, right, left = targets.positions_ned_m
    np.testing.assert_array_equal(static, (3.0, -4.0, 0.0))
    np.testing.assert_allclose(straight, (1.0 + 30.0 * math.cos(2.0), 2.0 + 30.0 * math.sin(2.0), 0.0))
    np.testing.assert_allclose(right, (5.0 + 40.0 * math.cos(2.0), 6.0 + 40.0 * math.sin(2.0), 0.0))
    np.testing.assert_allclose(left, (5.0 + 40.0 * math.cos(-1.0), 6.0 + 40.0 * math.sin(-1.0), 0.0))


@pytest.mark.parametrize("motion", MOTIONS, ids=lambda motion: type(motion).__name__)
def test_velocity_is_the_derivative_of_the_position(motion: TargetMotion) -> None:
    times_s = np.arange(0.0, 60.0, 1e-3)
    states = track(make(motion), times_s)[:, 0]
    slope = np.diff(states[:, :3], axis=0) / 1e-3
    middle = 0.5 * (states[1:, 3:] + states[:-1, 3:])
    smooth = np.linalg.norm(np.diff(states[:, 3:], axis=0), axis=1) < 0.01
    np.testing.assert_allclose(slope[smooth], middle[smooth], atol=2e-3)
    assert smooth.mean() > 0.999  # a walk turns now and then


@pytest.mark.parametrize("motion", MOTIONS, ids=lambda motion: type(motion).__name__)
def test_asking_often_changes_nothing(motion: TargetMotion) -> None:
    often = track(make(motion), np.arange(0.0, 200.0, 0.02))[-1]
    once = track(make(motion), np.array([199.98]))[-1]
    np.testing.assert_array_equal(often, once)


@pytest.mark.parametrize("turn_rad", [0.5, math.inf])
@pytest.mark.parametrize("speed_m_s", [2.0, 400.0])
def test_a_walk_keeps_its_speed_and_stays_in_its_box(turn_rad: float, speed_m_s: float) -> None:
    walk = RandomWalk(**BOX, speed_m_s=speed_m_s, leg_s=5.0, turn_rad=turn_rad)
    states = track(make(walk), np.arange(0.0, 600.0, 0.1))[:, 0]
    assert np.all((np.abs(states[:, 0]) <= 70.0) & (np.abs(states[:, 1]) <= 135.0))
    np.testing.assert_allclose(np.hypot(states[:, 3], states[:, 4]), speed_m_s, rtol=1e-9)
    assert np.ptp(states[:, 1]) > 60.0


def test_walks_start_anywhere_in_the_box_or_where_given() -> None:
    starts = np.array([make(WALK, seed=seed).positions_ned_m[0, :2] for seed in range(400)])
    half = np.array([70.0, 135.0])
    np.testing.assert_allclose(starts.std(axis=0), half / math.sqrt(3.0), rtol=0.1)
    assert np.all(np.abs(starts.mean(axis=0)) < 5.0 * half / math.sqrt(3.0 * 400))
    reported = RandomWalk(**BOX, speed_m_s=2.0, start_m=(10.0, 20.0), course_rad=0.0)
    targets = make(reported)
    np.testing.assert_array_equal(targets.positions_ned_m[0], (10.0, 20.0, 0.0))
    np.testing.assert_allclose(targets.velocities_ned_m_s[0], (2.0, 0.0, 0.0), atol=1e-12)


@given(st.floats(-1e4, 1e4), st.floats(0.0, 1e4))
def test_reflection_is_a_walk_in_a_mirror_hall(start_m: float, way_m: float) -> None:
    """Unfolded steps against bouncing one by one."""
    low, high = -30.0, 50.0
    position = low + (start_m - low) % (high - low)
    walk = RandomWalk(
        south_m=low,
        north_m=high,
        west_m=-1.0,
        east_m=1.0,
        speed_m_s=1.0,
        leg_s=1e6,
        start_m=(position, 0.0),
        course_rad=0.0,
    )
    sense, left = 1.0, round(way_m * S) * 1e-6
    while left > 0.0:
        room = high - position if sense > 0.0 else position - low
        stride = min(room, left)
        position += sense * stride
        left -= stride
        if left > 0.0:
            sense = -sense
    targets = make(walk)
    targets.step(round(way_m * S))
    assert targets.positions_ned_m[0, 0] == pytest.approx(position, abs=1e-6)


def test_streams_belong_to_targets() -> None:
    alone = track(make(WALK), np.arange(0.0, 100.0, 1.0))[:, 0]
    accompanied = track(make(WALK, WALK, Static(north_m=0.0, east_m=0.0)), np.arange(0.0, 100.0, 1.0))
    np.testing.assert_array_equal(alone, accompanied[:, 0])
    assert not np.allclose(accompanied[:, 0], accompanied[:, 1])
    other_seed = track(make(WALK, seed=2), np.arange(0.0, 100.0, 1.0))[:, 0]
    assert not np.allclose(alone, other_seed)


def test_a_target_is_a_view_and_time_does_not_go_back() -> None:
    targets = make(WALK, MOTIONS[1])
    targets.step(5 * S)
    np.testing.assert_array_equal(targets.targets[1].position_ned_m, targets.positions_ned_m[1])
    targets.step(5 * S)
    with pytest.raises(ValueError, match="4999999 us is before 5000000 us"):
        targets.step(5 * S - 1)


@pytest.mark.parametrize(
    ("make_bad", "named"),
    [
        (lambda: Static(north_m=math.nan, east_m=0.0), "north_m nan"),
        (lambda: Circle(north_m=0.0, east_m=0.0, radius_m=0.0, speed_m_s=1.0), r"radius_m 0"),
        (lambda: RandomWalk(**(BOX | {"north_m": -80.0}), speed_m_s=1.0), r"south_m and north_m = -70\.0"),
        (lambda: RandomWalk(**BOX, speed_m_s=1.0, start_m=(100.0, 0.0)), r"start_m = \(100\.0, 0\.0\)"),
        (lambda: RandomWalk(**BOX, speed_m_s=1.0, turn_rad=math.nan), "turn_rad nan"),
        (lambda: GroundTargetParameters(motion=MOTIONS[0], tag_id=-2), "tag_id = -2"),
        (lambda: GroundTargetParameters(motion=MOTIONS[0], size_m=0.0), r"size_m 0"),
    ],
)
def test_bad_parameters_are_named(make_bad: object, named: str) -> None:
    assert callable(make_bad)
    with pytest.raises(ValueError, match=named):
        make_bad()
