"""What the filter does when sensors come, go, lie and are silent."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from autopilot_bridge.navigation import layout
from autopilot_bridge.navigation import states as s
from flightsim import truth as t
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.magnetics import magnetic_field_ned_gauss
from flightsim.interface import GPS_EPH_M
from flightsim.sensors.fault_kinds import FaultType, SensorUnit
from flightsim.sensors.gps import FIX_AT_BOOT, RTK_FIX_AFTER_10_S, GpsParameters
from flightsim.sensors.suite import SensorSuiteParameters
from tests.navigation.bench import PARAMETERS, Bench
from tests.navigation.kinematic_flight import HOME, Lissajous, fly
from tests.rotations import rotation_matrix, yaw_rad

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def flight() -> Array:
    return fly(75.0)


@pytest.fixture(scope="module")
def hover() -> Array:
    """Rest for 8 s, then hover at 5 m, still."""
    path = Lissajous(size_m=0.0, height_m=5.0, swing_m=0.0)
    return fly(60.0, path=path, yaw=lambda time_s: 0.7 + 0.0 * time_s)


@pytest.fixture(scope="module")
def rest() -> Array:
    return fly(60.0, path=lambda time_s: np.zeros((len(time_s), 3)), yaw=lambda time_s: 0.7 + 0.0 * time_s)


def tilt_deg(bench: Bench) -> float:
    return math.degrees(math.hypot(*bench.error()[:2]))


def yaw_deg(bench: Bench) -> float:
    return abs(math.degrees(bench.error()[2]))


def position_m(bench: Bench) -> float:
    return float(np.linalg.norm(bench.error()[6:9]))


# starting


def test_nothing_is_claimed_before_alignment(rest: Array) -> None:
    bench = Bench(rest).run(0.3)
    health = bench.filter.health
    assert health.uninitialised
    assert not (health.attitude or health.position_horizontal_absolute or health.position_vertical_absolute)
    assert bench.filter.origin is None
    assert math.isnan(bench.filter.state[layout.HEIGHT_ABOVE_GROUND_M])


def test_start(rest: Array) -> None:
    bench = Bench(rest).run(3.0)
    health, nav = bench.filter.health, bench.filter
    assert not health.uninitialised
    assert health.attitude and health.yaw_aligned and health.position_horizontal_absolute
    assert health.gps_in_use and health.barometer_in_use and health.magnetometer_in_use
    assert not (health.constant_position or health.gps_glitch or health.accel_error)
    assert health.position_resets == 1 and health.height_resets == 1 and health.filter_resets == 0
    assert nav.origin is not None
    assert nav.origin.lat_deg == pytest.approx(HOME.lat_deg, abs=2e-5)
    assert nav.origin.alt_m == pytest.approx(HOME.alt_m, abs=3.0)
    assert tilt_deg(bench) < 1.0 and yaw_deg(bench) < 3.0 and position_m(bench) < 1.5


def test_gps_is_used_only_after_its_checks_have_held(rest: Array) -> None:
    parameters = replace(PARAMETERS, gps_check_time_s=4.0)
    bench = Bench(rest, parameters=parameters).run(4.0)
    assert bench.filter.origin is None and bench.filter.health.constant_position
    assert bench.filter.health.gps_quality
    assert bench.filter.health.predicted_position_horizontal_absolute
    bench.run(4.6)
    assert bench.filter.origin is not None and bench.filter.health.position_horizontal_absolute


@pytest.mark.parametrize(
    "change",
    [
        {"gps_required_satellites": 11},
        {"gps_required_eph_m": 0.1},
        {"gps_required_hdop": 0.5},
        {"gps_required_speed_accuracy_m_s": 0.01},
    ],
)
def test_a_poor_fix_is_not_used(rest: Array, change: dict[str, float]) -> None:
    bench = Bench(rest, parameters=replace(PARAMETERS, **change)).run(8.0)
    assert bench.filter.origin is None
    assert not bench.filter.health.gps_quality and not bench.filter.health.gps_in_use


def test_late_fix(flight: Array) -> None:
    """ArduPilot's receiver: the fix comes at 10 s, here in the climb; attitude and height come before."""
    sensors = SensorSuiteParameters(gps=GpsParameters(fix_timeline=RTK_FIX_AFTER_10_S))
    bench = Bench(flight, sensors=sensors).run(9.5)
    health = bench.filter.health
    assert health.attitude and health.constant_position and health.position_vertical_absolute
    assert not health.position_horizontal_absolute
    assert tilt_deg(bench) < 1.5
    bench.run(30.0)
    assert health.position_horizontal_absolute and position_m(bench) < 1.5 and tilt_deg(bench) < 0.5


