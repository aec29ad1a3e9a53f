"""Each sensor model against its parameters: closed forms, statistics with fixed seeds, authorities."""

import math

import numpy as np
import pymap3d
import pytest
from numpy.typing import NDArray

from flightsim import interface as i
from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.sensors import (
    RTK_FIX_AFTER_10_S,
    BarometerParameters,
    BatteryMonitorParameters,
    GpsFixStage,
    GpsParameters,
    ImuParameters,
    MagnetometerParameters,
    RangefinderParameters,
    SensorModel,
    SensorParameters,
)
from flightsim.sensors.gps import NO_FIX_ACCURACY_M

Array = NDArray[np.float64]

LAT_DEG, LON_DEG, ALT_M = 47.4, 8.5, 488.0


def still_truth() -> Array:
    truth = np.zeros(t.TRUTH_SIZE)
    truth[t.LAT_RAD], truth[t.LON_RAD], truth[t.ALT_M] = math.radians(LAT_DEG), math.radians(LON_DEG), ALT_M
    truth[t.Q_NED_FROM_FRD] = (1.0, 0.0, 0.0, 0.0)
    truth[t.SPECIFIC_FORCE_FRD_M_S2] = (0.0, 0.0, -9.81)
    truth[t.PRESSURE_PA], truth[t.TEMPERATURE_K] = 95461.0, 288.15
    truth[t.MAG_NED_GAUSS] = (0.21, 0.01, 0.43)
    truth[t.HEIGHT_ABOVE_GROUND_M] = 5.0
    truth[t.BATTERY_VOLTAGE_V], truth[t.BATTERY_CURRENT_A] = 15.1, 14.0
    truth[t.BATTERY_USED_AH], truth[t.BATTERY_CAPACITY_AH] = 0.5, 5.0
    return truth


def specimen(parameters: SensorParameters, seed: int = 1) -> tuple[SensorModel, np.random.Generator]:
    rng = RandomStreams(seed).generator("specimen")
    return parameters.build(1.0 / parameters.rate_hz, rng), rng


def record(parameters: SensorParameters, truth: Array, samples: int, seed: int = 1) -> Array:
    """Consecutive samples of one specimen; NaN rows where the device is silent."""
    model, rng = specimen(parameters, seed)
    normals = rng.standard_normal((samples, model.normals_per_sample))
    out = np.full((samples, model.size), np.nan)
    for row in range(samples):
        model.kernel(truth, model.constants, model.state, normals, row, out[row])
    return out


def assert_sigma(values: Array, sigma: float) -> None:
    """Standard deviation of independent samples: five sigma of its own spread (chi-square, large n)."""
    n = values.size
    assert np.var(values) == pytest.approx(sigma**2, rel=5.0 * math.sqrt(2.0 / n))


