"""The suite: rates, latency, freshness, independence of streams, determinism, refusals."""

from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.interface import Reading
from flightsim.sensors import (
    AirspeedParameters,
    BarometerParameters,
    FaultType,
    FlowVaneParameters,
    GpsParameters,
    ImuParameters,
    MagnetometerParameters,
    SensorModel,
    SensorSuite,
    SensorSuiteParameters,
    SensorUnit,
)
from flightsim.sensors.fault_kinds import FaultTarget

Array = NDArray[np.float64]
Log = dict[str, list[tuple[int, int, bytes]]]

RATE_HZ = 250
STEP_US = 1_000_000 // RATE_HZ
NAMES = tuple(field.name for field in fields(SensorSuiteParameters))
AIRCRAFT_ONLY = ("airspeed", "flow_vane")
QUADROTOR = SensorSuiteParameters()
EVERYTHING = SensorSuiteParameters(airspeed=AirspeedParameters(), flow_vane=FlowVaneParameters())


def make_suite(
    parameters: SensorSuiteParameters | None = None, *, seed: int = 1, physics_rate_hz: int = RATE_HZ
) -> tuple[SensorSuite, Array]:
    truth = np.zeros(t.TRUTH_SIZE)
    streams = RandomStreams(seed)
    suite = SensorSuite(
        parameters or EVERYTHING,
        physics_rate_hz=physics_rate_hz,
        truth=truth,
        seeds=lambda name: streams.child("vehicle", 0, "sensor", name),
    )
    return suite, truth


def write_truth(truth: Array, step: int) -> None:
    """Something that moves on every step in every channel."""
    s = 1e-3 * step
    truth[t.LAT_RAD], truth[t.LON_RAD], truth[t.ALT_M] = 0.8 + 1e-7 * s, 0.1 - 1e-7 * s, 500.0 + s
    truth[t.VEL_NED_M_S] = (s, -s, 0.1 * s)
    truth[t.Q_NED_FROM_FRD] = (np.cos(0.1 * s), 0.0, 0.0, np.sin(0.1 * s))
    truth[t.RATES_FRD_RAD_S] = (0.1 * s, 0.2 * s, -0.1 * s)
    truth[t.SPECIFIC_FORCE_FRD_M_S2] = (s, -s, -9.81 + 0.1 * s)
    truth[t.PRESSURE_PA], truth[t.TEMPERATURE_K] = 95000.0 - 10.0 * s, 288.0 + 0.1 * s
    truth[t.MAG_NED_GAUSS] = (0.21, 0.01, 0.43)
    truth[t.HEIGHT_ABOVE_GROUND_M] = 5.0 + 0.5 * s
    truth[t.BATTERY_VOLTAGE_V], truth[t.BATTERY_CURRENT_A] = 16.0 - 0.1 * s, 14.0 + s
    truth[t.BATTERY_CAPACITY_AH] = 5.0
    truth[t.ANGLE_OF_ATTACK_RAD], truth[t.SIDESLIP_RAD] = 0.05 + 0.1 * s, -0.05 * s
    truth[t.DYNAMIC_PRESSURE_PA] = 300.0 + 10.0 * s


def fly(suite: SensorSuite, truth: Array, steps: int) -> Log:
    """Every delivery as (time delivered, time measured, bytes), by sensor."""
    log: Log = {name: [] for name in NAMES}
    for step in range(steps):
        write_truth(truth, step)
        suite.step(step * STEP_US)
        for name in NAMES:
            reading = getattr(suite.readings, name)
            if reading.fresh:
                log[name].append((step * STEP_US, reading.time_us, reading.values.tobytes()))
    return log


@pytest.mark.parametrize("name", NAMES)
def test_rates_are_exact(name: str) -> None:
    suite, truth = make_suite()
    parameters = getattr(EVERYTHING, name)
    log = fly(suite, truth, 4 * RATE_HZ)
    measured = [measured_us for _, measured_us, _ in log[name]]
    interval_us = 1_000_000 // parameters.rate_hz
    assert measured == list(range(0, measured[-1] + 1, interval_us))
    assert len(measured) == 4 * parameters.rate_hz