def test_origin_from_outside(rest: Array) -> None:
    sensors = SensorSuiteParameters(gps=None)
    bench = Bench(rest, sensors=sensors).run(2.0)
    bench.filter.set_origin(HOME)
    assert bench.filter.origin == HOME
    with pytest.raises(ValueError, match="has one already"):
        bench.filter.set_origin(GeodeticPosition(lat_deg=0.0, lon_deg=0.0, alt_m=0.0))


def test_declination_comes_from_the_world_magnetic_model() -> None:
    """Far from Europe: 14 deg of declination must be gone as soon as the origin is known."""
    home = GeodeticPosition(lat_deg=45.0, lon_deg=-112.0, alt_m=1500.0)
    field = magnetic_field_ned_gauss(home.lat_deg, home.lon_deg, home.alt_m, 2026.0)
    assert abs(math.degrees(math.atan2(field[1], field[0]))) > 9.0
    truth = fly(20.0, home=home, mag_ned_gauss=(field[0], field[1], field[2]))
    bench = Bench(truth, parameters=replace(PARAMETERS, mag_ned_gauss=None)).run(1.0)
    assert yaw_deg(bench) > 8.0  # magnetic north until then
    bench.run(8.0)
    assert bench.filter.health.yaw_resets == 1
    assert yaw_deg(bench) < 2.5 and position_m(bench) < 1.5


def test_initial_misalignment_is_corrected(flight: Array) -> None:
    bench = Bench(flight).run(2.0)
    solution = bench.filter._solution
    solution.turn_yaw(math.radians(20.0), yaw_sigma_rad=0.5)
    bench.run(2.004)
    assert yaw_deg(bench) > 15.0
    bench.run(30.0)
    assert yaw_deg(bench) < 1.5 and tilt_deg(bench) < 0.5


# estimating


def test_biases_are_found(flight: Array) -> None:
    """Errors of the biases agree with their standard deviations, which have shrunk far below the priors."""
    for seed in range(4):
        bench = Bench(flight, seed=seed).run(74.0)
        gyro = bench.suite.readings.imu.values[:3]
        sigma = np.sqrt(np.diag(bench.filter.covariance))
        assert sigma[9:12].max() < 4e-4 < PARAMETERS.gyro_bias_rad_s
        assert sigma[14] < 0.012 < PARAMETERS.accel_bias_m_s2
        error = bench.truth[t.RATES_FRD_RAD_S] - bench.filter.state[layout.RATES_FRD_RAD_S]
        assert np.abs(error).max() < 0.03 and np.isfinite(gyro).all()


def test_bias_of_a_known_size(hover: Array) -> None:
    sensors = SensorSuiteParameters()
    assert sensors.imu is not None
    still = replace(
        sensors, imu=replace(sensors.imu, gyro_turn_on_bias_rad_s=0.0, gyro_bias_instability_rad_s=0.0)
    )
    bench = Bench(hover, sensors=still)
    bench.run(2.0)
    bench.suite.faults.inject(SensorUnit.GYRO, FaultType.WRONG, bias=(0.004, -0.003, 0.002))
    bench.run(59.0)
    np.testing.assert_allclose(bench.filter.state[layout.GYRO_BIAS_RAD_S], [0.004, -0.003, 0.002], atol=6e-4)


