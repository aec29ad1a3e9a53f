"""Terrain, sustained turns, contradictions, alignment, health and parameters of the filter, each alone."""

import math

import numpy as np
import pytest

from autopilot_bridge.navigation import NavigationParameters
from autopilot_bridge.navigation import states as s
from autopilot_bridge.navigation.alignment import Alignment, magnetic_heading_rad, tilt_from_accel
from autopilot_bridge.navigation.clocks import Clocks, Contradictions
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.solution import Solution
from autopilot_bridge.navigation.sustained_turn import SustainedTurn
from autopilot_bridge.navigation.terrain import TerrainEstimator, update_terrain
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.interface import IMU_ACCEL_FRD_M_S2, IMU_GYRO_FRD_RAD_S, RANGE_DISTANCE_M, SensorReadings
from tests.rotations import rotation_matrix

P = NavigationParameters()
NOW_US = 10_000_000


# -- terrain


def terrain(down_m: float = 5.0, *, at_us: int = NOW_US) -> TerrainEstimator:
    """One that knows the ground from a landing."""
    made = TerrainEstimator(P)
    made.landed(at_us, down_m - P.ground_clearance_m)
    made.predict(at_us, 0.0)
    return made


def test_the_first_range_is_the_ground() -> None:
    made = TerrainEstimator(P)
    assert math.isnan(made.down_m)
    assert not made.valid(NOW_US)
    made.fuse(NOW_US, 20.0, math.cos(0.3), -15.0)
    assert made.down_m == pytest.approx(-15.0 + 20.0 * math.cos(0.3))
    assert made.in_use
    assert made.test_ratio == 0.0
    assert made.valid(NOW_US)


def test_ranges_are_fused_by_a_kalman_filter() -> None:
    made = terrain()
    elapsed_s, speed = 0.5, 8.0
    made.predict(NOW_US + 500_000, speed)
    variance = P.rangefinder_noise_m**2 + elapsed_s * (
        P.terrain_walk_m_per_sqrt_s**2 + 0.1 * (P.terrain_gradient * speed) ** 2
    )
    noise = P.rangefinder_noise_m**2 + (P.rangefinder_noise_fraction * 20.0) ** 2
    measured = -14.8 + 20.0
    made.fuse(NOW_US + 500_000, 20.0, 1.0, -14.8)
    gain = variance / (variance + noise)
    assert made.down_m == pytest.approx(5.0 + gain * (measured - 5.0))
    assert made.test_ratio == pytest.approx(
        (measured - 5.0) / (P.rangefinder_gate * math.sqrt(variance + noise))
    )
    # what is left of the variance shows in the next gain
    left = (1.0 - gain) * variance
    before = made.down_m
    made.fuse(NOW_US + 500_000, 20.0, 1.0, -14.7)
    assert made.down_m == pytest.approx(before + left / (left + noise) * (5.3 - before))


@pytest.mark.parametrize(
    ("distance_m", "tilt_rad", "used"),
    [
        (20.0, 0.0, True),
        (20.0, P.rangefinder_max_tilt_rad - 0.01, True),
        (20.0, P.rangefinder_max_tilt_rad + 0.01, False),
        (0.0, 0.0, False),
        (-1.0, 0.0, False),
        (9.9e3, 0.0, True),
        (1.01e4, 0.0, False),
        (math.nan, 0.0, False),
    ],
)
def test_ranges_out_of_range_or_tilted_are_not_used(distance_m: float, tilt_rad: float, used: bool) -> None:
    made = TerrainEstimator(P)
    made.fuse(NOW_US, distance_m, math.cos(tilt_rad), 0.0)
    assert made.in_use is used
    assert math.isfinite(made.down_m) is used


def test_a_step_of_the_ground_is_taken_after_a_second() -> None:
    made = terrain()
    for later_us, taken in ((200_000, False), (1_000_000, False), (1_000_001, True)):
        made.fuse(NOW_US + later_us, 20.0, 1.0, 0.0)
        assert (made.down_m == 20.0) is taken
        assert not made.in_use
    made.fuse(NOW_US + 1_200_000, 20.0, 1.0, 0.0)
    assert made.in_use


def test_the_ground_is_given_up_after_its_timeout_and_moves_with_the_frame() -> None:
    made = terrain()
    made.shift(-2.0)
    assert made.down_m == 3.0
    timeout_us = round(P.terrain_timeout_s * 1e6)
    made.predict(NOW_US + timeout_us, 0.0)
    assert made.down_m == 3.0
    made.predict(NOW_US + timeout_us + 1, 0.0)
    assert math.isnan(made.down_m)
    assert not made.in_use


