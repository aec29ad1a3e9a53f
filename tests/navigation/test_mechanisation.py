"""Strapdown mechanisation with perfect sensors against the kinematics it integrates."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from autopilot_bridge.navigation import layout, mechanisation
from autopilot_bridge.navigation import states as s
from flightsim import truth as t
from flightsim.foundation.geodesy import earth_rate_ned_rad_s
from tests.navigation.bench import attitude_error
from tests.navigation.kinematic_flight import GRAVITY_M_S2, HOME, Lissajous, fly
from tests.rotations import rotation_matrix

Array = NDArray[np.float64]


def start(truth: Array, position_ned_m: Array) -> Array:
    core = np.zeros(s.CORE_SIZE)
    core[s.Q : s.Q + 4] = truth[t.Q_NED_FROM_FRD]
    core[s.X_VEL : s.X_VEL + 3] = truth[t.VEL_NED_M_S]
    core[s.X_POS : s.X_POS + 3] = position_ned_m
    core[s.STRETCH : s.STRETCH + 2] = 1.0
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


def moving_core() -> Array:
    """Some state of flight, with every sum and correction at a value of its own."""
    core = np.linspace(0.1, 0.9, s.CORE_SIZE)
    core[s.Q : s.Q + 4] = 0.5, -0.5, 0.1, 0.7
    core[s.Q : s.Q + 4] /= np.linalg.norm(core[s.Q : s.Q + 4])
    core[s.GYRO : s.GYRO + 3] = 0.8, -1.1, 0.6
    core[s.GYRO_LAST : s.GYRO_LAST + 3] = 0.5, -0.9, 0.4
    core[s.ACCEL : s.ACCEL + 3] = 1.0, -2.0, -11.0
    core[s.X_GYRO_BIAS : s.X_GYRO_BIAS + 3] = 0.02, -0.03, 0.01
    core[s.X_ACCEL_BIAS : s.X_ACCEL_BIAS + 3] = 0.1, 0.2, -0.3
    core[s.X_VEL : s.X_VEL + 3] = 12.0, -7.0, 2.0
    core[s.EARTH_RATE : s.EARTH_RATE + 3] = 0.03, -0.02, -0.05  # much more than the Earth's, to be seen
    core[s.GRAVITY], core[s.SAMPLE_AGE_S] = 9.81, 0.0
    mechanisation.refresh_rotation(core)
    return core


@pytest.mark.parametrize("dt_s", [0.004, 1e-4])
@pytest.mark.parametrize("alive", [True, False])
def test_one_step_with_vectors(dt_s: float, alive: bool) -> None:
    """Attitude by the rotation vector of the mean rate; velocity by the mean force, gravity and Coriolis;
    position by the mean velocity; and what the covariance's prediction sums up."""
    core = moving_core()
    core[s.SAMPLE_AGE_S] = 0.0 if alive else 0.3
    before = core.copy()

    def of(place: int, state: Array = before) -> Array:
        return state[place : place + 3]

    mechanisation.advance(core, dt_s, 0.2)
    r_before = rotation_matrix(before[s.Q : s.Q + 4])
    gyro = of(s.GYRO) if alive else of(s.X_GYRO_BIAS)
    turn = (0.5 * (gyro + of(s.GYRO_LAST)) - of(s.X_GYRO_BIAS) - r_before.T @ of(s.EARTH_RATE)) * dt_s
    r_after = r_before @ Rotation.from_rotvec(turn).as_matrix()
    np.testing.assert_allclose(rotation_matrix(core[s.Q : s.Q + 4]), r_after, atol=1e-12)
    np.testing.assert_allclose(core[s.R : s.R + 9].reshape(3, 3), r_after, atol=1e-12)
    assert np.linalg.norm(core[s.Q : s.Q + 4]) == pytest.approx(1.0, abs=1e-14)
    force = r_after @ (of(s.ACCEL) - of(s.X_ACCEL_BIAS)) if alive else np.array([0.0, 0.0, -9.81])
    impulse = 0.5 * (of(s.FORCE_NED) + force) * dt_s
    coriolis = -2.0 * np.cross(of(s.EARTH_RATE), of(s.X_VEL))
    change = impulse + (coriolis + np.array([0.0, 0.0, 9.81])) * dt_s
    np.testing.assert_allclose(of(s.X_VEL, core), of(s.X_VEL) + change, rtol=1e-12)
    stretch = np.append(before[s.STRETCH : s.STRETCH + 2], 1.0)
    np.testing.assert_allclose(
        of(s.X_POS, core), of(s.X_POS) + (of(s.X_VEL) + 0.5 * change) * dt_s * stretch, rtol=1e-12
    )
    np.testing.assert_allclose(of(s.FORCE_NED, core), force, atol=1e-12)
    np.testing.assert_allclose(of(s.GYRO_LAST, core), gyro)
    np.testing.assert_allclose(of(s.SUM_FORCE, core) - of(s.SUM_FORCE), impulse, atol=1e-14)
    np.testing.assert_allclose(of(s.SUM_TURN, core) - of(s.SUM_TURN), np.abs(r_before @ turn), atol=1e-14)
    np.testing.assert_allclose(of(s.SUM_GYRO, core) - of(s.SUM_GYRO), gyro * dt_s, atol=1e-14)
    np.testing.assert_allclose(
        core[s.SUM_R : s.SUM_R + 9] - before[s.SUM_R : s.SUM_R + 9], r_after.ravel() * dt_s, atol=1e-14
    )
    assert core[s.SUM_TIME] - before[s.SUM_TIME] == pytest.approx(dt_s)
    assert core[s.SUM_GYRO_TIME] - before[s.SUM_GYRO_TIME] == pytest.approx(dt_s)
    assert core[s.SAMPLE_AGE_S] - before[s.SAMPLE_AGE_S] == pytest.approx(dt_s)