def test_rest_hint_keeps_velocity_and_biases_quiet(rest: Array) -> None:
    bench = Bench(rest).run(1.0)
    bench.filter.vehicle_at_rest = True
    bench.run(20.0)
    sigma = np.sqrt(np.diag(bench.filter.covariance))
    assert np.linalg.norm(bench.error()[3:6]) < 0.02
    assert sigma[9:12].max() < 2e-4  # all three gyro biases, yaw's too
    assert bench.filter.health.position_vertical_agl
    assert bench.filter.state[layout.HEIGHT_ABOVE_GROUND_M] == pytest.approx(0.1, abs=0.05)


def test_state_is_complete_and_consistent(flight: Array) -> None:
    bench = Bench(flight).run(40.0)
    state, truth = bench.filter.state, bench.truth
    assert np.linalg.norm(state[layout.Q_NED_FROM_FRD]) == pytest.approx(1.0)
    np.testing.assert_allclose(
        state[layout.SPECIFIC_FORCE_FRD_M_S2], truth[t.SPECIFIC_FORCE_FRD_M_S2], atol=0.2
    )
    np.testing.assert_allclose(state[layout.ACC_NED_M_S2], state_acceleration(truth), atol=0.25)
    assert state[layout.EULER_RAD][2] == pytest.approx(yaw_rad(truth[t.Q_NED_FROM_FRD]), abs=0.02)
    assert np.isnan(state[layout.WIND_NED_M_S]).all()


def state_acceleration(truth: Array) -> Array:
    return rotation_matrix(truth[t.Q_NED_FROM_FRD]) @ truth[t.SPECIFIC_FORCE_FRD_M_S2] + [0.0, 0.0, 9.8076]


def test_latency_is_compensated(flight: Array) -> None:
    """Ignoring the receiver's 110 ms puts the position behind by the distance flown in them."""

    def errors(ignore: bool) -> tuple[float, float]:
        bench = Bench(flight).run(20.0)
        reading = bench.suite.readings.gps
        position, velocity = [], []

        def pretend() -> None:
            if reading.fresh and ignore:
                reading.time_us = (bench.step + 1) * bench.period_us
            if bench.step % 50 == 0:
                error = bench.error()
                position.append(np.linalg.norm(error[6:8]))
                velocity.append(np.linalg.norm(error[3:5]))

        suite_step = bench.suite.step

        class Suite:
            def step(self, time_us: int) -> None:
                suite_step(time_us)
                if reading.fresh and ignore:
                    reading.time_us = time_us

        bench.suite = Suite()  # type: ignore[assignment]
        bench.run(60.0, pretend)
        return float(np.sqrt(np.mean(np.square(position)))), float(np.sqrt(np.mean(np.square(velocity))))

    compensated, ignored = errors(False), errors(True)
    assert compensated[0] < 0.3 and compensated[1] < 0.06
    assert ignored[0] > 2.0 * compensated[0] and ignored[1] > 2.0 * compensated[1]


# losing GPS


