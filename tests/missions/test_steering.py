"""The course a multicopter is led along."""

import math

import numpy as np
import pytest

from missions.errors import PlanError
from missions.teams.steering import CourseReference
from missions.vehicle.limits import MulticopterLimits

LIMITS = MulticopterLimits()
STEP_S = 0.04


def reference(speed_m_s: float = 10.0, heading_rad: float = 0.0) -> CourseReference:
    return CourseReference(
        place_ned_m=(100.0, -50.0, -80.0), heading_rad=heading_rad, speed_m_s=speed_m_s, limits=LIMITS
    )


def flown(course: CourseReference, seconds: float, start_s: float = 0.0):
    times = start_s + STEP_S * np.arange(1, round(seconds / STEP_S) + 1)
    return [course.at(float(t)) for t in times]


def test_turns_and_gains_speed_within_the_limits():
    course = reference()
    setpoints = flown(course, 5.0)
    course.turn_to(math.radians(200.0))
    setpoints += flown(course, 25.0, 5.0)
    velocity = np.array([s.velocity_ned_m_s for s in setpoints])
    acceleration = np.diff(velocity, axis=0) / STEP_S
    assert np.linalg.norm(acceleration, axis=1).max() < 1.01 * LIMITS.acceleration_m_s2
    assert max(abs(s.yaw_rate_rad_s) for s in setpoints) <= LIMITS.yaw_rate_rad_s
    assert setpoints[-1].yaw_rad == pytest.approx(math.radians(-160.0))
    assert np.linalg.norm(velocity[-1]) == pytest.approx(10.0)
    assert {s.position_ned_m[2] for s in setpoints} == {-80.0}


def test_velocity_is_how_the_place_changes():
    course = reference()
    course.turn_to(1.0)
    setpoints = flown(course, 12.0)
    place = np.array([s.position_ned_m for s in setpoints])
    velocity = np.array([s.velocity_ned_m_s for s in setpoints])
    middle = 0.5 * (velocity[1:] + velocity[:-1])
    assert np.abs(np.diff(place, axis=0) / STEP_S - middle).max() < 0.1


def test_turns_the_short_way():
    course = reference(heading_rad=math.radians(350.0))
    course.turn_to(math.radians(20.0))
    flown(course, 8.0)
    assert course.heading_rad == pytest.approx(math.radians(20.0))


def test_comes_to_rest():
    course = reference()
    flown(course, 6.0)
    assert not course.at_rest
    course.stop()
    flown(course, 10.0, 6.0)
    assert course.at_rest


def test_a_late_setpoint_makes_no_leap():
    course = reference()
    flown(course, 6.0)
    before = course.at(6.0).position_ned_m
    after = course.at(60.0).position_ned_m
    assert math.dist(before, after) <= 5.01


def test_a_speed_it_does_not_have_is_refused():
    with pytest.raises(PlanError, match="`speed_m_s`"):
        reference(speed_m_s=30.0)