def test_terrain_of_a_flight() -> None:
    solution = Solution(P, physics_rate_hz=250)
    solution.steps = 50
    solution.core[s.CORRECTION_POS + 2] = 1.0
    quaternion_from_euler(0.2, 0.1, 1.0, solution.history[0, s.HISTORY_Q : s.HISTORY_Q + 4])
    solution.history[0, s.HISTORY_POS + 2] = -30.0
    readings = SensorReadings()
    ranged = readings.rangefinder
    ranged.time_us, ranged.values[RANGE_DISTANCE_M] = NOW_US, 25.0
    made = TerrainEstimator(P)
    update_terrain(made, solution, ranged, NOW_US, slow=False, at_rest=False)
    down = -29.0 + 25.0 * rotation_matrix(solution.history[0, s.HISTORY_Q : s.HISTORY_Q + 4])[2, 2]
    assert solution.core[s.TERRAIN_DOWN] == pytest.approx(down)
    solution.core[s.X_POS + 2] = 7.0
    update_terrain(made, solution, None, NOW_US, slow=True, at_rest=True)
    assert solution.core[s.TERRAIN_DOWN] == pytest.approx(7.0 + P.ground_clearance_m)


# -- turns of an aircraft


def test_a_sustained_turn_widens_the_gyro_biases_by_scale_and_cross_axis_errors() -> None:
    solution = Solution(P, physics_rate_hz=250)
    turn = SustainedTurn(P, solution=solution)
    rate = np.array([0.02, -0.05, 0.3])
    solution.core[s.X_GYRO_BIAS : s.X_GYRO_BIAS + 3] = 0.01
    mean, reference, widened = np.zeros(3), np.zeros(3), np.zeros(3)
    for k in range(1, 60):
        solution.core[s.SUM_GYRO : s.SUM_GYRO + 3] = (rate + 0.01) * 0.2 * k
        solution.core[s.SUM_GYRO_TIME] = 0.2 * k
        turn.update()
        mean += (rate - mean) * 0.2 / 2.0
        change = mean - reference
        if np.abs(change).max() >= 0.05:
            reference = mean.copy()
            others = (change**2).sum() - change**2
            widened += 4.0 * (P.gyro_scale_error**2 * change**2 + P.gyro_cross_axis_error**2 * others)
    assert widened[2] > 0.0
    np.testing.assert_allclose(np.diag(solution.p)[s.GYRO_BIAS : s.GYRO_BIAS + 3], widened, rtol=1e-9)
    before = solution.p.copy()
    turn.restart()
    solution.core[s.SUM_GYRO_TIME] = 0.0
    turn.update()
    np.testing.assert_array_equal(solution.p, before)


# -- clocks


@pytest.mark.parametrize(("gap_s", "too_many"), [(10.0, True), (10.1, False)])
def test_four_contradictions_shortly_after_each_other_are_too_many(gap_s: float, too_many: bool) -> None:
    made = Contradictions()
    for k in range(4):
        assert not made.too_many
        made.note(NOW_US + round(k * gap_s * 1e6))
    assert made.too_many is too_many
    made.restart()
    assert not made.too_many
    for _ in range(3):
        made.note(NOW_US)
    assert not made.too_many


def test_nothing_has_aided_at_boot() -> None:
    clocks = Clocks()
    times = {name: getattr(clocks, name) for name in dir(clocks) if name.endswith("_us")}
    assert len(times) == 12
    assert set(times.values()) == {-1}
    assert clocks.height_held is False


def test_health_at_boot_claims_nothing() -> None:
    health = NavigationHealth()
    flags = {name for name in vars(health) if getattr(health, name) is True}
    assert flags == {"uninitialised"}
    ratios = [name for name in vars(health) if name.endswith("_ratio")]
    assert len(ratios) == 6
    assert not any(getattr(health, name) for name in ratios)
    for name in ("position_horizontal", "position_vertical"):
        assert math.isnan(getattr(health, f"{name}_accuracy_m"))
    assert math.isnan(health.velocity_accuracy_m_s)
    assert all(map(math.isnan, (*health.attitude_accuracy_rad, *health.wind_variance_m2_s2)))
    assert health.time_since_gps_us == -1
    resets = (health.filter_resets, health.position_resets, health.height_resets, health.yaw_resets)
    assert resets == (0, 0, 0, 0)
    assert (health.position_reset_ne_m, health.height_reset_down_m, health.yaw_reset_rad) == (
        (0.0, 0.0),
        0.0,
        0.0,
    )
    health.position_resets = 3
    health.attitude = True
    health.uninitialised = False
    health.clear()
    assert (health.position_resets, health.attitude, health.uninitialised) == (3, False, True)


# -- alignment


def readings_of(
    roll: float, pitch: float, yaw: float, field_ned: tuple[float, float, float]
) -> SensorReadings:
    q = np.zeros(4)
    quaternion_from_euler(roll, pitch, yaw, q)
    r = rotation_matrix(q)
    readings = SensorReadings()
    readings.imu.fresh = readings.magnetometer.fresh = True
    readings.imu.values[IMU_ACCEL_FRD_M_S2] = r.T @ [0.0, 0.0, -GRAVITY_M_S2]
    readings.imu.values[IMU_GYRO_FRD_RAD_S] = 0.0
    readings.magnetometer.values[:] = r.T @ field_ned
    return readings