def test_gps_loss_and_return(flight: Array) -> None:
    bench = Bench(flight).run(30.0)
    health = bench.filter.health
    bench.suite.faults.inject(SensorUnit.GPS, FaultType.OFF)
    bench.run(31.9)
    assert health.dead_reckoning and health.position_horizontal_absolute and health.velocity_horizontal
    bench.run(34.8)  # the last fix is of 30 s or up to 0.2 s before
    assert health.position_horizontal_absolute and position_m(bench) < 4.0
    bench.run(35.3)
    assert not (health.position_horizontal_absolute or health.position_horizontal_relative)
    assert not health.velocity_horizontal and health.constant_position and not health.gps_in_use
    assert health.attitude and health.position_vertical_absolute and health.velocity_vertical
    held = bench.filter.state[layout.POS_NED_M][:2].copy()
    bench.run(50.0)
    assert tilt_deg(bench) < 4.0 and yaw_deg(bench) < 4.0
    assert abs(bench.error()[8]) < 1.5  # barometer
    assert (
        np.linalg.norm(bench.filter.state[layout.POS_NED_M][:2] - held) < 80.0
    )  # roughly held, although it flies at 13 m/s
    assert health.time_since_gps_us >= 19_000_000
    bench.suite.faults.clear(SensorUnit.GPS)
    bench.run(51.0)
    assert not health.position_horizontal_absolute  # the checks have to hold for a second first
    bench.run(51.6)
    assert health.position_horizontal_absolute and health.gps_in_use and not health.constant_position
    bench.run(54.0)
    assert position_m(bench) < 1.5 and np.linalg.norm(bench.error()[3:6]) < 0.3
    assert health.position_resets == 2 and health.filter_resets == 0
    assert math.hypot(*health.position_reset_ne_m) > 5.0


def test_velocity_of_a_landing_without_position_is_claimed_only_when_it_is_zero(rest: Array) -> None:
    bench = Bench(rest).run(10.0)
    nav, health = bench.filter, bench.filter.health
    bench.suite.faults.inject(SensorUnit.GPS, FaultType.OFF)
    bench.run(20.0)
    assert health.constant_position and not health.velocity_horizontal
    nav._solution.change_velocity(5.0, -3.0, sigma_m_s=0.1)  # five wrong metres per second, accepted
    nav.vehicle_at_rest = True
    claimed: list[float] = []

    def look() -> None:
        if health.velocity_horizontal:
            claimed.append(math.hypot(*nav.state[layout.VEL_NED_M_S][:2]))

    bench.run(25.0, each=look)
    assert claimed and max(claimed) < 1.0
    assert len(claimed) > 3.0 * bench.rate_hz
    assert claimed[-1] < 0.1


def test_attitude_stays_good_indoors(hover: Array) -> None:
    bench = Bench(hover, sensors=SensorSuiteParameters(gps=None)).run(59.0)
    health = bench.filter.health
    assert health.attitude and health.constant_position and health.position_vertical_absolute
    assert not health.position_horizontal_absolute and bench.filter.origin is None
    assert tilt_deg(bench) < 0.6
    assert -bench.filter.state[layout.POS_NED_M][2] == pytest.approx(5.0, abs=0.8)


@pytest.mark.parametrize("failure", [FaultType.GARBAGE, FaultType.STUCK])
def test_a_lying_receiver_is_not_accepted(flight: Array, failure: FaultType) -> None:
    bench = Bench(flight).run(30.0)
    bench.suite.faults.inject(SensorUnit.GPS, failure)
    worst = 0.0
    health = bench.filter.health
    while bench.time_s < 50.0:
        bench.run(bench.time_s + 0.5)
        if health.position_horizontal_absolute:
            worst = max(worst, position_m(bench))
    assert worst < 6.0
    assert not health.position_horizontal_absolute
    bench.suite.faults.clear(SensorUnit.GPS)
    bench.run(60.0)
    assert health.position_horizontal_absolute and position_m(bench) < 1.5


def test_a_constant_gps_offset_is_refused_and_then_accepted(flight: Array) -> None:
    bench = Bench(flight).run(30.0)
    health = bench.filter.health
    bench.suite.faults.inject(SensorUnit.GPS, FaultType.WRONG, bias=(30.0, 0.0, 0.0))
    bench.run(36.5)
    assert position_m(bench) < 1.5 and health.gps_glitch and health.position_horizontal_test_ratio > 1.0
    assert health.position_resets == 1
    bench.run(39.0)  # 7 s after the last accepted one
    assert health.position_resets == 2 and not health.gps_glitch
    assert bench.error()[6] == pytest.approx(-30.0, abs=1.0)


