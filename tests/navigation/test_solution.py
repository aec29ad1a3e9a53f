"""The filter's arrays at alignment and at jumps, the history, and the process noise of the parameters."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.navigation import NavigationParameters
from autopilot_bridge.navigation import covariance as cov
from autopilot_bridge.navigation import states as s
from autopilot_bridge.navigation.solution import Solution, process_from
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.firmware_frames import Px4Frame
from flightsim.foundation.geodesy import GeodeticPosition, earth_rate_ned_rad_s, normal_gravity_m_s2
from flightsim.foundation.random_streams import RandomStreams
from flightsim.foundation.rotations import quaternion_from_euler
from tests.rotations import rotation_matrix, yaw_rad

Array = NDArray[np.float64]
RATE_HZ = 250
PARAMETERS = NavigationParameters()


def solution(parameters: NavigationParameters = PARAMETERS, *, correlated: bool = True) -> Solution:
    """One in flight: every state is something, and correlated with every other."""
    made = Solution(parameters, physics_rate_hz=RATE_HZ)
    size = len(made.p)
    rng = RandomStreams(4).generator("solution")
    if correlated:
        root = rng.normal(size=(size, size))
        made.p[:] = root @ root.T
    made.core[: size + 1] = rng.normal(size=size + 1)
    quaternion_from_euler(0.2, -0.1, 0.7, made.core[s.Q : s.Q + 4])
    made.core[s.CORRECTION_POS : s.CORRECTION_POS + 3] = 1.0, 2.0, 3.0
    made.core[s.CORRECTION_VEL : s.CORRECTION_VEL + 3] = -1.0, -2.0, -3.0
    made.history[:] = rng.normal(size=made.history.shape)
    made.history[:, s.HISTORY_Q : s.HISTORY_Q + 4] = made.core[s.Q : s.Q + 4]
    return made


def check_unknown(made: Solution, before: Array, variances: dict[int, float]) -> None:
    """These states have their variances and no correlations; everything else is as it was."""
    others = [k for k in range(len(made.p)) if k not in variances]
    for index, variance in variances.items():
        assert made.p[index, index] == pytest.approx(variance), index
        row = np.delete(made.p[index], index)
        assert not row.any(), index
        assert not np.delete(made.p[:, index], index).any(), index
    np.testing.assert_array_equal(made.p[np.ix_(others, others)], before[np.ix_(others, others)])


def attitude_variances(yaw_sigma: float) -> dict[int, float]:
    tilt, accel = PARAMETERS.alignment_tilt_rad**2, PARAMETERS.accel_bias_m_s2**2
    mag = PARAMETERS.magnetometer_bias_gauss**2
    return {
        s.ATT: tilt,
        s.ATT + 1: tilt,
        s.ATT + 2: yaw_sigma**2,
        **{s.ACCEL_BIAS + i: accel for i in range(3)},
        **{s.MAG_BIAS + i: mag for i in range(3)},
    }


@pytest.mark.parametrize("fixed_wing", [False, True])
def test_alignment(fixed_wing: bool) -> None:
    parameters = NavigationParameters(fixed_wing=fixed_wing)
    made = solution(parameters)
    made.align(0.1, -0.2, 2.5, yaw_sigma_rad=0.3)
    q = np.zeros(4)
    quaternion_from_euler(0.1, -0.2, 2.5, q)
    np.testing.assert_allclose(made.core[s.Q : s.Q + 4], q)
    np.testing.assert_allclose(made.core[s.R : s.R + 9].reshape(3, 3), rotation_matrix(q), atol=1e-12)
    gps = (0.1**2, 0.1**2, 0.2**2)
    variances = attitude_variances(0.3) | {
        **{s.VEL + i: 0.25 for i in range(3)},
        s.POS: 0.25,
        s.POS + 1: 0.25,
        s.POS + 2: 0.01,
        **{s.GYRO_BIAS + i: parameters.gyro_bias_rad_s**2 for i in range(3)},
        **{s.GPS_ERROR + i: gps[i] for i in range(3)},
        s.BARO_OFFSET: 2500.0,
    }
    if fixed_wing:
        variances |= {s.WIND: 25.0, s.WIND + 1: 25.0}
    assert len(variances) == len(made.p)
    check_unknown(made, made.p, variances)
    assert not made.core[s.X_MAG_BIAS : s.X_MAG_BIAS + 3].any()


@pytest.mark.parametrize("angle", [0.4, -2.0])
def test_turn_of_the_heading_turns_the_past_too(angle: float) -> None:
    made = solution()
    before, p = made.core.copy(), made.p.copy()
    made.core[s.ACCEL : s.ACCEL + 3] = 1.0, 2.0, -9.0
    made.turn_yaw(angle, yaw_sigma_rad=0.2)
    turn = rotation_matrix([math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)])
    expected = turn @ rotation_matrix(before[s.Q : s.Q + 4])
    for q in (made.core[s.Q : s.Q + 4], *made.history[:, s.HISTORY_Q : s.HISTORY_Q + 4]):
        np.testing.assert_allclose(rotation_matrix(q), expected, atol=1e-12)
    assert math.remainder(yaw_rad(made.core[s.Q : s.Q + 4]) - 0.7 - angle, 2.0 * math.pi) == pytest.approx(
        0.0
    )
    np.testing.assert_allclose(made.core[s.R : s.R + 9].reshape(3, 3), expected, atol=1e-12)
    force = np.array([1.0, 2.0, -9.0]) - made.core[s.X_ACCEL_BIAS : s.X_ACCEL_BIAS + 3]
    np.testing.assert_allclose(made.core[s.FORCE_NED : s.FORCE_NED + 3], expected @ force)
    check_unknown(made, p, attitude_variances(0.2))
    np.testing.assert_array_equal(made.history[:, : s.HISTORY_Q], solution().history[:, : s.HISTORY_Q])


def moved(made: Solution, before: Array) -> dict[int, float]:
    change = np.nan_to_num(made.core - before)  # the terrain is not known
    return {int(k): float(change[k]) for k in np.flatnonzero(change)}


def test_horizontal_jump() -> None:
    made = solution()
    before, p = made.core.copy(), made.p.copy()
    made.move_horizontally(3.0, -4.0)
    check_unknown(made, p, {s.POS: 1e4, s.POS + 1: 1e4, s.GPS_ERROR: 0.01, s.GPS_ERROR + 1: 0.01})
    assert moved(made, before) == pytest.approx(
        {
            s.X_POS: 3.0,
            s.X_POS + 1: -4.0,
            s.CORRECTION_POS: 3.0,
            s.CORRECTION_POS + 1: -4.0,
            s.X_GPS_ERROR: -before[s.X_GPS_ERROR],
            s.X_GPS_ERROR + 1: -before[s.X_GPS_ERROR + 1],
        }
    )
    assert made.position() == tuple(made.core[s.X_POS : s.X_POS + 3])


def test_jumps_of_velocity() -> None:
    made = solution()
    before, p = made.core.copy(), made.p.copy()
    made.change_velocity(2.0, -1.5, sigma_m_s=4.0)
    check_unknown(made, p, {s.VEL: 16.0, s.VEL + 1: 16.0})
    assert moved(made, before) == pytest.approx(
        {s.X_VEL: 2.0, s.X_VEL + 1: -1.5, s.CORRECTION_VEL: 2.0, s.CORRECTION_VEL + 1: -1.5}
    )
    before, p = made.core.copy(), made.p.copy()
    made.change_vertical_velocity(0.7)
    check_unknown(made, p, {s.VEL + 2: 9.0})
    assert moved(made, before) == pytest.approx({s.X_VEL + 2: 0.7, s.CORRECTION_VEL + 2: 0.7})


def test_jump_of_the_height_alone() -> None:
    made = solution()
    before, p = made.core.copy(), made.p.copy()
    made.move_vertically(5.0, with_baro=False)
    check_unknown(made, p, {s.POS + 2: 2500.0})
    assert moved(made, before) == pytest.approx({s.X_POS + 2: 5.0, s.CORRECTION_POS + 2: 5.0})


def test_jump_of_height_and_barometer_together_keeps_what_is_known_between_them() -> None:
    """The pressure altitude, height (up) and offset together, is as certain as before."""
    made = solution()
    before, p = made.core.copy(), made.p.copy()
    made.move_vertically(5.0, with_baro=True)
    assert moved(made, before) == pytest.approx(
        {s.X_POS + 2: 5.0, s.CORRECTION_POS + 2: 5.0, s.X_BARO_OFFSET: 5.0}
    )
    row = np.zeros(len(p))
    row[s.POS + 2], row[s.BARO_OFFSET] = -1.0, 1.0
    assert row @ made.p @ row == pytest.approx(row @ p @ row)
    change = made.p - p
    expected = np.zeros_like(p)
    expected[np.ix_([s.POS + 2, s.BARO_OFFSET], [s.POS + 2, s.BARO_OFFSET])] = 2500.0
    np.testing.assert_allclose(change, expected, atol=1e-9)


def test_offsets_and_errors_of_heights() -> None:
    made = solution()
    before, p = made.core.copy(), made.p.copy()
    made.set_baro_offset(12.0)
    check_unknown(made, p, {s.BARO_OFFSET: 2500.0})
    assert moved(made, before) == pytest.approx({s.X_BARO_OFFSET: 12.0 - before[s.X_BARO_OFFSET]})
    made.widen_baro_offset(3.0)
    assert made.p[s.BARO_OFFSET, s.BARO_OFFSET] == 2503.0
    before, p = made.core.copy(), made.p.copy()
    made.forget_gps_height_error()
    check_unknown(made, p, {s.GPS_ERROR + 2: 0.04})
    assert moved(made, before) == pytest.approx({s.X_GPS_ERROR + 2: -before[s.X_GPS_ERROR + 2]})


# -- the receiver's accuracy

NOISE = PARAMETERS.gps_position_noise_m


def accuracy(horizontal_m: float, vertical_m: float) -> tuple[float, float]:
    """eph and epv of a receiver whose slow error has these standard deviations."""
    return math.hypot(horizontal_m, NOISE[0]), math.hypot(vertical_m, NOISE[1])


def test_a_worse_accuracy_counts_at_once() -> None:
    made = solution()
    p = made.p.copy()
    made.set_gps_accuracy(*accuracy(2.0, 3.0))
    assert made.gps_error_var == pytest.approx((4.0, 4.0, 9.0))
    grown = np.diag(made.p - p)[s.GPS_ERROR : s.GPS_ERROR + 3]
    assert grown == pytest.approx([4.0 - 0.01, 4.0 - 0.01, 9.0 - 0.04])
    assert made.process[[cov.GPS_VAR_HORIZONTAL, cov.GPS_VAR_VERTICAL]] == pytest.approx([4.0, 9.0])
    # no better than the filter's own figure is accepted
    assert solution().gps_error_var == (0.1**2, 0.1**2, 0.2**2)
    other = solution()
    other.set_gps_accuracy(0.01, 0.01)
    assert other.gps_error_var == pytest.approx((0.01, 0.01, 0.04))


def test_a_somewhat_better_accuracy_counts_with_the_errors_time_constant() -> None:
    made = solution()
    made.set_gps_accuracy(*accuracy(2.0, 3.0))
    p = made.p.copy()
    made.steps += 100 * RATE_HZ  # 100 s
    made.set_gps_accuracy(*accuracy(1.0, 2.0))
    fade = math.exp(-2.0 * 100.0 / PARAMETERS.gps_position_tau_s)
    assert made.gps_error_var == pytest.approx((1.0 + 3.0 * fade, 1.0 + 3.0 * fade, 4.0 + 5.0 * fade))
    np.testing.assert_array_equal(made.p, p)
    made.set_gps_accuracy(*accuracy(1.0, 2.0))  # at the same time: nothing changes
    assert made.gps_error_var == pytest.approx((1.0 + 3.0 * fade, 1.0 + 3.0 * fade, 4.0 + 5.0 * fade))


def test_a_better_solution_shrinks_the_error_with_it() -> None:
    """RTK: an accuracy better by more than three times; the error's estimate and covariance go along."""
    made = solution()
    made.set_gps_accuracy(*accuracy(3.2, 3.2))
    before, p = made.core.copy(), made.p.copy()
    made.set_gps_accuracy(*accuracy(1.0, 1.1))
    factor = np.ones(len(p))
    factor[s.GPS_ERROR : s.GPS_ERROR + 2] = 1.0 / 3.2
    np.testing.assert_allclose(made.p, factor[:, None] * p * factor[None, :], rtol=1e-9)
    np.testing.assert_allclose(
        made.core[s.X_GPS_ERROR : s.X_GPS_ERROR + 3],
        before[s.X_GPS_ERROR : s.X_GPS_ERROR + 3] * [1.0 / 3.2, 1.0 / 3.2, 1.0],
    )
    assert made.gps_error_var[:2] == pytest.approx((1.0, 1.0))
    assert made.gps_error_var[2] == pytest.approx(3.2**2)  # the height's is less than three times better