@pytest.mark.parametrize(
    ("roll", "pitch", "yaw"), [(0.0, 0.0, 0.0), (0.3, -0.2, 1.0), (-0.5, 0.4, -2.5), (0.1, 1.2, 3.0)]
)
def test_attitude_of_rest(roll: float, pitch: float, yaw: float) -> None:
    readings = readings_of(roll, pitch, yaw, (0.22, 0.0, 0.41))
    found = tilt_from_accel(readings.imu.values[IMU_ACCEL_FRD_M_S2])
    assert found == pytest.approx((roll, pitch))
    heading, horizontal, down = magnetic_heading_rad(readings.magnetometer.values, roll, pitch)
    assert math.remainder(heading - yaw, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert (horizontal, down) == pytest.approx((0.22, 0.41))


def test_alignment_averages_while_the_vehicle_rests() -> None:
    made = Alignment(duration_s=0.5, dt_s=0.004)
    one, other = readings_of(0.1, 0.0, 0.0, (0.2, 0.0, 0.4)), readings_of(-0.1, 0.0, 0.0, (0.3, 0.0, 0.4))
    for _ in range(62):
        made.step(one)
        made.step(other)
    assert not made.ready
    made.step(one)
    made.step(other)
    assert made.ready
    mean = 0.5 * (one.imu.values[IMU_ACCEL_FRD_M_S2] + other.imu.values[IMU_ACCEL_FRD_M_S2])
    np.testing.assert_allclose(made.accel_frd_m_s2, mean, atol=1e-9)
    field = 0.5 * (one.magnetometer.values + other.magnetometer.values)
    np.testing.assert_allclose(made.mag_frd_gauss, field, atol=1e-9)


def test_alignment_waits_longer_for_a_magnetometer() -> None:
    made = Alignment(duration_s=0.5, dt_s=0.004)
    readings = readings_of(0.0, 0.0, 0.0, (0.2, 0.0, 0.4))
    readings.magnetometer.fresh = False
    for k in range(1, 501):
        made.step(readings)
        assert made.ready is (k >= 500)
    assert made.mag_frd_gauss is None


@pytest.mark.parametrize(
    ("force", "rate", "rests"),
    [
        (1.19, 0.0, True),
        (0.81, 0.0, True),
        (1.21, 0.0, False),
        (0.79, 0.0, False),
        (1.0, 0.25, True),
        (1.0, 0.27, False),
        (math.nan, 0.0, False),
    ],
)
def test_alignment_starts_again_with_motion(force: float, rate: float, rests: bool) -> None:
    made = Alignment(duration_s=0.1, dt_s=0.004)
    quiet = readings_of(0.0, 0.0, 0.0, (0.2, 0.0, 0.4))
    for _ in range(24):
        made.step(quiet)
    moving = readings_of(0.0, 0.0, 0.0, (0.2, 0.0, 0.4))
    moving.imu.values[IMU_ACCEL_FRD_M_S2] *= force
    moving.imu.values[IMU_GYRO_FRD_RAD_S.start + 1] = rate
    made.step(moving)
    made.step(quiet)
    assert made.ready is rests


@pytest.mark.parametrize(("scale", "used"), [(0.12, True), (0.11, False), (4.4, True), (4.5, False)])
def test_fields_that_are_not_the_earths_are_not_averaged(scale: float, used: bool) -> None:
    """0.05 to 2 gauss; here of a field of 0.447 gauss."""
    made = Alignment(duration_s=0.1, dt_s=0.004)
    readings = readings_of(0.0, 0.0, 0.0, (0.2 * scale, 0.0, 0.4 * scale))
    made.step(readings)
    assert (made.mag_frd_gauss is not None) is used


# -- parameters


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"magnetic_year": 2024.9}, "magnetic_year"),
        ({"magnetic_year": 2030.1}, "magnetic_year"),
        ({"history_s": 10.1}, "history_s"),
        ({"mag_ned_gauss": (0.03, 0.0, 0.03)}, "mag_ned_gauss"),
        ({"mag_ned_gauss": (math.inf, 0.0, 0.0)}, "mag_ned_gauss"),
        ({"mag_ned_gauss": (math.nan, 0.0, 0.0)}, "mag_ned_gauss"),
        ({"gps_gate": 0.0}, "gps_gate"),
        ({"imu_timeout_s": -1.0}, "imu_timeout_s"),
    ],
)
def test_parameters_out_of_range_are_named(changes: dict[str, float], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        NavigationParameters(**changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "changes",
    [
        {"magnetic_year": 2025.0},
        {"magnetic_year": 2030.0},
        {"history_s": 10.0},
        {"mag_ned_gauss": (0.05, 0.0, 0.0)},
        {"mag_ned_gauss": (0.2, 0.02, 0.43)},
    ],
)
def test_parameters_at_their_limits_are_accepted(changes: dict[str, float]) -> None:
    NavigationParameters(**changes)  # type: ignore[arg-type]