@pytest.mark.slow
def test_standalone_receiver_wanders_as_much_as_it_says(flight: Array) -> None:
    """The origin takes over the error of the first fix, and the covariance has it: over seeds, each way."""
    sensors = SensorSuiteParameters(gps=GpsParameters.standalone())
    seeds = 12
    position, down = [], []
    for seed in range(1, seeds + 1):
        bench = Bench(flight, sensors=sensors, seed=seed).run(70.0)
        health = bench.filter.health
        assert health.position_horizontal_absolute and health.position_resets == 1
        assert health.position_horizontal_accuracy_m > 1.5 and health.position_vertical_accuracy_m > 2.0
        position.append(bench.nees()[2])
        down.append(bench.error()[8] ** 2 / bench.filter.covariance[s.POS + 2, s.POS + 2])
    assert max(position) < chi2.ppf(0.9999, 3)
    for nees, degrees in ((position, 3), (down, 1)):
        low, high = chi2.ppf([0.025, 0.975], degrees * seeds) / seeds
        assert low < np.mean(nees) < high


@pytest.mark.parametrize("seed", [3, 4])
def test_a_reported_accuracy_that_gets_worse_is_accepted_at_once(flight: Array, seed: int) -> None:
    """Corrections end: metres of slow error from one fix to the next. They don't move the position."""
    degraded = (*FIX_AT_BOOT, replace(FIX_AT_BOOT[0], start_s=30.0, error_scale=10.0))
    receiver = GpsParameters(
        horizontal_noise_m=0.02,
        vertical_noise_m=0.05,
        horizontal_wander_m=0.2,
        vertical_wander_m=0.3,
        fix_timeline=degraded,
    )
    parameters = replace(
        PARAMETERS, gps_required_eph_m=10.0, gps_required_epv_m=10.0, gps_required_speed_accuracy_m_s=5.0
    )
    bench = Bench(flight, sensors=SensorSuiteParameters(gps=receiver), parameters=parameters, seed=seed)
    bench.run(29.5)
    before = bench.error()[6:9]
    bench.run(36.0)
    assert float(bench.suite.readings.gps.values[GPS_EPH_M]) > 2.0
    assert np.linalg.norm(bench.error()[6:9] - before) < 0.7


def test_corrections_that_come_later_move_the_position_at_once(flight: Array) -> None:
    corrected = (*FIX_AT_BOOT, replace(FIX_AT_BOOT[0], start_s=30.0, fix_type=6, error_scale=0.02))
    sensors = SensorSuiteParameters(gps=GpsParameters.standalone(fix_timeline=corrected))
    bench = Bench(flight, sensors=sensors, seed=3).run(29.5)
    assert position_m(bench) > 3.0
    bench.run(45.0)
    assert position_m(bench) < 0.3 and bench.nees()[2] < chi2.ppf(0.9999, 3)


# losing the others


def test_a_spike_is_refused(flight: Array) -> None:
    bench = Bench(flight).run(30.0)
    readings, health = bench.suite.readings, bench.filter.health
    reference = Bench(flight).run(31.0)
    spiked = 0

    suite_step = bench.suite.step

    class Suite:
        def step(self, time_us: int) -> None:
            nonlocal spiked
            suite_step(time_us)
            if readings.magnetometer.fresh and spiked < 3:
                spiked += 1
                readings.magnetometer.values[:] += 0.3
                readings.barometer.values[0] -= 500.0

    bench.suite = Suite()  # type: ignore[assignment]
    bench.run(30.1)
    assert spiked == 3
    bench.run(31.0)
    np.testing.assert_allclose(bench.filter.state[:13], reference.filter.state[:13], atol=0.02)
    assert not health.accel_error