def test_new_tuning_keeps_what_the_receiver_said() -> None:
    made = solution()
    made.set_gps_accuracy(*accuracy(2.0, 3.0))
    tuned = NavigationParameters(gyro_noise_rad_s_sqrt_hz=2e-3)
    made.set_parameters(tuned)
    expected = process_from(tuned)
    expected[[cov.GPS_VAR_HORIZONTAL, cov.GPS_VAR_VERTICAL]] = 4.0, 9.0
    np.testing.assert_allclose(made.process, expected)


# -- history


def test_rows_of_the_past() -> None:
    made = solution()
    period_us = 1_000_000 // RATE_HZ
    assert made.period_us == period_us
    assert made.rows == math.ceil(PARAMETERS.history_s * RATE_HZ) + RATE_HZ // PARAMETERS.covariance_rate_hz
    made.row, made.steps = 3, 10
    now_us = 50_000_000
    for back in range(10):
        expected = (3 - back) % made.rows
        assert made.row_at(now_us - back * period_us, now_us) == expected
        # the nearest one
        assert made.row_at(now_us - back * period_us + period_us // 2 - 1, now_us) == expected
        assert made.row_at(now_us - back * period_us - period_us // 2 + 1, now_us) == expected
    assert made.row_at(now_us - 10 * period_us, now_us) == -1  # before the first step
    assert made.row_at(now_us + 30_000, now_us) == 3  # of the future: the newest
    made.steps = 10_000
    assert made.row_at(now_us - (made.rows - 1) * period_us, now_us) == (3 - made.rows + 1) % made.rows
    assert made.row_at(now_us - made.rows * period_us, now_us) == -1


def test_the_past_is_seen_with_the_corrections_since() -> None:
    made = solution()
    np.testing.assert_allclose(made.past_position(5), made.history[5, :3] + [1.0, 2.0, 3.0] * np.ones(3))
    np.testing.assert_allclose(made.past_velocity(5), made.history[5, 3:6] - [1.0, 2.0, 3.0] * np.ones(3))


def test_clearing_forgets_all_but_the_place() -> None:
    made = solution()
    frame = Px4Frame(GeodeticPosition(lat_deg=47.0, lon_deg=8.0, alt_m=500.0))
    made.set_frame(frame)
    assert made.core[s.GRAVITY] == normal_gravity_m_s2(47.0, 500.0)
    np.testing.assert_array_equal(made.core[s.EARTH_RATE : s.EARTH_RATE + 3], earth_rate_ned_rad_s(47.0))
    made.row, made.steps, made.work[:] = 7, 9, 1.0
    made.clear()
    expected = np.zeros(s.CORE_SIZE)
    expected[s.Q] = 1.0
    expected[s.R : s.R + 9] = np.eye(3).ravel()
    expected[s.GRAVITY] = normal_gravity_m_s2(47.0, 500.0)
    expected[s.EARTH_RATE : s.EARTH_RATE + 3] = earth_rate_ned_rad_s(47.0)
    expected[s.STRETCH : s.STRETCH + 2] = frame.stretch
    expected[s.TERRAIN_DOWN] = math.nan
    np.testing.assert_array_equal(made.core, expected)
    for array in (made.p, made.history, made.work):
        assert not array.any()
    assert (made.row, made.steps) == (0, 0)
    fresh = Solution(PARAMETERS, physics_rate_hz=RATE_HZ)
    assert fresh.core[s.GRAVITY] == GRAVITY_M_S2


# -- process noise


def test_process_noise_of_the_parameters() -> None:
    """Densities squared; a bias of 1-sigma s that walks with q per root second has the variance s^2 and the
    time constant 2 s^2 / q^2 of its Gauss-Markov process."""
    p = PARAMETERS
    process = process_from(p)
    expected = {
        "NOISE_ATT": p.gyro_noise_rad_s_sqrt_hz**2,
        "NOISE_VEL": p.accel_noise_m_s2_sqrt_hz**2,
        "TURN_SCALE": p.gyro_scale_error**2,
        "TURN_TILT": p.gyro_scale_error**2 * p.gyro_scale_tilt_rad,
        "TURN_CROSS": p.gyro_cross_axis_error**2,
        "GYRO_BIAS_VAR": p.gyro_bias_rad_s**2,
        "GYRO_BIAS_TAU": 2.0 * p.gyro_bias_rad_s**2 / p.gyro_bias_walk_rad_s_sqrt_s**2,
        "ACCEL_BIAS_VAR": p.accel_bias_m_s2**2,
        "ACCEL_BIAS_TAU": 2.0 * p.accel_bias_m_s2**2 / p.accel_bias_walk_m_s2_sqrt_s**2,
        "GPS_VAR_HORIZONTAL": p.gps_position_walk_m[0] ** 2,
        "GPS_VAR_VERTICAL": p.gps_position_walk_m[1] ** 2,
        "GPS_TAU": p.gps_position_tau_s,
        "BARO_WALK": p.barometer_offset_walk_m_per_sqrt_s**2,
        "MAG_BIAS_VAR": p.magnetometer_bias_gauss**2,
        "MAG_BIAS_TAU": p.magnetometer_bias_tau_s,
        "MAG_BIAS_TURN": p.magnetometer_bias_turn_rad,
        "WIND_WALK": p.wind_walk_m_s_sqrt_s**2,
    }
    assert len(expected) == cov.PROCESS_SIZE
    assert {name: process[getattr(cov, name)] for name in expected} == pytest.approx(expected)