def allan_variance(values: Array, averaging: int) -> float:
    """Non-overlapping Allan variance of a rate signal (IEEE Std 952, annex C)."""
    groups = values[: values.size // averaging * averaging].reshape(-1, averaging).mean(axis=1)
    return float(0.5 * np.mean(np.diff(groups) ** 2))


QUIET_IMU = {
    f"{triad}_{error}": 0.0
    for triad, units in (("gyro", "rad_s"), ("accel", "m_s2"))
    for error in (
        f"noise_density_{units}_sqrt_hz",
        f"bias_instability_{units}",
        f"turn_on_bias_{units}",
        "scale_error",
        "cross_axis_error",
        f"quantum_{units}",
    )
}


# --- IMU ---


def test_imu_without_errors_reads_truth() -> None:
    truth = still_truth()
    truth[t.RATES_FRD_RAD_S] = (0.1, -0.2, 0.3)
    truth[t.SPECIFIC_FORCE_FRD_M_S2] = (1.0, -2.0, -9.0)
    sample = record(ImuParameters(**QUIET_IMU), truth, 3)[-1]
    np.testing.assert_allclose(sample[i.IMU_GYRO_FRD_RAD_S], (0.1, -0.2, 0.3), rtol=1e-14)
    np.testing.assert_allclose(sample[i.IMU_ACCEL_FRD_M_S2], (1.0, -2.0, -9.0), rtol=1e-14)


@pytest.mark.parametrize(
    ("channels", "name"),
    [
        (i.IMU_GYRO_FRD_RAD_S, "gyro_noise_density_rad_s_sqrt_hz"),
        (i.IMU_ACCEL_FRD_M_S2, "accel_noise_density_m_s2_sqrt_hz"),
    ],
)
@pytest.mark.parametrize("rate_hz", [50, 250])
def test_imu_white_noise_is_its_density(channels: slice, name: str, rate_hz: int) -> None:
    density = getattr(ImuParameters(), name)
    parameters = ImuParameters(**(QUIET_IMU | {name: density, "rate_hz": rate_hz}))
    samples = record(parameters, still_truth(), 40_000)
    noise = samples[:, channels] - samples[:, channels].mean(axis=0)
    for axis in noise.T:
        assert_sigma(axis, density * math.sqrt(rate_hz))
        # Angle random walk: Allan deviation is density / sqrt(tau), whatever the rate.
        for tau_s in (0.1, 1.0):
            averaging = round(tau_s * rate_hz)
            bound = 5.0 * math.sqrt(3.0 / (axis.size / averaging))
            assert allan_variance(axis, averaging) == pytest.approx(density**2 / tau_s, rel=bound)
    correlation = np.corrcoef(noise.T)
    assert np.all(np.abs(correlation[np.triu_indices(3, 1)]) < 5.0 / math.sqrt(len(noise)))


@pytest.mark.parametrize(
    ("channels", "prefix", "units"),
    [(i.IMU_GYRO_FRD_RAD_S, "gyro", "rad_s"), (i.IMU_ACCEL_FRD_M_S2, "accel", "m_s2")],
)
def test_imu_bias_wanders_as_gauss_markov(channels: slice, prefix: str, units: str) -> None:
    """Allan variance of a first-order Gauss-Markov process, IEEE Std 952 annex C (correlated noise)."""
    sigma, time_constant_s, rate_hz = 2e-3, 2.0, 50
    wander = {f"{prefix}_bias_instability_{units}": sigma, f"{prefix}_bias_time_constant_s": time_constant_s}
    parameters = ImuParameters(**(QUIET_IMU | wander | {"rate_hz": rate_hz}))
    bias = record(parameters, still_truth(), 200_000)[:, channels]
    bias = bias - (0.0 if prefix == "gyro" else np.array([0.0, 0.0, -9.81]))
    duration_s = len(bias) / rate_hz
    independent = 3.0 * duration_s / (2.0 * time_constant_s)  # three axes
    assert np.mean(bias**2) == pytest.approx(sigma**2, rel=5.0 * math.sqrt(2.0 / independent))
    for tau_s in (0.2, 2.0, 4.0, 20.0):
        x = tau_s / time_constant_s
        expected = 2.0 * sigma**2 / x * (1.0 - (3.0 - 4.0 * math.exp(-x) + math.exp(-2.0 * x)) / (2.0 * x))
        measured = np.mean([allan_variance(axis, round(tau_s * rate_hz)) for axis in bias.T])
        assert measured == pytest.approx(expected, rel=5.0 * math.sqrt(3.0 / (3.0 * duration_s / tau_s)))


@pytest.mark.parametrize("channel", range(6))
def test_imu_white_and_wandering_parts_are_independent(channel: int) -> None:
    """First differences of white w and Gauss-Markov d add up only when the two share no random numbers."""
    sigma, time_constant_s = 1e-2, 0.02
    parameters = ImuParameters(
        **(
            QUIET_IMU
            | {
                "rate_hz": 50,
                "gyro_noise_density_rad_s_sqrt_hz": sigma / math.sqrt(50),
                "gyro_bias_instability_rad_s": sigma,
                "gyro_bias_time_constant_s": time_constant_s,
                "accel_noise_density_m_s2_sqrt_hz": sigma / math.sqrt(50),
                "accel_bias_instability_m_s2": sigma,
                "accel_bias_time_constant_s": time_constant_s,
            }
        )
    )
    steps = np.diff(record(parameters, still_truth(), 40_000)[:, channel])
    expected = 2.0 * sigma**2 + 2.0 * sigma**2 * (1.0 - math.exp(-1.0))
    assert np.var(steps) == pytest.approx(expected, rel=0.05)


def test_imu_specimens_spread_as_specified() -> None:
    """Turn-on bias, scale and cross-axis errors over many specimens."""
    truth = still_truth()
    parameters = ImuParameters(
        **(
            QUIET_IMU
            | {"gyro_turn_on_bias_rad_s": 1e-3, "accel_scale_error": 2e-3, "accel_cross_axis_error": 5e-4}
        )
    )
    samples = np.array([record(parameters, truth, 1, seed)[0] for seed in range(600)])
    assert_sigma(samples[:, i.IMU_GYRO_FRD_RAD_S].ravel(), 1e-3)
    forward, right, down = samples[:, i.IMU_ACCEL_FRD_M_S2].T
    assert_sigma(down / -9.81, 2e-3)
    assert_sigma(np.concatenate([forward, right]) / 9.81, 5e-4)


def test_imu_quantum_and_saturation() -> None:
    truth = still_truth()
    parameters = ImuParameters()
    samples = record(parameters, truth, 200)
    for channels, quantum in (
        (i.IMU_GYRO_FRD_RAD_S, parameters.gyro_quantum_rad_s),
        (i.IMU_ACCEL_FRD_M_S2, parameters.accel_quantum_m_s2),
    ):
        counts = samples[:, channels] / quantum
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    truth[t.RATES_FRD_RAD_S] = (1e3, -1e3, 0.0)
    truth[t.SPECIFIC_FORCE_FRD_M_S2] = (1e4, -1e4, 0.0)
    sample = record(parameters, truth, 1)[0]
    limit, range_m_s2 = parameters.gyro_range_rad_s, parameters.accel_range_m_s2
    np.testing.assert_allclose(sample[0:2], (limit, -limit), rtol=1e-12)
    np.testing.assert_allclose(sample[3:5], (range_m_s2, -range_m_s2), rtol=1e-12)


def test_imu_warms_up() -> None:
    parameters = ImuParameters(rate_hz=1, self_heating_k=20.0, warm_up_s=100.0, temperature_quantum_k=0.0)
    temperature_c = record(parameters, still_truth(), 301)[:, i.IMU_TEMPERATURE_C]
    expected = 15.0 + 20.0 * (1.0 - np.exp(-np.arange(301) / 100.0))
    np.testing.assert_allclose(temperature_c, expected, rtol=1e-10)


# --- barometer ---


def test_barometer_noise_with_quantum() -> None:
    parameters = BarometerParameters(drift_pa=0.0, turn_on_bias_pa=0.0)
    pressure_pa = record(parameters, still_truth(), 40_000)[:, i.BARO_PRESSURE_PA]
    assert np.array_equal(pressure_pa, np.round(pressure_pa))
    # Sheppard's correction: quantising adds a twelfth of the quantum squared.
    assert_sigma(pressure_pa, math.sqrt(parameters.noise_pa**2 + parameters.quantum_pa**2 / 12.0))
    assert pressure_pa.mean() == pytest.approx(95461.0, abs=0.05)


def test_barometer_lags_first_order() -> None:
    parameters = BarometerParameters(
        noise_pa=0.0, turn_on_bias_pa=0.0, drift_pa=0.0, quantum_pa=0.0, lag_s=0.2
    )
    model, _ = specimen(parameters)
    truth, normals, out = still_truth(), np.zeros((1, model.normals_per_sample)), np.empty(model.size)
    model.kernel(truth, model.constants, model.state, normals, 0, out)
    assert out[i.BARO_PRESSURE_PA] == 95461.0
    truth[t.PRESSURE_PA] += 100.0
    for sample in range(1, 60):
        model.kernel(truth, model.constants, model.state, normals, 0, out)
        expected = 95461.0 + 100.0 * (1.0 - math.exp(-sample / parameters.rate_hz / 0.2))
        assert out[i.BARO_PRESSURE_PA] == pytest.approx(expected, abs=1e-6)


def test_barometer_drifts_slowly() -> None:
    parameters = BarometerParameters(
        rate_hz=1, noise_pa=0.0, quantum_pa=0.0, turn_on_bias_pa=0.0, drift_time_constant_s=20.0
    )
    drift_pa = record(parameters, still_truth(), 100_000)[:, i.BARO_PRESSURE_PA] - 95461.0
    assert np.mean(drift_pa**2) == pytest.approx(parameters.drift_pa**2, rel=5.0 * math.sqrt(2.0 / 2_500))
    correlation = np.mean(drift_pa[20:] * drift_pa[:-20]) / np.mean(drift_pa**2)
    assert correlation == pytest.approx(math.exp(-1.0), abs=0.05)


def test_barometer_noise_and_drift_are_independent() -> None:
    parameters = BarometerParameters(
        rate_hz=50,
        noise_pa=3.0,
        quantum_pa=0.0,
        turn_on_bias_pa=0.0,
        drift_pa=3.0,
        drift_time_constant_s=0.02,
    )
    steps_pa = np.diff(record(parameters, still_truth(), 40_000)[:, i.BARO_PRESSURE_PA])
    assert np.var(steps_pa) == pytest.approx(18.0 + 18.0 * (1.0 - math.exp(-1.0)), rel=0.05)


def test_barometer_specimens_differ_by_turn_on_bias() -> None:
    parameters = BarometerParameters(noise_pa=0.0, drift_pa=0.0, quantum_pa=0.0)
    offsets = [record(parameters, still_truth(), 1, seed)[0, i.BARO_PRESSURE_PA] for seed in range(600)]
    assert_sigma(np.array(offsets), parameters.turn_on_bias_pa)


# --- magnetometer ---


def test_magnetometer_reads_the_field_in_the_body_frame() -> None:
    truth = still_truth()
    truth[t.Q_NED_FROM_FRD] = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))  # heading east
    parameters = MagnetometerParameters(
        noise_gauss=0.0, hard_iron_gauss=0.0, scale_error=0.0, quantum_gauss=0.0
    )
    np.testing.assert_allclose(record(parameters, truth, 1)[0], (0.01, -0.21, 0.43), atol=1e-15)