@pytest.mark.parametrize("fresh", [True, False])
def test_a_step_writes_the_navigation_state_and_the_history(fresh: bool) -> None:
    core = moving_core()
    nav, history, imu = np.zeros(layout.NAV_SIZE), np.zeros((4, s.HISTORY_COLUMNS)), np.zeros(7)
    imu[:6] = 0.3, 0.2, -0.4, 2.0, 1.0, -9.0
    alone = core.copy()
    mechanisation.step(core, nav, history, imu, 0.004, 60.0, 400.0, 0.2, fresh, 2)
    if fresh:
        mechanisation.take_sample(alone, imu, 60.0, 400.0)
    mechanisation.advance(alone, 0.004, 0.2)
    np.testing.assert_array_equal(core, alone)
    np.testing.assert_array_equal(nav[layout.Q_NED_FROM_FRD], core[s.Q : s.Q + 4])
    np.testing.assert_array_equal(nav[layout.VEL_NED_M_S], core[s.X_VEL : s.X_VEL + 3])
    np.testing.assert_array_equal(nav[layout.POS_NED_M], core[s.X_POS : s.X_POS + 3])
    gyro_bias, accel_bias = core[s.X_GYRO_BIAS : s.X_GYRO_BIAS + 3], core[s.X_ACCEL_BIAS : s.X_ACCEL_BIAS + 3]
    np.testing.assert_allclose(nav[layout.RATES_FRD_RAD_S], core[s.GYRO : s.GYRO + 3] - gyro_bias)
    np.testing.assert_allclose(nav[layout.SPECIFIC_FORCE_FRD_M_S2], core[s.ACCEL : s.ACCEL + 3] - accel_bias)
    np.testing.assert_array_equal(nav[layout.GYRO_BIAS_RAD_S], gyro_bias)
    np.testing.assert_array_equal(nav[layout.ACCEL_BIAS_M_S2], accel_bias)
    force = core[s.FORCE_NED : s.FORCE_NED + 3]
    np.testing.assert_allclose(nav[layout.ACC_NED_M_S2], force + np.array([0.0, 0.0, 9.81]))
    yaw, pitch, roll = Rotation.from_matrix(core[s.R : s.R + 9].reshape(3, 3)).as_euler("ZYX")
    np.testing.assert_allclose(nav[layout.EULER_RAD], [roll, pitch, yaw], atol=1e-9)
    assert nav[layout.HEIGHT_ABOVE_GROUND_M] == pytest.approx(core[s.TERRAIN_DOWN] - core[s.X_POS + 2])
    correction_pos, correction_vel = s.CORRECTION_POS, s.CORRECTION_VEL
    expected = np.zeros((4, s.HISTORY_COLUMNS))
    expected[2, :3] = core[s.X_POS : s.X_POS + 3] - core[correction_pos : correction_pos + 3]
    expected[2, 3:6] = core[s.X_VEL : s.X_VEL + 3] - core[correction_vel : correction_vel + 3]
    expected[2, 6:] = core[s.Q : s.Q + 4]
    np.testing.assert_array_equal(history, expected)


def test_samples_at_the_ends_of_the_ranges_are_taken() -> None:
    for sign in (1.0, -1.0):
        core = np.zeros(s.CORE_SIZE)
        imu = sign * np.array([60.0, 60.0, 60.0, 400.0, 400.0, 400.0, 0.0])
        core[s.SAMPLE_AGE_S] = 1.0
        mechanisation.take_sample(core, imu, 60.0, 400.0)
        np.testing.assert_array_equal(core[s.GYRO : s.GYRO + 6], imu[:6])
        assert core[s.SAMPLE_AGE_S] == 0.0
        assert core[s.INVALID_SAMPLES] == 0.0
