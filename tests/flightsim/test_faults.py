"""Every failure on every sensor: what arrives, what doesn't, and that clearing leaves no trace."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from pymavlink.dialects.v20 import all as mavlink

from flightsim import interface as i
from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.interface import Reading
from flightsim.payload.home_frame import HomeFrame
from flightsim.sensors import (
    AirspeedParameters,
    BarometerParameters,
    FaultType,
    SensorSuite,
    SensorSuiteParameters,
    SensorUnit,
    UnsupportedFaultError,
)
from flightsim.sensors.gps import add_local_bias

Array = NDArray[np.float64]

RATE_HZ = 250
STEP_US = 1_000_000 // RATE_HZ
BEGIN_STEP = 300
END_STEP = 1300
STEPS = 2000

UNITS = {
    SensorUnit.GYRO: ("imu", i.IMU_GYRO_FRD_RAD_S),
    SensorUnit.ACCEL: ("imu", i.IMU_ACCEL_FRD_M_S2),
    SensorUnit.MAG: ("magnetometer", slice(0, i.MAG_SIZE)),
    SensorUnit.BARO: ("barometer", slice(0, i.BARO_SIZE)),
    SensorUnit.GPS: ("gps", slice(0, i.GPS_SIZE)),
    SensorUnit.DISTANCE_SENSOR: ("rangefinder", slice(0, i.RANGE_SIZE)),
    SensorUnit.BATTERY: ("battery", slice(0, i.BATTERY_SIZE)),
    SensorUnit.AIRSPEED: ("airspeed", slice(0, i.AIRSPEED_SIZE)),
}
EVERYTHING = SensorSuiteParameters(airspeed=AirspeedParameters())
every_unit = pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.name)
silencing_alone = pytest.mark.parametrize(
    "unit", [unit for unit, (name, _) in UNITS.items() if name != "imu"], ids=lambda unit: unit.name
)
imu_half = pytest.mark.parametrize("unit", [SensorUnit.GYRO, SensorUnit.ACCEL], ids=lambda unit: unit.name)


@dataclass
class Trace:
    """What one reading showed after each step: values, measurement time, freshness."""

    values: Array
    time_us: NDArray[np.int64]
    fresh: NDArray[np.bool_]

    def during(self) -> NDArray[np.bool_]:
        """Deliveries while the failure was in force."""
        steps = np.arange(STEPS)
        return self.fresh & (steps >= BEGIN_STEP) & (steps < END_STEP)


def make_suite(parameters: SensorSuiteParameters | None = None) -> tuple[SensorSuite, Array]:
    truth = np.zeros(t.TRUTH_SIZE)
    streams = RandomStreams(5)
    suite = SensorSuite(
        parameters or EVERYTHING,
        physics_rate_hz=RATE_HZ,
        truth=truth,
        seeds=lambda name: streams.child("sensor", name),
    )
    return suite, truth


def write_truth(truth: Array, step: int) -> None:
    s = 1e-3 * step
    truth[t.LAT_RAD], truth[t.LON_RAD], truth[t.ALT_M] = 0.8 + 1e-6 * s, 0.1 - 1e-6 * s, 500.0 + s
    truth[t.VEL_NED_M_S] = (s, -s, 0.1 * s)
    truth[t.Q_NED_FROM_FRD] = (np.cos(0.5 * s), 0.0, 0.0, np.sin(0.5 * s))
    truth[t.RATES_FRD_RAD_S] = (0.1 * s, 0.2 * s, -0.1 * s)
    truth[t.SPECIFIC_FORCE_FRD_M_S2] = (s, -s, -9.81 + 0.1 * s)
    truth[t.PRESSURE_PA], truth[t.TEMPERATURE_K] = 95000.0 - 10.0 * s, 288.0 + 0.1 * s
    truth[t.MAG_NED_GAUSS] = (0.21, 0.01, 0.43)
    truth[t.HEIGHT_ABOVE_GROUND_M] = 4.0 + 0.5 * s
    truth[t.BATTERY_VOLTAGE_V], truth[t.BATTERY_CURRENT_A] = 16.0 - 0.1 * s, 14.0 + s
    truth[t.BATTERY_CAPACITY_AH] = 5.0
    truth[t.DYNAMIC_PRESSURE_PA] = 300.0 + 10.0 * s


def fly(unit: SensorUnit, failure: FaultType, **options: object) -> Trace:
    """Two flights in step: the failure from BEGIN_STEP, cleared at END_STEP."""
    suite, truth = make_suite()
    reading: Reading = getattr(suite.readings, UNITS[unit][0])
    trace = Trace(
        np.empty((STEPS, reading.values.size)), np.empty(STEPS, dtype=np.int64), np.empty(STEPS, dtype=bool)
    )
    for step in range(STEPS):
        if step == BEGIN_STEP:
            suite.faults.inject(unit, failure, **options)  # type: ignore[arg-type]
        if step == END_STEP:
            suite.faults.clear(unit)
        write_truth(truth, step)
        suite.step(step * STEP_US)
        trace.values[step] = reading.values
        trace.time_us[step] = reading.time_us
        trace.fresh[step] = reading.fresh
    return trace


@pytest.fixture(scope="module")
def healthy() -> dict[str, Trace]:
    return {name: fly(unit, FaultType.OK) for unit, (name, _) in UNITS.items()}


def rate_hz(unit: SensorUnit) -> int:
    rate: int = getattr(EVERYTHING, UNITS[unit][0]).rate_hz
    return rate


@every_unit
@pytest.mark.parametrize("failure", FaultType, ids=lambda failure: failure.name)
@pytest.mark.sampled(24)
def test_before_and_after_a_failure_all_is_as_it_would_have_been(
    unit: SensorUnit, failure: FaultType, healthy: dict[str, Trace]
) -> None:
    faulty, good = fly(unit, failure), healthy[UNITS[unit][0]]
    after = END_STEP + int(np.argmax(good.fresh[END_STEP:]))
    for part in (slice(0, BEGIN_STEP), slice(after, STEPS)):
        np.testing.assert_array_equal(faulty.values[part], good.values[part])
        np.testing.assert_array_equal(faulty.time_us[part], good.time_us[part])
        np.testing.assert_array_equal(faulty.fresh[part], good.fresh[part])


@every_unit
@pytest.mark.parametrize(
    "failure", [failure for failure in FaultType if failure], ids=lambda failure: failure.name
)
@pytest.mark.sampled(24)
def test_a_failure_touches_only_its_channels(
    unit: SensorUnit, failure: FaultType, healthy: dict[str, Trace]
) -> None:
    """And does show in them."""
    name, channels = UNITS[unit]
    faulty, good = fly(unit, failure), healthy[name]
    others = np.ones(good.values.shape[1], dtype=bool)
    others[channels] = False
    np.testing.assert_array_equal(faulty.values[:, others], good.values[:, others])
    both = faulty.during() & good.during()
    changed = not np.array_equal(faulty.values[both][:, channels], good.values[both][:, channels])
    assert changed or both.sum() < good.during().sum()


@silencing_alone
def test_off_delivers_nothing(unit: SensorUnit) -> None:
    trace = fly(unit, FaultType.OFF)
    assert not trace.during().any()
    assert np.all(trace.time_us[BEGIN_STEP:END_STEP] == trace.time_us[BEGIN_STEP - 1])


@imu_half
def test_half_an_imu_off_holds_its_last_values(unit: SensorUnit, healthy: dict[str, Trace]) -> None:
    trace, channels = fly(unit, FaultType.OFF), UNITS[unit][1]
    assert trace.during().sum() == END_STEP - BEGIN_STEP
    held = trace.values[BEGIN_STEP:END_STEP, channels]
    assert np.all(held == healthy["imu"].values[BEGIN_STEP - 1, channels])


def test_a_whole_imu_off_goes_stale() -> None:
    suite, truth = make_suite()
    write_truth(truth, 0)
    suite.step(0)
    suite.faults.inject(SensorUnit.GYRO, FaultType.OFF)
    suite.faults.inject(SensorUnit.ACCEL, FaultType.OFF)
    for step in range(1, 20):
        suite.step(step * STEP_US)
        assert not suite.readings.imu.fresh
        assert suite.readings.imu.time_us == 0
    suite.faults.clear(SensorUnit.ACCEL)
    suite.step(20 * STEP_US)
    assert suite.readings.imu.fresh


@every_unit
def test_stuck_repeats_the_last_delivered_values(unit: SensorUnit, healthy: dict[str, Trace]) -> None:
    name, channels = UNITS[unit]
    trace = fly(unit, FaultType.STUCK)
    np.testing.assert_array_equal(trace.during(), healthy[name].during())
    np.testing.assert_array_equal(trace.time_us, healthy[name].time_us)
    last = trace.values[BEGIN_STEP - 1, channels]
    for values in trace.values[trace.during()][:, channels]:
        np.testing.assert_array_equal(values, last)


def test_stuck_from_the_start_holds_the_first_sample() -> None:
    suite, truth = make_suite()
    suite.faults.inject(SensorUnit.BARO, FaultType.STUCK)
    seen = set()
    for step in range(100):
        write_truth(truth, step)
        suite.step(step * STEP_US)
        seen.add(suite.readings.barometer.values[i.BARO_PRESSURE_PA])
    assert len(seen) == 1 and np.isfinite(seen.pop())


@every_unit
def test_garbage_fills_the_range(unit: SensorUnit, healthy: dict[str, Trace]) -> None:
    name, channels = UNITS[unit]
    trace = fly(unit, FaultType.GARBAGE)
    first = channels.start
    garbage = trace.values[trace.during()][:, first]
    assert len(np.unique(garbage)) == len(garbage)
    natural = healthy[name].values[healthy[name].during()][:, first]
    assert np.std(garbage) > 10.0 * np.std(natural)
    np.testing.assert_array_equal(trace.during(), healthy[name].during())


@pytest.mark.parametrize(
    ("unit", "bias"),
    [
        (SensorUnit.GYRO, (0.1, -0.2, 0.3)),
        (SensorUnit.ACCEL, (1.0,)),
        (SensorUnit.MAG, (0.0, 0.3)),
        (SensorUnit.BARO, (-400.0,)),
        (SensorUnit.DISTANCE_SENSOR, (2.0,)),
        (SensorUnit.BATTERY, (-1.5,)),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_wrong_and_drift_add_a_bias(
    unit: SensorUnit, bias: tuple[float, ...], healthy: dict[str, Trace]
) -> None:
    name, channels = UNITS[unit]
    good = healthy[name]
    wrong, drift = (
        fly(unit, FaultType.WRONG, bias=bias),
        fly(unit, FaultType.DRIFT, drift_per_s=[0.1 * value for value in bias]),
    )
    during = wrong.during()
    np.testing.assert_array_equal(during, drift.during())
    width = good.values[:, channels].shape[1]
    expected = np.zeros(width)
    expected[: len(bias)] = bias
    offset = (wrong.values - good.values)[during][:, channels]
    np.testing.assert_allclose(offset, np.tile(expected, (during.sum(), 1)), atol=1e-10)
    elapsed_s = np.arange(1, during.sum() + 1) / rate_hz(unit)
    grown = (drift.values - good.values)[during][:, channels]
    np.testing.assert_allclose(grown, elapsed_s[:, None] * 0.1 * expected, atol=1e-9)


@pytest.mark.parametrize("bias", [-3.4e38, 3.4e38])
@pytest.mark.parametrize(
    "unit", [SensorUnit.BARO, SensorUnit.GPS, SensorUnit.DISTANCE_SENSOR], ids=lambda u: u.name
)
def test_a_biased_value_stays_within_what_the_device_can_put_out(unit: SensorUnit, bias: float) -> None:
    name, channels = UNITS[unit]
    values = fly(unit, FaultType.WRONG, bias=(bias,)).values[BEGIN_STEP + 100 : END_STEP, channels]
    low, high = {"barometer": (1000.0, 120_000.0), "gps": (-90.0, 90.0), "rangefinder": (0.1, 40.0)}[name]
    assert np.all((values[:, 0] >= low) & (values[:, 0] <= high))


def test_positions_of_the_world_and_biased_ones_stay_within_180_degrees() -> None:
    home = Home(lat_deg=20.0, lon_deg=179.9999, alt_m=100.0)
    lat_deg, lon_deg = home.offset(3.0, 50.0)
    assert -180.0 <= lon_deg < -179.999
    assert HomeFrame(home).north_east_m(lat_deg, lon_deg) == pytest.approx((3.0, 50.0), abs=1e-6)
    assert home.offset(0.0, 0.0) == (20.0, 179.9999)
    values = np.zeros(i.GPS_SIZE)
    values[[i.GPS_LAT_DEG, i.GPS_LON_DEG]] = 20.0, 179.9999
    add_local_bias(values, np.array([0.0, 50.0, 0.0, *np.zeros(i.GPS_SIZE - 3)]))
    assert values[i.GPS_LON_DEG] == pytest.approx(lon_deg, abs=1e-8)


def test_gps_bias_is_in_metres(healthy: dict[str, Trace]) -> None:
    good = healthy["gps"]
    wrong = fly(SensorUnit.GPS, FaultType.WRONG, bias=(100.0, 50.0, -7.0, 1.0, 2.0, 3.0))
    during = wrong.during()
    offset = (wrong.values - good.values)[during]
    latitude_rad = 0.8
    # Metres per degree at latitude phi, series of the WGS84 ellipsoid (Bowditch, table 6).
    per_lat = 111132.92 - 559.82 * np.cos(2 * latitude_rad) + 1.175 * np.cos(4 * latitude_rad)
    per_lon = (
        111412.84 * np.cos(latitude_rad) - 93.5 * np.cos(3 * latitude_rad) + 0.118 * np.cos(5 * latitude_rad)
    )
    np.testing.assert_allclose(offset[:, i.GPS_LAT_DEG] * per_lat, 100.0, atol=0.02)
    np.testing.assert_allclose(offset[:, i.GPS_LON_DEG] * per_lon, 50.0, atol=0.02)
    np.testing.assert_allclose(offset[:, i.GPS_ALT_M], -7.0, atol=1e-9)
    np.testing.assert_allclose(
        offset[:, i.GPS_VEL_NED_M_S], np.tile((1.0, 2.0, 3.0), (during.sum(), 1)), atol=1e-9
    )
    np.testing.assert_array_equal(offset[:, i.GPS_EPH_M :], 0.0)


def test_gps_without_a_fix_goes_on_reporting(healthy: dict[str, Trace]) -> None:
    trace = fly(SensorUnit.GPS, FaultType.WRONG, no_fix=True)
    np.testing.assert_array_equal(trace.during(), healthy["gps"].during())
    lost = trace.values[trace.during()]
    assert np.all(lost[:, i.GPS_FIX_TYPE] == 1)
    assert np.all(lost[:, i.GPS_SATELLITES] == 0)
    assert np.all(lost[:, i.GPS_EPH_M] > 1000.0)
    assert np.all(np.isfinite(lost))


def test_a_blocked_pitot_tube_reads_no_airspeed(healthy: dict[str, Trace]) -> None:
    good = healthy["airspeed"]
    trace = fly(SensorUnit.AIRSPEED, FaultType.WRONG, blocked=True)
    during = trace.during()
    np.testing.assert_array_equal(during, good.during())
    assert np.all(good.values[during, i.AIRSPEED_DIFFERENTIAL_PRESSURE_PA] > 200.0)
    np.testing.assert_array_equal(trace.values[during, i.AIRSPEED_DIFFERENTIAL_PRESSURE_PA], 0.0)
    np.testing.assert_array_equal(
        trace.values[:, i.AIRSPEED_TEMPERATURE_C], good.values[:, i.AIRSPEED_TEMPERATURE_C]
    )


def test_a_tube_blocked_with_its_drain_keeps_its_pressure() -> None:
    trace = fly(SensorUnit.AIRSPEED, FaultType.STUCK)
    pressures = trace.values[trace.during(), i.AIRSPEED_DIFFERENTIAL_PRESSURE_PA]
    assert len(set(pressures.tolist())) == 1 and pressures[0] > 200.0


@silencing_alone
def test_slow_delivers_one_in_n(unit: SensorUnit, healthy: dict[str, Trace]) -> None:
    good = healthy[UNITS[unit][0]]
    trace = fly(unit, FaultType.SLOW, slow_factor=4)
    delivered = np.flatnonzero(good.during())[3::4]
    np.testing.assert_array_equal(np.flatnonzero(trace.during()), delivered)
    np.testing.assert_array_equal(trace.values[delivered], good.values[delivered])
    np.testing.assert_array_equal(trace.time_us[delivered], good.time_us[delivered])


@imu_half
def test_half_an_imu_slow_changes_every_nth_sample(unit: SensorUnit) -> None:
    trace, channels = fly(unit, FaultType.SLOW, slow_factor=4), UNITS[unit][1]
    values = trace.values[BEGIN_STEP:END_STEP, channels]
    changed = np.flatnonzero(np.any(values[1:] != values[:-1], axis=1)) + 1
    assert np.all(changed % 4 == 3)
    assert len(changed) > 0.9 * (END_STEP - BEGIN_STEP) / 4


@every_unit
def test_delayed_delivers_old_values_with_new_times(unit: SensorUnit, healthy: dict[str, Trace]) -> None:
    name, channels = UNITS[unit]
    good = healthy[name]
    trace = fly(unit, FaultType.DELAYED, delay_s=0.8)
    samples = round(0.8 * rate_hz(unit))
    due = np.flatnonzero(good.during())
    np.testing.assert_array_equal(
        trace.values[due[samples:]][:, channels], good.values[due[:-samples]][:, channels]
    )
    np.testing.assert_array_equal(trace.time_us[due[samples:]], good.time_us[due[samples:]])
    if name != "imu":
        assert not trace.fresh[due[:samples]].any()


@silencing_alone
def test_intermittent_comes_and_goes(unit: SensorUnit, healthy: dict[str, Trace]) -> None:
    good = healthy[UNITS[unit][0]]
    trace = fly(unit, FaultType.INTERMITTENT, mean_up_s=0.4, mean_down_s=0.4)
    due = np.flatnonzero(good.during())
    assert not trace.fresh[due[0]]
    assert 0 < trace.during().sum() < len(due)
    delivered = np.flatnonzero(trace.during())
    np.testing.assert_array_equal(trace.values[delivered], good.values[delivered])


def test_intermittent_keeps_its_mean_times() -> None:
    suite, truth = make_suite(SensorSuiteParameters(barometer=BarometerParameters(rate_hz=50)))
    write_truth(truth, 0)
    suite.faults.inject(SensorUnit.BARO, FaultType.INTERMITTENT, mean_up_s=0.6, mean_down_s=0.2)
    up = np.empty(50_000, dtype=bool)
    for sample in range(up.size):
        for step in range(5):
            suite.step((5 * sample + step) * STEP_US)
            if step == 0:
                up[sample] = suite.readings.barometer.fresh
    assert up.mean() == pytest.approx(0.75, abs=0.03)
    changes = np.flatnonzero(np.diff(up.astype(int)))
    spans_s = np.diff(changes) / 50.0
    assert spans_s[::2].mean() + spans_s[1::2].mean() == pytest.approx(0.8, rel=0.1)


@pytest.mark.parametrize("unit", SensorUnit, ids=lambda unit: unit.name)
def test_units_have_mavlinks_numbers(unit: SensorUnit) -> None:
    kind = "SYSTEM" if unit >= SensorUnit.BATTERY else "SENSOR"
    assert getattr(mavlink, f"FAILURE_UNIT_{kind}_{unit.name}") == unit


@pytest.mark.parametrize("failure", [f for f in FaultType if f != FaultType.DRIFT], ids=lambda f: f.name)
def test_failures_have_mavlinks_numbers(failure: FaultType) -> None:
    assert getattr(mavlink, f"FAILURE_TYPE_{failure.name}") == failure
    assert FaultType.DRIFT not in mavlink.enums["FAILURE_TYPE"]


def test_panel_tells_what_is_in_force() -> None:
    panel = make_suite()[0].faults
    assert panel.units == frozenset(UNITS)
    assert panel.active == {}
    panel.inject(4, 1)
    panel.inject(SensorUnit.MAG, FaultType.STUCK, instance=1)
    assert panel.active == {SensorUnit.GPS: FaultType.OFF, SensorUnit.MAG: FaultType.STUCK}
    panel.inject(SensorUnit.GPS, FaultType.SLOW)
    assert panel.active[SensorUnit.GPS] == FaultType.SLOW
    panel.inject(SensorUnit.GPS, FaultType.OK)
    assert panel.active == {SensorUnit.MAG: FaultType.STUCK}
    panel.clear()
    assert panel.active == {}


@pytest.mark.parametrize(
    ("unit", "failure", "options", "message"),
    [
        (SensorUnit.VIO, FaultType.OFF, {}, "no sensor unit .*VIO.*accepted: GYRO 0, ACCEL 1"),
        (101, FaultType.OFF, {}, "no sensor unit 101; accepted: GYRO 0"),
        (SensorUnit.GPS, 55, {}, "failure 55 is not known; accepted: OK 0, OFF 1"),
        (SensorUnit.GPS, FaultType.OFF, {"instance": 2}, "instance 2 of GPS"),
    ],
)
def test_unsupported_failures_are_refused(
    unit: int, failure: int, options: dict[str, int], message: str
) -> None:
    with pytest.raises(UnsupportedFaultError, match=message):
        make_suite()[0].faults.inject(unit, failure, **options)


@pytest.mark.parametrize(
    ("unit", "failure", "options", "message"),
    [
        (SensorUnit.GPS, FaultType.OFF, {"bias": (1.0,)}, "option bias does not go with OFF; accepted: none"),
        (SensorUnit.GPS, FaultType.SLOW, {"delay_s": 1.0}, "option delay_s .* SLOW; accepted: slow_factor"),
        (SensorUnit.MAG, FaultType.WRONG, {"no_fix": True}, "no_fix is for GPS, not for MAG"),
        (SensorUnit.MAG, FaultType.WRONG, {"blocked": True}, "blocked is for AIRSPEED, not for MAG"),
        (SensorUnit.AIRSPEED, FaultType.STUCK, {"blocked": True}, "option blocked does not go with STUCK"),
        (SensorUnit.MAG, FaultType.WRONG, {"bias": (1, 2, 3, 4)}, r"\(1, 2, 3, 4\) .* 1 to 3 finite numbers"),
        (SensorUnit.MAG, FaultType.DRIFT, {"drift_per_s": (np.nan,)}, "drift_per_s"),
        (SensorUnit.GPS, FaultType.SLOW, {"slow_factor": 1}, "slow_factor = 1"),
        (SensorUnit.GPS, FaultType.SLOW, {"slow_factor": 2.5}, "slow_factor = 2.5"),
        (SensorUnit.GPS, FaultType.DELAYED, {"delay_s": 0.0}, "delay_s = 0.0"),
        (SensorUnit.GPS, FaultType.INTERMITTENT, {"mean_up_s": -1.0}, "mean_up_s = -1.0"),
    ],
)
def test_bad_options_are_refused_and_change_nothing(
    unit: SensorUnit, failure: FaultType, options: dict[str, object], message: str
) -> None:
    panel = make_suite()[0].faults
    with pytest.raises(ValueError, match=message):
        panel.inject(unit, failure, **options)  # type: ignore[arg-type]
    assert panel.active == {}
