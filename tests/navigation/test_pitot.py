"""Airspeed from a pitot tube: conversion, checks over time, turbulence."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.navigation import NavigationParameters
from autopilot_bridge.navigation.pitot import AirspeedCheck, GustVariance, Pitot
from flightsim.foundation.random_streams import RandomStreams
from flightsim.interface import SensorReadings
from tests.navigation.matched import MATCHED

PARAMETERS = NavigationParameters(fixed_wing=True, **MATCHED)


def pitot_at(pressure_pa: float, static_pa: float, temperature_c: float, **changes: float) -> Pitot:
    readings = SensorReadings()
    pitot = Pitot(replace(PARAMETERS, **changes), readings=readings)  # type: ignore[arg-type]
    readings.barometer.values[:] = static_pa, 20.0
    readings.airspeed.values[:] = pressure_pa, temperature_c
    readings.airspeed.time_us = 1000
    pitot.look(2000)
    pitot.update_density(trusted=True)
    return pitot


def test_airspeed_of_a_dynamic_pressure() -> None:
    pitot = pitot_at(0.5 * 1.225 * 20.0**2, 101325.0, 20.0)  # 15 C, the sensor 5 K warmer
    assert pitot.equivalent_m_s == pytest.approx(20.0)
    assert pitot.true_m_s == pytest.approx(20.0, abs=1e-3)
    high = pitot_at(0.5 * 1.1117 * 25.0**2, 89874.6, 13.5)
    assert high.true_m_s == pytest.approx(25.0, abs=0.01)
    assert high.equivalent_m_s == pytest.approx(25.0 * math.sqrt(1.1117 / 1.225), abs=0.01)
    scaled = pitot_at(0.5 * 1.225 * 20.0**2, 101325.0, 20.0, airspeed_scale=1.1)
    assert scaled.equivalent_m_s == pytest.approx(22.0)
    assert pitot_at(-3.0, 101325.0, 20.0).equivalent_m_s == 0.0


def test_without_a_temperature_the_standard_one_is_taken() -> None:
    assert pitot_at(100.0, 89874.6, math.nan).true_per_equivalent == pytest.approx(
        math.sqrt(1.225 / 1.1117), rel=1e-4
    )
    assert pitot_at(100.0, math.nan, 20.0).true_per_equivalent == 1.0


@given(st.floats(), st.floats(), st.floats())
def test_any_values(pressure_pa: float, static_pa: float, temperature_c: float) -> None:
    pitot = pitot_at(pressure_pa, static_pa, temperature_c)
    assert math.isnan(pitot.equivalent_m_s) or 0.0 <= pitot.equivalent_m_s < 200.0
    assert 0.5 < pitot.true_per_equivalent < 5.0


@pytest.mark.parametrize(
    ("static_pa", "valid"), [(1.0e4, True), (9_999.5, False), (1.2e5, True), (120_000.5, False)]
)
def test_an_impossible_static_pressure_leaves_the_density(static_pa: float, valid: bool) -> None:
    assert (pitot_at(100.0, static_pa, 20.0).true_per_equivalent != 1.0) == valid


@pytest.mark.parametrize(
    ("temperature_c", "valid"), [(-60.0, True), (-60.5, False), (80.0, True), (80.5, False)]
)
def test_an_impossible_temperature_is_as_none(temperature_c: float, valid: bool) -> None:
    standard = pitot_at(100.0, 95_000.0, math.nan).true_per_equivalent
    assert (pitot_at(100.0, 95_000.0, temperature_c).true_per_equivalent != standard) == valid


@pytest.mark.parametrize(
    ("pressure_pa", "valid"), [(1.0e4, True), (10_001.0, False), (-1.0e4, True), (-10_001.0, False)]
)
def test_an_impossible_differential_pressure_is_no_sample(pressure_pa: float, valid: bool) -> None:
    assert (pitot_at(pressure_pa, 95_000.0, 20.0).sample_us == 1000) == valid


def test_a_sensor_is_alive_for_a_second_after_a_sample_and_two_after_a_change() -> None:
    pitot = pitot_at(100.0, 95_000.0, 20.0)
    assert pitot.alive(1_002_000) and not pitot.alive(1_002_001)
    pitot._readings.airspeed.time_us = 1_500_000
    pitot.look(1_500_000)
    assert pitot.alive(2_002_000) and not pitot.alive(2_002_001)
    pitot.restart()
    assert not pitot.alive(1_500_000)


def test_alive() -> None:
    readings = SensorReadings()
    pitot = Pitot(PARAMETERS, readings=readings)
    assert not pitot.alive(0)
    for k in range(100):
        readings.airspeed.values[:] = 100.0 + (k if k < 50 else 50), 20.0
        readings.airspeed.time_us = 40_000 * k
        pitot.look(40_000 * k)
        assert pitot.alive(40_000 * k)
    for k in range(100, 150):  # goes on saying the same
        readings.airspeed.time_us = 40_000 * k
        pitot.look(40_000 * k)
    assert not pitot.alive(40_000 * 149)
    readings.airspeed.values[0] = 90.0
    readings.airspeed.time_us = 6_100_000
    pitot.look(6_100_000)
    assert pitot.alive(6_100_000) and not pitot.alive(7_200_000)  # silent


def run_check(
    check: AirspeedCheck, start_s: float, end_s: float, innovation: float, **changes: float
) -> float:
    """Update at 5 Hz; the time at which belief changed, NaN if it didn't."""
    parameters = replace(PARAMETERS, **changes)  # type: ignore[arg-type]
    before, changed = check.passed, math.nan
    for k in range(round(start_s * 5), round(end_s * 5)):
        check.update(parameters, k * 200_000, alive=True, innovation_m_s=innovation, sigma_m_s=0.0)
        if check.passed != before and math.isnan(changed):
            changed = k * 0.2
    return changed


def test_innovations_add_up_and_pass_again() -> None:
    check = AirspeedCheck()
    assert math.isnan(run_check(check, 0.0, 60.0, 4.9)) and check.passed
    # 5 m/s too much: 10 m after 2 s, then the delay of one second
    assert run_check(check, 60.0, 70.0, 10.0) == pytest.approx(63.2, abs=0.5)
    assert run_check(check, 70.0, 90.0, 1.0) == pytest.approx(75.0, abs=0.3)


def test_never_used_again_if_so_set() -> None:
    check = AirspeedCheck()
    run_check(check, 0.0, 10.0, 20.0, airspeed_start_delay_s=1e9)
    run_check(check, 10.0, 60.0, 0.0, airspeed_start_delay_s=1e9)
    assert not check.passed


def test_doubt_about_the_estimate_excuses_the_sensor() -> None:
    check = AirspeedCheck()
    for k in range(100):
        check.update(PARAMETERS, k * 200_000, alive=True, innovation_m_s=10.0, sigma_m_s=3.0)
    assert check.passed
    for k in range(100, 200):
        check.update(PARAMETERS, k * 200_000, alive=k < 120, innovation_m_s=math.nan, sigma_m_s=0.0)
        assert check.passed == (k < 125)  # dead for a second


@pytest.mark.parametrize("sigma", [0.5, 1.0, 2.0, 4.0])
def test_gust_variance(sigma: float) -> None:
    gusts = GustVariance()
    rng = RandomStreams(1).generator("gusts")
    for _ in range(1500):
        gusts.add(float(rng.normal(0.0, sigma)), 0.0, 0.1, 0.2)
    assert gusts.variance == pytest.approx(sigma**2, rel=0.35)
    before = gusts.variance
    gusts.add(50.0, 0.0, 4.0, 0.2)  # while the wind isn't known yet
    assert gusts.variance == before
