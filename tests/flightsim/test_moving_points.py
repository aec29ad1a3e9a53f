"""The moving-point camera: points against the geometry, misses, false points, targets that stop."""

import math

import numpy as np
import pytest

from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import (
    ConstantVelocity,
    GroundTargetParameters,
    GroundTargets,
    MovingPointCamera,
    MovingPointParameters,
    Static,
)

HOME = Home()
HEIGHT_M = 100.0


def walker(north_m, east_m, speed_m_s=1.0):
    motion = ConstantVelocity(north_m=north_m, east_m=east_m, speed_m_s=speed_m_s, course_rad=0.0)
    return GroundTargetParameters(motion=motion)


def scans(parameters, targets, seconds=10.0, seed=1):
    streams = RandomStreams(seed)
    truth = np.zeros(t.TRUTH_SIZE)
    truth[t.LAT_RAD], truth[t.LON_RAD] = np.radians(HOME.offset(0.0, 0.0))
    truth[t.ALT_M] = HOME.alt_m + HEIGHT_M
    truth[t.Q_NED_FROM_FRD] = (1.0, 0.0, 0.0, 0.0)
    camera = MovingPointCamera(
        parameters,
        truth=truth,
        home=HOME,
        targets=GroundTargets(targets, seeds=lambda i: streams.child("target", i)),
        gimbal=None,
        physics_rate_hz=100,
        seeds=lambda name: streams.child("vehicle", 0, "sensor", name),
    )
    found = (camera.step(10_000 * k) for k in range(round(100 * seconds)))
    return [scan for scan in found if scan is not None]


EXACT = MovingPointParameters(pixel_rad=1e-6, detected=1.0, false_points=0.0)


def test_a_walking_target_is_where_the_camera_shows_it_and_later_by_the_latency():
    """The camera looks straight down, its top to the north."""
    found = scans(EXACT, [walker(10.0, -20.0, 2.0)], seconds=3.0)
    assert [scan.number for scan in found] == list(range(len(found))) and len(found) == 29
    for scan in found:
        ((right, below),) = scan.points
        assert right == pytest.approx(-0.2, abs=1e-4)
        assert below == pytest.approx(-(10.0 + 2.0 * scan.time_us * 1e-6) / HEIGHT_M, abs=1e-4)


def test_only_what_moves_in_the_picture_gives_points():
    resting = GroundTargetParameters(motion=Static(north_m=0.0, east_m=0.0))
    outside = walker(0.0, HEIGHT_M * 0.6)
    found = scans(EXACT, [resting, outside, walker(5.0, 5.0, 0.2)], seconds=2.0)
    assert found and not any(scan.points for scan in found)
    behind = MovingPointParameters(mount_pitch_rad=0.5 * math.pi, false_points=0.0)
    assert not any(scan.points for scan in scans(behind, [walker(0.0, 0.0)], seconds=2.0))


def test_misses_noise_and_false_points_are_as_given():
    parameters = MovingPointParameters(pixel_rad=0.003, detected=0.8, false_points=0.0)
    found = scans(parameters, [walker(0.0, 0.0, 0.31)], seconds=100.0)
    seen = np.array([scan.points[0][0] for scan in found if scan.points])
    assert len(seen) / len(found) == pytest.approx(0.8, abs=0.04)
    assert np.std(seen) == pytest.approx(0.003, rel=0.1) and np.mean(seen) == pytest.approx(0.0, abs=5e-4)
    false = scans(MovingPointParameters(false_points=2.0), [], seconds=100.0)
    points = np.array([point for scan in false for point in scan.points])
    assert len(points) / len(false) == pytest.approx(2.0, abs=0.15)
    assert np.abs(points).max(axis=0) == pytest.approx((0.577, 0.433), abs=0.01)
    assert all(list(scan.points) == sorted(scan.points) for scan in false)  # the order carries nothing


def test_another_target_does_not_change_the_points_of_the_first():
    parameters = MovingPointParameters(false_points=0.0)
    alone = scans(parameters, [walker(0.0, 0.0)])
    both = scans(parameters, [walker(0.0, 0.0), walker(20.0, 20.0)])
    for one, two in zip(alone, both, strict=True):
        assert set(one.points) <= set(two.points)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"pixel_rad": 0.0}, "pixel_rad"),
        ({"detected": 1.5}, "detected"),
        ({"half_view": (0.5, 0.0)}, "half_view"),
        ({"reach_m": -1.0}, "reach_m"),
        ({"latency_s": -0.1}, "latency_s"),
    ],
)
def test_impossible_cameras_are_refused(changes, named):
    with pytest.raises(ValueError, match=named):
        MovingPointParameters(**changes)