def test_magnetometer_noise_quantum_and_hard_iron() -> None:
    parameters = MagnetometerParameters(scale_error=0.0)
    samples = record(parameters, still_truth(), 40_000)
    np.testing.assert_allclose(samples / 0.003, np.round(samples / 0.003), atol=1e-9)
    for axis in samples.T:
        assert_sigma(axis, math.hypot(parameters.noise_gauss, parameters.quantum_gauss / math.sqrt(12.0)))
    quiet = MagnetometerParameters(scale_error=0.0, noise_gauss=0.0, quantum_gauss=0.0)
    offsets = np.array([record(quiet, still_truth(), 1, seed)[0] for seed in range(400)]) - (0.21, 0.01, 0.43)
    assert_sigma(offsets.ravel(), quiet.hard_iron_gauss)


# --- GPS ---


def gps_errors_m(samples: Array) -> Array:
    """North, east, up errors through pymap3d."""
    east, north, up = pymap3d.geodetic2enu(
        samples[:, i.GPS_LAT_DEG], samples[:, i.GPS_LON_DEG], samples[:, i.GPS_ALT_M], LAT_DEG, LON_DEG, ALT_M
    )
    return np.stack([north, east, up], axis=1)


@pytest.mark.parametrize(
    "parameters", [GpsParameters(), GpsParameters.standalone()], ids=["differential", "standalone"]
)
def test_gps_reports_its_accuracy_honestly(parameters: GpsParameters) -> None:
    """Position errors of many specimens against eph and epv; velocity errors against the parameters."""
    first = np.array([record(parameters, still_truth(), 1, seed)[0] for seed in range(1500)])
    errors_m = gps_errors_m(first)
    assert_sigma(errors_m[:, :2].ravel(), first[0, i.GPS_EPH_M])
    assert_sigma(errors_m[:, 2], first[0, i.GPS_EPV_M])
    velocity = first[:, i.GPS_VEL_NED_M_S]
    for axis, name in enumerate(("north", "east", "down")):
        assert_sigma(velocity[:, axis], getattr(parameters, f"velocity_noise_{name}_m_s"))
    assert np.mean(velocity**2) == pytest.approx(first[0, i.GPS_SPEED_ACCURACY_M_S] ** 2, rel=0.15)