@pytest.mark.parametrize("latency_steps", [0, 1, 4, 5, 6, 10, 13])
def test_latency_is_exact(latency_steps: int) -> None:
    """Shorter, equal to and longer than the sampling interval of five steps."""
    latency_s = latency_steps * STEP_US * 1e-6
    late = SensorSuiteParameters(barometer=BarometerParameters(rate_hz=50, latency_s=latency_s))
    deliveries = fly(*make_suite(late), 100)["barometer"]
    assert {delivered - measured for delivered, measured, _ in deliveries} == {latency_steps * STEP_US}
    assert len(deliveries) == len(range(latency_steps, 100, 5))
    at_once = SensorSuiteParameters(barometer=BarometerParameters(rate_hz=50))
    prompt = fly(*make_suite(at_once), 100)["barometer"]
    assert [value for *_, value in deliveries] == [value for *_, value in prompt][: len(deliveries)]


def test_default_gps_latency_rounds_to_steps() -> None:
    deliveries = fly(*make_suite(), 2 * RATE_HZ)["gps"]
    assert {delivered - measured for delivered, measured, _ in deliveries} == {28 * STEP_US}


def test_nothing_is_read_before_the_first_delivery() -> None:
    suite, truth = make_suite()
    write_truth(truth, 0)
    suite.step(0)
    gps = suite.readings.gps
    assert not gps.fresh and gps.time_us == -1 and np.all(np.isnan(gps.values))
    assert suite.readings.imu.fresh and suite.readings.imu.time_us == 0


@pytest.mark.parametrize("removed", NAMES)
def test_removing_a_sensor_changes_no_other(removed: str) -> None:
    everything = fly(*make_suite(), 500)
    without = fly(*make_suite(replace(EVERYTHING, **{removed: None})), 500)
    assert without.pop(removed) == []
    assert everything.pop(removed) != []
    assert without == everything


def test_an_aircraft_s_sensors_are_absent_from_a_quadrotor_and_change_nothing_of_it() -> None:
    quadrotor = fly(*make_suite(QUADROTOR), 500)
    assert [name for name in NAMES if not quadrotor[name]] == list(AIRCRAFT_ONLY)
    aircraft = fly(*make_suite(), 500)
    for name in set(NAMES) - set(AIRCRAFT_ONLY):
        assert quadrotor[name] == aircraft[name]


def test_the_fixed_wing_suite() -> None:
    suite, truth = make_suite(SensorSuiteParameters.fixed_wing())
    log = fly(suite, truth, 250)
    assert [name for name in NAMES if not log[name]] == ["flow_vane"]
    assert suite.readings.rangefinder.values[2] == 100.0
    assert SensorUnit.AIRSPEED in suite.faults.units
    assert SensorSuiteParameters.fixed_wing(rangefinder=None).rangefinder is None


@pytest.mark.parametrize("unit", list(make_suite()[0].faults.units), ids=lambda unit: unit.name)
def test_a_fault_changes_no_other_sensor(unit: SensorUnit) -> None:
    names = {
        SensorUnit.GYRO: "imu",
        SensorUnit.ACCEL: "imu",
        SensorUnit.MAG: "magnetometer",
        SensorUnit.BARO: "barometer",
        SensorUnit.GPS: "gps",
        SensorUnit.DISTANCE_SENSOR: "rangefinder",
        SensorUnit.BATTERY: "battery",
        SensorUnit.AIRSPEED: "airspeed",
    }
    healthy = fly(*make_suite(), 500)
    suite, truth = make_suite()
    suite.faults.inject(unit, FaultType.GARBAGE)
    faulty = fly(suite, truth, 500)
    assert faulty.pop(names[unit]) != healthy.pop(names[unit])
    assert faulty == healthy


def test_every_sensor_and_every_unit_has_a_stream_of_its_own() -> None:
    requested: list[str] = []

    def seeds(name: str) -> np.random.SeedSequence:
        requested.append(name)
        return RandomStreams(1).child(name)

    suite = SensorSuite(EVERYTHING, physics_rate_hz=RATE_HZ, truth=np.zeros(t.TRUTH_SIZE), seeds=seeds)
    assert sorted(requested) == sorted(
        [*NAMES, *(f"fault_{unit.name.lower()}" for unit in suite.faults.units)]
    )


