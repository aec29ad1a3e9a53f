"""Numerics, nonsense inputs, determinism, construction."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from autopilot_bridge.navigation import NavigationFilter, NavigationParameters
from autopilot_bridge.navigation.gps_aiding import GpsQuality
from autopilot_bridge.navigation.terrain import TerrainEstimator
from flightsim.foundation.random_streams import RandomStreams
from flightsim.interface import SensorReadings
from tests.navigation.bench import PARAMETERS, Bench
from tests.navigation.kinematic_flight import fly

GPS_SAMPLE = np.array([47.4, 8.5, 488.0, 1.0, 2.0, -0.5, 0.25, 0.6, 0.1, 3.0, 10.0, 0.7, 1.1])


def hovering(readings: SensorReadings, rng: np.random.Generator, step: int, rate_hz: int) -> None:
    """Readings of a hover with slow yaw-free sway, for filters at any rate."""
    time_us = (step + 1) * (1_000_000 // rate_hz)
    imu = readings.imu
    imu.values[:6] = rng.normal(0.0, [0.002] * 3 + [0.02] * 3)
    imu.values[5] -= 9.8076
    imu.time_us, imu.fresh = time_us, True
    for reading, interval in ((readings.barometer, rate_hz // 50), (readings.magnetometer, rate_hz // 50)):
        reading.fresh = step % interval == 0
        reading.time_us = time_us
    readings.barometer.values[:] = 95600.0 + rng.normal(0.0, 1.2), 20.0
    readings.magnetometer.values[:] = np.array([0.21556, 0.012, 0.43052]) + rng.normal(0.0, 0.003, 3)
    readings.gps.fresh = step % (rate_hz // 5) == 3
    if readings.gps.fresh:
        noise = rng.normal(0.0, 1.0, 6)
        readings.gps.values[:] = GPS_SAMPLE
        readings.gps.values[:6] = (
            47.4 + 2e-6 * noise[0],
            8.5 + 3e-6 * noise[1],
            488.0 + 0.5 * noise[2],
            *(0.1 * noise[3:]),
        )
        readings.gps.time_us = time_us - 120_000


@pytest.mark.slow
def test_covariance_stays_positive_definite_for_an_hour() -> None:
    """At 50 Hz physics, so that the hour has all its 180,000 updates in little time."""
    rate_hz = 50
    readings = SensorReadings()
    nav = NavigationFilter(PARAMETERS, readings=readings, physics_rate_hz=rate_hz)
    rng = RandomStreams(5).generator("hour")
    for step in range(3600 * rate_hz):
        hovering(readings, rng, step, rate_hz)
        nav.step((step + 1) * 20_000)
        if step % 15_000 == 14_999:
            p = nav.covariance
            np.testing.assert_array_equal(p, p.T)
            scale = 1.0 / np.sqrt(np.diag(p))
            assert np.linalg.eigvalsh(p * np.outer(scale, scale)).min() > 1e-9
            assert np.isfinite(nav.state[:28]).all()
    assert nav.health.filter_resets == 0 and nav.health.position_resets == 1
    sigma = np.sqrt(np.diag(nav.covariance))
    assert sigma[6:9].max() < 0.5 and sigma[0:2].max() < math.radians(0.3)


def test_same_inputs_same_bytes() -> None:
    truth = fly(20.0)
    a, b = Bench(truth, seed=3).run(20.0), Bench(truth, seed=3).run(20.0)
    assert a.filter.state.tobytes() == b.filter.state.tobytes()
    assert a.filter.covariance.tobytes() == b.filter.covariance.tobytes()
    assert a.filter.state.tobytes() != Bench(truth, seed=4).run(20.0).filter.state.tobytes()


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300, -1e300])
@pytest.mark.parametrize("sensor", ["imu", "barometer", "magnetometer", "gps", "rangefinder"])
@pytest.mark.sampled(12)
def test_nonsense_never_poisons_the_state(sensor: str, bad: float) -> None:
    rate_hz = 50
    readings = SensorReadings()
    nav = NavigationFilter(PARAMETERS, readings=readings, physics_rate_hz=rate_hz)
    rng = RandomStreams(5).generator("nonsense")
    for step in range(30 * rate_hz):
        hovering(readings, rng, step, rate_hz)
        if 10 * rate_hz <= step < 12 * rate_hz:
            reading = getattr(readings, sensor)
            reading.values[:] = bad
            reading.fresh = True
            reading.time_us = (step + 1) * 20_000
        nav.step((step + 1) * 20_000)
        assert np.isfinite(nav.state[:28]).all()
        assert np.isfinite(nav.covariance).all()
    health = nav.health
    assert health.attitude and health.position_horizontal_absolute and health.position_vertical_absolute
    assert health.filter_resets == 0


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.floats(width=64, allow_nan=True, allow_infinity=True), min_size=13, max_size=13),
    st.integers(min_value=-(2**40), max_value=2**40),
)
def test_any_gps_sample(values: list[float], measured_us: int) -> None:
    readings = SensorReadings()
    nav = NavigationFilter(PARAMETERS, readings=readings, physics_rate_hz=50)
    rng = RandomStreams(5).generator("any")
    for step in range(200):
        hovering(readings, rng, step, 50)
        if step % 10 == 5:
            readings.gps.values[:] = values
            readings.gps.time_us = measured_us
            readings.gps.fresh = True
        nav.step((step + 1) * 20_000)
    assert np.isfinite(nav.state[:28]).all()


def test_an_unusable_estimate_starts_anew() -> None:
    truth = fly(25.0)
    bench = Bench(truth).run(6.0)
    origin = bench.filter.origin
    bench.filter._solution.p[3, 3] = math.nan
    bench.run(6.1)
    assert bench.filter.health.filter_resets == 1 and bench.filter.health.uninitialised
    bench.run(24.0)
    assert bench.filter.health.position_horizontal_absolute
    assert bench.filter.origin == origin
    assert np.linalg.norm(bench.error()[6:9]) < 1.5


def test_reset() -> None:
    bench = Bench(fly(12.0)).run(5.0)
    bench.filter.reset()
    assert bench.filter.health.uninitialised
    assert bench.filter.state[0] == 1.0 and not bench.filter.state[1:28].any()
    bench.run(8.0)
    assert bench.filter.health.position_horizontal_absolute


def test_covariance_is_read_only() -> None:
    nav = NavigationFilter(PARAMETERS, readings=SensorReadings(), physics_rate_hz=250)
    with pytest.raises(ValueError, match="read-only"):
        nav.covariance[0, 0] = 1.0


def test_rates_must_fit() -> None:
    with pytest.raises(ValueError, match="covariance_rate_hz 25 is not accepted"):
        NavigationFilter(NavigationParameters(), readings=SensorReadings(), physics_rate_hz=240)
    with pytest.raises(ValueError, match="whole microseconds"):
        NavigationFilter(
            replace(PARAMETERS, covariance_rate_hz=60), readings=SensorReadings(), physics_rate_hz=240
        )


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("gyro_noise_rad_s_sqrt_hz", 0.0),
        ("gps_gate", -1.0),
        ("gps_position_noise_m", (0.2, math.nan)),
        ("history_s", 60.0),
        ("magnetic_year", 2019.0),
        ("mag_ned_gauss", (0.0, 0.0, 0.0)),
        ("no_aid_timeout_s", math.inf),
    ],
)
def test_parameters_are_checked(name: str, value: object) -> None:
    with pytest.raises(ValueError, match=name):
        NavigationParameters(**{name: value})  # type: ignore[arg-type]


@pytest.mark.parametrize("rate_hz", [100, 250, 500, 1000])
def test_other_physics_rates(rate_hz: int) -> None:
    truth = fly(15.0, rate_hz=rate_hz)
    from flightsim.sensors.imu import ImuParameters
    from flightsim.sensors.suite import SensorSuiteParameters

    sensors = SensorSuiteParameters(imu=ImuParameters(rate_hz=rate_hz), rangefinder=None)
    bench = Bench(truth, sensors=sensors, rate_hz=rate_hz).run(15.0)
    assert np.linalg.norm(bench.error()[6:9]) < 1.5
    assert math.degrees(np.linalg.norm(bench.error()[0:2])) < 0.8


# parts


def test_gps_quality_wants_a_series() -> None:
    quality = GpsQuality(replace(PARAMETERS, gps_check_time_s=1.0))
    sample = GPS_SAMPLE.copy()
    sample[3:6] = 0.0
    results = []
    for k in range(8):
        sample[3] = 0.001 * k  # a receiver never says twice the same
        results.append(quality.judge(sample, k * 200_000, k * 200_000 + 110_000))
    assert results == [False] * 5 + [True] * 3
    poor = sample.copy()
    poor[9] = 2.0
    assert not quality.judge(poor, 1_600_000, 1_710_000) and not quality.good
    assert not quality.judge(sample, 1_800_000, 1_910_000) and quality.good


def test_gps_quality_sees_a_position_that_contradicts_its_velocity() -> None:
    quality = GpsQuality(PARAMETERS)
    sample = GPS_SAMPLE.copy()
    sample[3:6] = 10.0, 0.0, 0.0  # says it moves, but stays
    for k in range(100):
        usable = quality.judge(sample, k * 200_000, k * 200_000)
    assert not usable
    quality.restart()
    for k in range(100):
        sample[0] = 47.4 + k * 2.0 / 111_200.0  # moves as it says
        usable = quality.judge(sample, k * 200_000, k * 200_000)
        assert quality.good
    assert usable


def test_terrain_follows_a_step() -> None:
    terrain = TerrainEstimator(PARAMETERS)
    assert not terrain.valid(0) and math.isnan(terrain.down_m)
    rng = RandomStreams(1).generator("terrain")
    for k in range(50):
        terrain.predict(k * 40_000, 0.0)
        terrain.fuse(k * 40_000, 10.0 + rng.normal(0.0, 0.02), 1.0, -10.0)
    assert terrain.valid(2_000_000) and terrain.down_m == pytest.approx(0.0, abs=0.03)
    for k in range(50, 100):  # a roof of 4 m: refused at first, then accepted
        terrain.predict(k * 40_000, 0.0)
        terrain.fuse(k * 40_000, 6.0, 1.0, -10.0)
        if k == 55:
            assert terrain.test_ratio > 1.0 and terrain.down_m == pytest.approx(0.0, abs=0.05)
    assert terrain.down_m == pytest.approx(-4.0, abs=0.05)
    terrain.fuse(4_000_000, math.nan, 1.0, -10.0)
    assert not terrain.in_use
    terrain.predict(10_000_000, 0.0)
    assert not terrain.valid(10_000_000) and math.isnan(terrain.down_m)


def test_a_receiver_that_repeats_itself_is_not_accepted() -> None:
    """Frozen position and velocity would have the vehicle run away from its own estimate."""
    quality = GpsQuality(PARAMETERS)
    sample = np.array([47.0, 8.0, 500.0, 0.03, -0.02, 0.01, 0.3, 0.6, 0.1, 3.0, 10.0, 0.7, 1.1])
    generator = np.random.default_rng(1)

    def judge(k: int, values: NDArray[np.float64]) -> bool:
        return quality.judge(values, 200_000 * k, 200_000 * k + 100_000)

    for k in range(1, 20):
        sample[3] = 0.05 * generator.standard_normal()
        judge(k, sample.copy())
    assert quality.good
    assert [judge(k, sample.copy()) for k in range(20, 30)] == [True] * 4 + [False] * 6
    sample[3] += 0.001
    judge(30, sample.copy())
    assert quality.good