@pytest.mark.parametrize("failure", [FaultType.OFF, FaultType.GARBAGE, FaultType.STUCK, FaultType.WRONG])
def test_magnetometer_lost(flight: Array, failure: FaultType) -> None:
    bench = Bench(flight).run(30.0)
    health = bench.filter.health
    bench.suite.faults.inject(SensorUnit.MAG, failure)
    bench.run(50.0)
    assert not health.magnetometer_in_use
    if failure is not FaultType.OFF:
        assert health.magnetometer_test_ratio > 1.0
    assert yaw_deg(bench) < 2.0 and position_m(bench) < 1.5  # GPS velocity and acceleration carry the yaw
    bench.suite.faults.clear(SensorUnit.MAG)
    bench.run(60.0)
    assert health.magnetometer_in_use and yaw_deg(bench) < 1.5


@pytest.mark.parametrize("failure", [FaultType.OFF, FaultType.GARBAGE, FaultType.WRONG, FaultType.STUCK])
def test_barometer_lost(flight: Array, failure: FaultType) -> None:
    bench = Bench(flight).run(30.0)
    health = bench.filter.health
    bench.suite.faults.inject(SensorUnit.BARO, failure)
    bench.run(33.0)
    assert not health.barometer_in_use
    bench.run(50.0)
    assert health.position_vertical_absolute and abs(bench.error()[8]) < 1.2
    bench.suite.faults.clear(SensorUnit.BARO)
    bench.run(62.0)
    assert health.barometer_in_use and abs(bench.error()[8]) < 1.2


def test_no_height_sensor_at_all(hover: Array) -> None:
    bench = Bench(hover).run(20.0)
    bench.suite.faults.inject(SensorUnit.BARO, FaultType.OFF)
    bench.suite.faults.inject(SensorUnit.GPS, FaultType.OFF)
    bench.run(26.0)
    assert not bench.filter.health.position_vertical_absolute
    bench.run(55.0)
    assert np.isfinite(bench.filter.state[:28]).all() and bench.filter.health.attitude
    assert abs(bench.filter.state[layout.VEL_NED_M_S][2]) < 2.0


@pytest.mark.parametrize("unit", [SensorUnit.GYRO, SensorUnit.ACCEL])
def test_recovery_from_imu_garbage(flight: Array, unit: SensorUnit) -> None:
    """Nothing can fly on it, but it must be noticed, stay finite and end with the fault."""
    bench = Bench(flight).run(30.0)
    health = bench.filter.health
    bench.suite.faults.inject(unit, FaultType.GARBAGE)
    noticed = False
    while bench.time_s < 36.0:
        bench.run(bench.time_s + 0.1)
        noticed = noticed or health.accel_error
        assert np.isfinite(bench.filter.state[:28]).all()
    assert noticed
    bench.suite.faults.clear(unit)
    bench.run(74.0)
    assert health.position_horizontal_absolute and position_m(bench) < 1.5 and tilt_deg(bench) < 1.0


def test_imu_silent(flight: Array) -> None:
    bench = Bench(flight).run(30.0)
    bench.suite.faults.inject(SensorUnit.GYRO, FaultType.OFF)
    bench.suite.faults.inject(SensorUnit.ACCEL, FaultType.OFF)
    bench.run(30.5)
    health = bench.filter.health
    assert not health.attitude and health.accel_error and not health.position_horizontal_absolute
    bench.suite.faults.clear()
    bench.run(30.7)
    assert np.isfinite(bench.filter.state[:28]).all() and health.attitude


# rangefinder


def test_height_above_ground(flight: Array) -> None:
    bench = Bench(flight).run(10.5)  # 5 m up, in range
    health, nav = bench.filter.health, bench.filter
    assert health.rangefinder_in_use and health.position_vertical_agl
    assert nav.state[layout.HEIGHT_ABOVE_GROUND_M] == pytest.approx(
        bench.truth[t.HEIGHT_ABOVE_GROUND_M], abs=0.15
    )
    bench.run(17.0)  # above 12 m it sees nothing
    bench.run(24.0)
    assert bench.truth[t.HEIGHT_ABOVE_GROUND_M] > 12.0 and not health.rangefinder_in_use