def test_gps_error_is_white_plus_correlated() -> None:
    """Autocovariance: white variance at lag zero only, the rest decays with the time constant."""
    parameters = GpsParameters(wander_time_constant_s=10.0)
    errors_m = gps_errors_m(record(parameters, still_truth(), 100_000))
    for axis, wander_m, noise_m in ((0, 0.06, 0.2), (1, 0.06, 0.2), (2, 0.12, 0.5)):
        error = errors_m[:, axis]
        assert np.mean(error**2) == pytest.approx(wander_m**2 + noise_m**2, rel=0.05)
        for lag_s in (1.0, 5.0, 10.0):
            lag = round(lag_s * parameters.rate_hz)
            expected = wander_m**2 * math.exp(-lag_s / 10.0)
            assert np.mean(error[lag:] * error[:-lag]) == pytest.approx(expected, abs=0.15 * wander_m**2)


@pytest.mark.parametrize("lon_deg", [179.9999999, -180.0])
def test_gps_longitude_stays_in_range(lon_deg: float) -> None:
    truth = still_truth()
    truth[t.LON_RAD] = math.radians(lon_deg)
    longitudes = record(GpsParameters(), truth, 300)[:, i.GPS_LON_DEG]
    assert np.all((longitudes >= -180.0) & (longitudes <= 180.0))
    assert np.any(longitudes < 0.0) and np.any(longitudes > 0.0)


