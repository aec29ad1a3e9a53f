"""Strapdown mechanisation with perfect sensors against the kinematics it integrates."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.navigation import layout, mechanisation
from autopilot_bridge.navigation import states as s
from flightsim import truth as t
from flightsim.foundation.geodesy import earth_rate_ned_rad_s
from tests.navigation.bench import attitude_error
from tests.navigation.kinematic_flight import GRAVITY_M_S2, HOME, Lissajous, fly

Array = NDArray[np.float64]


def start(truth: Array, position_ned_m: Array) -> Array:
    core = np.zeros(s.CORE_SIZE)
    core[s.Q : s.Q + 4] = truth[t.Q_NED_FROM_FRD]
    core[s.X_VEL : s.X_VEL + 3] = truth[t.VEL_NED_M_S]
    core[s.X_POS : s.X_POS + 3] = position_ned_m
    core[s.GRAVITY] = GRAVITY_M_S2
    core[s.EARTH_RATE : s.EARTH_RATE + 3] = earth_rate_ned_rad_s(HOME.lat_deg)
    imu = np.zeros(7)
    imu[0:3], imu[3:6] = truth[t.RATES_FRD_RAD_S], truth[t.SPECIFIC_FORCE_FRD_M_S2]
    mechanisation.take_sample(core, imu, 60.0, 400.0)
    core[s.GYRO_LAST : s.GYRO_LAST + 3] = imu[:3]
    mechanisation.refresh_rotation(core)
    core[s.FORCE_NED : s.FORCE_NED + 3] = core[s.R : s.R + 9].reshape(3, 3) @ imu[3:6]
    return core


def integrate(truths: Array, position_ned_m: Array, rate_hz: int) -> tuple[Array, Array]:
    core = start(truths[0], position_ned_m)
    nav, history, imu = np.zeros(layout.NAV_SIZE), np.zeros((4, s.HISTORY_COLUMNS)), np.zeros(7)
    for k in range(1, len(truths)):
        imu[0:3] = truths[k, t.RATES_FRD_RAD_S]
        imu[3:6] = truths[k, t.SPECIFIC_FORCE_FRD_M_S2]
        mechanisation.step(core, nav, history, imu, 1.0 / rate_hz, 60.0, 400.0, 0.2, True, k % 4)
    return core, nav


def test_rest_on_the_rotating_earth() -> None:
    truths = fly(120.0, path=lambda time_s: np.zeros((len(time_s), 3)), yaw=lambda time_s: 1.0 + 0.0 * time_s)
    core, _ = integrate(truths, np.zeros(3), 250)
    assert np.abs(attitude_error(truths[-1, t.Q_NED_FROM_FRD], core[s.Q : s.Q + 4])).max() < 1e-9
    assert np.abs(core[s.X_VEL : s.X_VEL + 3]).max() < 1e-7
    assert np.abs(core[s.X_POS : s.X_POS + 3]).max() < 1e-5


def test_flight_converges_with_the_square_of_the_step() -> None:
    path = Lissajous(takeoff_s=0.0, figure_s=0.0)
    errors = []
    for rate_hz in (125, 250, 500):
        truths = fly(40.0, path=path, rate_hz=rate_hz)
        time_s = np.array([1.0 / rate_hz, 40.0])
        first, last = path(time_s)
        core, _ = integrate(truths, first, rate_hz)
        errors.append(float(np.linalg.norm(core[s.X_POS : s.X_POS + 3] - last)))
        attitude = attitude_error(truths[-1, t.Q_NED_FROM_FRD], core[s.Q : s.Q + 4])
        assert math.degrees(float(np.abs(attitude).max())) < 0.002 * (500.0 / rate_hz) ** 2
    assert errors[1] < 0.05
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.3)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.3)


def test_navigation_state() -> None:
    truths = fly(30.0)
    path = Lissajous()
    _, nav = integrate(truths, path(np.array([0.004]))[0], 250)
    truth = truths[-1]
    np.testing.assert_allclose(nav[layout.VEL_NED_M_S], truth[t.VEL_NED_M_S], atol=0.01)
    np.testing.assert_allclose(nav[layout.POS_NED_M], path(np.array([30.0]))[0], atol=0.05)
    np.testing.assert_array_equal(nav[layout.RATES_FRD_RAD_S], truth[t.RATES_FRD_RAD_S])
    np.testing.assert_array_equal(nav[layout.SPECIFIC_FORCE_FRD_M_S2], truth[t.SPECIFIC_FORCE_FRD_M_S2])
    acceleration = (truths[-1, t.VEL_NED_M_S] - truths[-3, t.VEL_NED_M_S]) * 125.0
    np.testing.assert_allclose(nav[layout.ACC_NED_M_S2], acceleration, atol=0.02)


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e6])
def test_bad_samples_are_counted_and_the_last_good_one_stays(axis: int, bad: float) -> None:
    core = np.zeros(s.CORE_SIZE)
    good = np.array([0.1, 0.2, 0.3, 1.0, 2.0, -9.0, 20.0])
    mechanisation.take_sample(core, good, 60.0, 400.0)
    spoiled = good.copy()
    spoiled[axis] = bad
    mechanisation.take_sample(core, spoiled, 60.0, 400.0)
    np.testing.assert_array_equal(core[s.GYRO : s.GYRO + 6], good[:6])
    assert core[s.INVALID_SAMPLES] == 1.0


def test_without_samples_motion_is_not_invented() -> None:
    truths = fly(2.0)
    core = start(truths[0], np.zeros(3))
    core[s.GYRO : s.GYRO + 3] = 5.0
    for _ in range(500):
        mechanisation.advance(core, 0.004, 0.2)
    attitude = attitude_error(truths[0, t.Q_NED_FROM_FRD], core[s.Q : s.Q + 4])
    turned = float(np.linalg.norm(attitude))
    assert 0.9 < turned < 2.0  # the last sample is held for 0.2 s, not for 2 s
    assert np.abs(core[s.X_VEL : s.X_VEL + 3]).max() < 4.0
