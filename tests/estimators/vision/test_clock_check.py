"""Clocks of pictures and attitude that are apart, by pictures of a turning ground."""

import math

import cv2
import numpy as np
import pytest

from estimators.vision.clock_check import ClockCheck

DOWN = (0.0, -0.5 * math.pi, 0.0)
GROUND = cv2.GaussianBlur(
    np.random.default_rng(3).integers(0, 256, (600, 600, 3)).astype(np.uint8), (0, 0), 2.5
)


def seen(yaw_rad, north_m):
    """The ground below a camera that has turned to the right by an angle: it turns to the left."""
    turn = cv2.getRotationMatrix2D((300.0, 300.0), math.degrees(yaw_rad), 1.0)
    turn[:, 2] += (20.0 * math.sin(north_m), 10.0 * north_m % 40.0)
    return cv2.warpAffine(GROUND, turn, (600, 600))[180:420, 140:460]


def checked(apart_s, rate_rad_s=0.5, tilt_rad=0.0):
    """A check of 12 s with a yaw that swings, and pictures whose times are off by `apart_s`."""
    check = ClockCheck(DOWN)

    def yaw(time_s):
        return rate_rad_s * math.sin(time_s) * math.cos(0.37 * time_s)

    for k in range(25 * 16):
        time_s = 1.0 + 0.04 * k
        check.take_attitude(round(time_s * 1e6), tilt_rad, 0.0, yaw(time_s))
    for k in range(80):
        time_s = 3.0 + 0.15 * k
        check.take_picture(round((time_s - apart_s) * 1e6), seen(yaw(time_s), 0.1 * time_s))
    return check


@pytest.mark.parametrize("apart_s", [0.0, 0.3, -0.3])
@pytest.mark.sampled(1)
def test_the_difference_of_the_clocks_is_found(apart_s):
    difference = checked(apart_s).difference()
    assert difference.apart_s == pytest.approx(apart_s, abs=0.04)
    assert difference.explained > 0.9


def test_without_rotation_nothing_is_said():
    assert checked(0.3, rate_rad_s=0.002).difference() is None
    assert ClockCheck(DOWN).difference() is None