def test_gps_fix_timeline_of_ardupilot() -> None:
    parameters = GpsParameters(fix_timeline=RTK_FIX_AFTER_10_S)
    samples = record(parameters, still_truth(), 60)
    time_s = np.arange(60) / parameters.rate_hz
    silent, searching, fixed = time_s < 9.7, (time_s >= 9.7) & (time_s < 10.1), time_s >= 10.1
    assert np.all(np.isnan(samples[silent]))
    assert np.all(samples[searching, i.GPS_FIX_TYPE] == 1)
    assert np.all(samples[searching, i.GPS_SATELLITES] == 3)
    assert np.all(samples[searching, i.GPS_EPH_M] == NO_FIX_ACCURACY_M)
    assert np.all(samples[fixed, i.GPS_FIX_TYPE] == 6)
    assert np.all(samples[fixed, i.GPS_SATELLITES] == 10)
    assert np.all(samples[fixed, i.GPS_HDOP] == 1.21)
    assert searching.sum() == 2 and fixed.sum() == 9


def test_gps_stage_scales_errors_and_accuracy() -> None:
    stage = {"start_s": 0.0, "fix_type": 3, "satellites": 6, "hdop": 2.0, "vdop": 3.0}
    plain = GpsParameters(fix_timeline=(GpsFixStage(**stage),))
    poor = GpsParameters(fix_timeline=(GpsFixStage(**stage, error_scale=3.0),))
    good_m, bad_m = (gps_errors_m(record(p, still_truth(), 20)) for p in (plain, poor))
    np.testing.assert_allclose(bad_m, 3.0 * good_m, atol=0.05)
    assert record(poor, still_truth(), 1)[0, i.GPS_EPH_M] == pytest.approx(3.0 * math.hypot(0.2, 0.06))


# --- battery ---


def test_battery_counts_charge_from_where_it_starts() -> None:
    parameters = BatteryMonitorParameters(
        current_noise_a=0.0, current_scale_error=0.0, current_quantum_a=0.0, voltage_noise_v=0.0
    )
    samples = record(parameters, still_truth(), 3601)
    assert samples[0, i.BATTERY_USED_AH] == 0.5
    assert samples[0, i.BATTERY_REMAINING] == pytest.approx(0.9)
    used_ah = 0.5 + 14.0 * 3600 / parameters.rate_hz / 3600.0
    assert samples[-1, i.BATTERY_USED_AH] == pytest.approx(used_ah)
    assert samples[-1, i.BATTERY_REMAINING] == pytest.approx(1.0 - used_ah / 5.0)