def test_same_seed_same_bytes_and_another_seed_other_bytes() -> None:
    first, again, other = (fly(*make_suite(seed=seed), 500) for seed in (3, 3, 4))
    assert first == again
    for name in NAMES:
        assert first[name] != other[name]


def test_noise_goes_on_past_the_block() -> None:
    """Consecutive blocks of normals differ: no sample repeats with the block's period."""
    parameters = SensorSuiteParameters(imu=ImuParameters(gyro_quantum_rad_s=0.0, accel_quantum_m_s2=0.0))
    suite, truth = make_suite(parameters)
    write_truth(truth, 0)
    seen = set()
    for step in range(1000):
        suite.step(step * STEP_US)
        seen.add(suite.readings.imu.values[0])
    assert len(seen) == 1000


@pytest.mark.parametrize("rate_hz", [3, 7, 60, 100, 500])
def test_rate_that_does_not_divide_is_refused(rate_hz: int) -> None:
    parameters = SensorSuiteParameters(gps=GpsParameters(rate_hz=rate_hz))
    message = f"gps: .*{rate_hz} Hz.*250 Hz; accepted: 1, 2, 5, 10, 25, 50, 125, 250$"
    with pytest.raises(ValueError, match=message):
        make_suite(parameters)


@pytest.mark.parametrize(
    "truth",
    [np.zeros(t.TRUTH_SIZE - 1), np.zeros(t.TRUTH_SIZE, dtype=np.float32), np.zeros(2 * t.TRUTH_SIZE)[::2]],
)
def test_wrong_truth_vector_is_refused(truth: NDArray[np.floating]) -> None:
    with pytest.raises(ValueError, match=rf"accepted: contiguous float64 of \({t.TRUTH_SIZE},\)"):
        SensorSuite(
            SensorSuiteParameters(),
            physics_rate_hz=250,
            truth=truth,
            seeds=RandomStreams(1).child,  # type: ignore[arg-type]
        )


class Thermometer:
    """A sensor that the suite does not know: parameters and model in one."""

    rate_hz = 10
    latency_s = 0.0

    def build(self, interval_s: float, rng: np.random.Generator) -> SensorModel:
        def kernel(
            truth: Array, constants: Array, state: Array, normals: Array, row: int, out: Array
        ) -> bool:
            out[0] = truth[t.TEMPERATURE_K] + constants[0] * normals[row, 0]
            return True

        return SensorModel(
            kernel=kernel,
            constants=np.array([0.1]),
            state=np.zeros(1),
            normals_per_sample=1,
            size=1,
            fault_targets=(
                FaultTarget(
                    unit=SensorUnit.OPTICAL_FLOW,
                    channels=slice(0, 1),
                    wrong_bias=(5.0,),
                    drift_per_s=(1.0,),
                    low=(0.0,),
                    high=(400.0,),
                ),
            ),
        )


def test_a_new_sensor_fits_in_without_touching_the_others() -> None:
    suite, truth = make_suite()
    reading = Reading(1)
    suite.add("thermometer", reading, Thermometer())
    assert fly(suite, truth, 500) == fly(*make_suite(), 500)
    assert abs(reading.values[0] - truth[t.TEMPERATURE_K]) < 1.0
    assert SensorUnit.OPTICAL_FLOW in suite.faults.units
    with pytest.raises(RuntimeError, match="before the first step"):
        suite.add("second", Reading(1), Thermometer())


def test_names_units_and_sizes_are_checked_when_fitting() -> None:
    suite, _ = make_suite()
    with pytest.raises(ValueError, match="already a sensor named 'gps'"):
        suite.add("gps", Reading(13), GpsParameters())
    with pytest.raises(ValueError, match="already a sensor with the unit MAG"):
        suite.add("compass", Reading(3), MagnetometerParameters())
    with pytest.raises(ValueError, match="holds 2 values, the model makes 1"):
        suite.add("thermometer", Reading(2), Thermometer())


def test_other_physics_rates() -> None:
    suite, truth = make_suite(physics_rate_hz=1000)
    fresh = 0
    for step in range(1000):
        write_truth(truth, step)
        suite.step(step * 1000)
        fresh += suite.readings.imu.fresh
    assert fresh == 250
    with pytest.raises(ValueError, match="physics_rate_hz = 0"):
        make_suite(physics_rate_hz=0)
