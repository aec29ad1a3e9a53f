"""Equations 36 to 40 of Tolman et al. 2021, against the printed matrices and against geometry."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from estimators.tracking.line_of_sight import (
    GimbalAttitude,
    gimbal_angles,
    gimbal_from_camera,
    line_of_sight_of_gimbal,
    pointing_angles,
)
from flightsim.foundation.vectors import between, conjugate, from_euler, rotate, yaw_of

angles = st.floats(-3.1, 3.1)


def matrix(q):
    return np.array([rotate(q, tuple(axis)) for axis in np.eye(3)]).T


def printed_39(azimuth, elevation):
    """The paper's R_g^b as it stands there."""
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    return np.array([[ce * ca, -sa, se * ca], [ce * sa, ca, se * sa], [-se, 0.0, ce]])


def reported(azimuth, elevation, q_ned_from_frd):
    """What a gimbal at these angles against the body tells: its attitude, from north."""
    r = Rotation.from_matrix(matrix(q_ned_from_frd) @ printed_39(azimuth, elevation))
    x, y, z, w = r.as_quat()
    return GimbalAttitude(time_us=0, q=(w, x, y, z), from_north=True)


def meets_ground(line, height):
    """Equation 40."""
    distance = height / math.tan(line.depression_rad)
    return distance * math.cos(line.bearing_rad), distance * math.sin(line.bearing_rad)


@given(azimuth=angles, elevation=st.floats(-1.5, 1.5))
def test_pointing_angles_are_those_of_the_printed_rotation(azimuth, elevation):
    assert gimbal_angles(tuple(printed_39(azimuth, elevation)[:, 0])) == pytest.approx((azimuth, elevation))


def test_camera_axes_are_those_of_equation_38():
    printed = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    assert gimbal_from_camera(0.3, -0.2) == pytest.approx(printed @ np.array([0.3, -0.2, 1.0]))


offsets = st.tuples(st.floats(-900, 900), st.floats(-900, 900)).filter(lambda p: math.hypot(*p) > 5.0)


@given(
    offset=offsets,
    height=st.floats(30.0, 300.0),
    roll=st.floats(-0.9, 0.9),
    pitch=st.floats(-0.3, 0.3),
    yaw=angles,
)
def test_a_gimbal_that_points_sees_the_target_in_the_middle(offset, height, roll, pitch, yaw):
    """Pointing angles (section V-C), then equations 36 to 40, lead back to the target."""
    q = from_euler(roll, pitch, yaw)
    azimuth, elevation = pointing_angles((*offset, height), q)
    line = line_of_sight_of_gimbal(0.0, 0.0, reported(azimuth, elevation, q), q)
    assert meets_ground(line, height) == pytest.approx(offset, rel=1e-6, abs=1e-6)


@given(offset=offsets, roll=st.floats(-0.9, 0.9), yaw=angles, error=st.floats(-0.2, 0.2))
def test_a_gimbal_that_points_beside_it_sees_it_off_the_middle(offset, roll, yaw, error):
    height = 100.0
    q = from_euler(roll, 0.05, yaw)
    azimuth, elevation = pointing_angles((*offset, height), q)
    gimbal = reported(azimuth + error, elevation - 0.5 * error, q)
    forward, right, down = rotate(conjugate(gimbal.q), (*offset, height))
    line = line_of_sight_of_gimbal(right / forward, down / forward, gimbal, q)
    assert meets_ground(line, height) == pytest.approx(offset, rel=1e-6, abs=1e-6)


@given(yaw=angles, bearing=angles, depression=st.floats(0.05, 1.4))
def test_a_gimbal_that_knows_the_horizon_needs_the_heading_alone(yaw, bearing, depression):
    level = from_euler(0.0, -depression, bearing - yaw)
    for q, from_north in ((level, False), (from_euler(0.0, -depression, bearing), True)):
        line = line_of_sight_of_gimbal(
            0.0, 0.0, GimbalAttitude(time_us=0, q=q, from_north=from_north), from_euler(0.6, 0.1, yaw)
        )
        # roll and pitch of the aircraft don't matter, its heading does
        assert math.remainder(line.bearing_rad - bearing, math.tau) == pytest.approx(0.0, abs=2e-2)
        assert line.depression_rad == pytest.approx(depression, abs=1e-9)


@given(roll=st.floats(-1.5, 1.5), pitch=st.floats(-1.4, 1.4), yaw=angles)
def test_quaternions_are_those_of_euler_angles(roll, pitch, yaw):
    q = from_euler(roll, pitch, yaw)
    assert matrix(q) == pytest.approx(Rotation.from_euler("ZYX", (yaw, pitch, roll)).as_matrix(), abs=1e-12)
    assert math.remainder(yaw_of(q) - yaw, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_between_two_attitudes():
    middle = between(from_euler(0.0, 0.0, 3.1), from_euler(0.0, 0.0, -3.1), 0.5)
    assert abs(math.remainder(yaw_of(middle) - math.pi, math.tau)) < 1e-6  # the short way