def test_battery_noise_quantum_and_limits() -> None:
    parameters = BatteryMonitorParameters(voltage_scale_error=0.0, current_scale_error=0.0)
    samples = record(parameters, still_truth(), 20_000)
    voltage_v, current_a = samples[:, i.BATTERY_VOLTAGE_V], samples[:, i.BATTERY_CURRENT_A]
    assert_sigma(voltage_v, math.hypot(0.01, parameters.voltage_quantum_v / math.sqrt(12.0)))
    assert_sigma(current_a, math.hypot(0.1, parameters.current_quantum_a / math.sqrt(12.0)))
    counts = voltage_v / parameters.voltage_quantum_v
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    truth = still_truth()
    truth[t.BATTERY_CURRENT_A], truth[t.BATTERY_USED_AH] = 0.0, 6.0
    empty = record(parameters, truth, 100)
    assert np.all(empty[:, i.BATTERY_CURRENT_A] >= 0.0)
    assert np.all(empty[:, i.BATTERY_REMAINING] == 0.0)
    truth[t.BATTERY_CAPACITY_AH] = 0.0
    assert np.all(np.isnan(record(parameters, truth, 1)[:, i.BATTERY_REMAINING]))


# --- rangefinder ---


@pytest.mark.parametrize("tilt_deg", [0.0, 20.0, 45.0])
def test_rangefinder_measures_along_the_body_axis(tilt_deg: float) -> None:
    truth = still_truth()
    half = math.radians(tilt_deg) / 2.0
    truth[t.Q_NED_FROM_FRD] = (math.cos(half), math.sin(half) * 0.6, math.sin(half) * 0.8, 0.0)
    samples = record(RangefinderParameters(quantum_m=0.0), truth, 20_000)
    distance_m = 5.0 / math.cos(math.radians(tilt_deg))
    sigma_m = math.hypot(0.02, 0.003 * distance_m)
    assert samples[:, i.RANGE_DISTANCE_M].mean() == pytest.approx(
        distance_m, abs=5.0 * sigma_m / math.sqrt(20_000)
    )
    assert_sigma(samples[:, i.RANGE_DISTANCE_M], sigma_m)


@pytest.mark.parametrize(("height_m", "tilt_deg"), [(0.02, 0.0), (13.0, 0.0), (5.0, 61.0), (5.0, 180.0)])
def test_rangefinder_out_of_range_is_nan(height_m: float, tilt_deg: float) -> None:
    truth = still_truth()
    truth[t.HEIGHT_ABOVE_GROUND_M] = height_m
    half = math.radians(tilt_deg) / 2.0
    truth[t.Q_NED_FROM_FRD] = (math.cos(half), math.sin(half), 0.0, 0.0)
    samples = record(RangefinderParameters(), truth, 50)
    assert np.all(np.isnan(samples[:, i.RANGE_DISTANCE_M]))
    assert np.all(samples[:, i.RANGE_MAX_M] == 12.0)


# --- parameters ---


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: ImuParameters(gyro_quantum_rad_s=-1.0), "gyro_quantum_rad_s -1"),
        (lambda: ImuParameters(warm_up_s=0.0), "warm_up_s 0"),
        (lambda: BarometerParameters(noise_pa=math.nan), "noise_pa nan"),
        (lambda: MagnetometerParameters(range_gauss=0.0), "range_gauss 0"),
        (lambda: GpsParameters(latency_s=-0.1), "latency_s -0.1"),
        (lambda: GpsParameters(rate_hz=0), "rate_hz 0"),
        (lambda: GpsParameters(fix_timeline=RTK_FIX_AFTER_10_S[::-1]), r"\[10.1, 9.7\]"),
        (lambda: GpsFixStage(start_s=0.0, fix_type=9, satellites=3, hdop=1.0, vdop=1.0), "fix_type = 9"),
        (lambda: BatteryMonitorParameters(current_noise_a=math.inf), "current_noise_a inf"),
        (lambda: RangefinderParameters(min_range_m=20.0), "max_range_m = 12.0"),
        (lambda: RangefinderParameters(max_tilt_rad=2.0), "max_tilt_rad = 2.0"),
    ],
)
def test_bad_parameters_are_named(make: object, named: str) -> None:
    assert callable(make)
    with pytest.raises(ValueError, match=named):
        make()
