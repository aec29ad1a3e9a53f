"""Battery and motors: hover power, sag, drain, depletion, motor failure."""

import math

import numpy as np
import pytest

from flightsim import truth as t
from flightsim.airframe import AirframeError
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.interface import MAX_ACTUATORS
from flightsim.trim_flight import TrimError
from flightsim.vehicle import Vehicle
from tests.flightsim.hover_trim import HoverTrim, trim_hover

TORQUE_CONSTANT = 60.0 / (2.0 * math.pi * 850.0)
RESISTANCE_OHM, FRICTION = 0.24, 7.6e-6
BATTERY_OHM, AVIONICS_A, CAPACITY_AH = 0.030, 0.4, 3.5


def make(initial: InitialState | None = None, model: str = "iris") -> Vehicle:
    return Vehicle(
        model,
        home=Home(),
        environment=Environment(),
        seed_sequence=np.random.SeedSequence(0),
        initial=initial,
    )


def command(*motors: float) -> np.ndarray:
    actuators = np.zeros(MAX_ACTUATORS)
    actuators[: len(motors)] = motors
    return actuators


@pytest.fixture(scope="module")
def hover() -> HoverTrim:
    return trim_hover(home=Home())


def test_hover_power(hover: HoverTrim) -> None:
    """From weight to current: C_T gives the speed, C_P the torque, the motor's equations the current."""
    density = make(InitialState(height_m=100.0)).truth[t.DENSITY_KG_M3]
    n = math.sqrt(1.5 * 9.8069 / 4.0 / (0.1210 * density * 0.254**4))
    omega = 2.0 * math.pi * n
    shaft_w = 0.0488 * density * n**3 * 0.254**5
    current = (shaft_w / omega + FRICTION * omega) / TORQUE_CONSTANT
    motor_w = (TORQUE_CONSTANT * omega + RESISTANCE_OHM * current) * current
    voltage = 12.6
    for _ in range(50):
        battery_a = 4.0 * motor_w / voltage + AVIONICS_A
        voltage = 12.6 - BATTERY_OHM * battery_a
    assert hover.current_a == pytest.approx(battery_a, rel=2e-3)
    assert hover.voltage_v == pytest.approx(voltage, rel=2e-3)
    assert 10.0 < 60.0 * CAPACITY_AH / hover.current_a < 20.0  # minutes
    ideal_w = (1.5 * 9.8069 / 4.0) ** 1.5 / math.sqrt(2.0 * density * math.pi * 0.127**2)
    assert 0.6 < ideal_w / shaft_w < 0.75  # figure of merit of a small propeller


def test_charge_used_is_the_integral_of_current(hover: HoverTrim) -> None:
    vehicle = make(InitialState(height_m=100.0, rotor_rad_s=hover.rotor_rad_s))
    used, charge = vehicle.truth[t.BATTERY_USED_AH], 0.0
    for i in range(1000):
        vehicle.step(command(*(duty + 0.05 * math.sin(0.1 * i) for duty in hover.actuators)))
        charge += vehicle.truth[t.BATTERY_CURRENT_A] * 0.004 / 3600.0
    assert vehicle.truth[t.BATTERY_USED_AH] - used == pytest.approx(charge, rel=1e-6)
    assert vehicle.truth[t.BATTERY_CAPACITY_AH] == CAPACITY_AH


@pytest.mark.parametrize(("remaining", "cell_v"), [(1.0, 4.20), (0.5, 3.84), (0.2, 3.73), (0.05, 3.61)])
def test_voltage_is_open_circuit_less_sag(remaining: float, cell_v: float) -> None:
    vehicle = make(InitialState(height_m=50.0, rotor_rad_s=500.0, battery_remaining=remaining))
    for _ in range(5):
        vehicle.step(command(0.8, 0.8, 0.8, 0.8))
    current = vehicle.truth[t.BATTERY_CURRENT_A]
    assert current > 10.0
    assert vehicle.truth[t.BATTERY_VOLTAGE_V] == pytest.approx(3.0 * cell_v - BATTERY_OHM * current, abs=0.01)


def test_a_larger_battery_of_the_same_charge_has_the_same_voltage_and_lasts_longer() -> None:
    large, own = (
        make(InitialState(height_m=50.0, rotor_rad_s=500.0, battery_remaining=0.5, battery_ah=capacity_ah))
        for capacity_ah in (12.0, None)
    )
    for vehicle, capacity_ah in ((large, 12.0), (own, CAPACITY_AH)):
        vehicle.step(command(0.8, 0.8, 0.8, 0.8))
        assert vehicle.truth[t.BATTERY_CAPACITY_AH] == capacity_ah
        assert vehicle.truth[t.BATTERY_USED_AH] == pytest.approx(0.5 * capacity_ah, abs=1e-3)
    assert large.truth[t.BATTERY_VOLTAGE_V] == pytest.approx(own.truth[t.BATTERY_VOLTAGE_V], abs=1e-3)


def test_a_battery_that_cannot_be_changed_is_named() -> None:
    with pytest.raises(AirframeError, match="battery_ah 8 Ah: the battery of vehicle 'c172x'"):
        make(InitialState(battery_ah=8.0), model="c172x")


def test_current_balances_the_motors(hover: HoverTrim) -> None:
    vehicle = make(InitialState(height_m=50.0, rotor_rad_s=hover.rotor_rad_s))
    duty = np.array([0.5, 0.6, 0.55, 0.65])
    before = vehicle.truth[32:36].copy()
    vehicle.step(command(*duty))
    voltage = vehicle.truth[t.BATTERY_VOLTAGE_V]
    motors_a = (duty * voltage - TORQUE_CONSTANT * before) / RESISTANCE_OHM
    assert vehicle.truth[t.BATTERY_CURRENT_A] == pytest.approx(float(duty @ motors_a) + AVIONICS_A, rel=1e-3)


def test_an_emptier_battery_needs_more_duty(hover: HoverTrim) -> None:
    low = trim_hover(home=Home(), battery_remaining=0.1)
    assert low.rotor_rad_s == pytest.approx(hover.rotor_rad_s, rel=1e-4)
    assert low.actuators[0] > hover.actuators[0] + 0.05
    assert low.current_a > hover.current_a


def test_an_empty_battery_stops_the_rotors() -> None:
    vehicle = make(InitialState(height_m=100.0, rotor_rad_s=500.0, battery_remaining=0.0))
    for _ in range(2500):
        vehicle.step(command(0.6, 0.6, 0.6, 0.6))
        if vehicle.truth[t.BATTERY_VOLTAGE_V] < 5.0:
            break
    assert vehicle.truth[t.BATTERY_VOLTAGE_V] >= 0.0
    for _ in range(15_000):
        vehicle.step(command(0.6, 0.6, 0.6, 0.6))
    assert vehicle.truth[t.ON_GROUND] == 1.0
    assert vehicle.truth[t.BATTERY_VOLTAGE_V] < 6.0
    assert vehicle.truth[32] < 300.0


def test_standing_draws_the_avionics_only() -> None:
    vehicle = make()
    vehicle.step(command())
    assert vehicle.truth[t.BATTERY_CURRENT_A] == pytest.approx(AVIONICS_A, rel=1e-6)
    assert vehicle.truth[t.BATTERY_USED_AH] == pytest.approx(AVIONICS_A * 0.004 / 3600.0, rel=1e-3)
    assert np.all(vehicle.truth[t.ROTOR_RAD_S] == 0.0)


def test_commands_are_clipped() -> None:
    low, high = make(), make()
    for _ in range(20):
        low.step(command(-1.0, -1.0, -1.0, -1.0))
        high.step(command(2.0, 2.0, 2.0, 2.0))
    full = make()
    for _ in range(20):
        full.step(command(1.0, 1.0, 1.0, 1.0))
    assert np.all(low.truth[32:36] == 0.0)
    assert np.array_equal(high.truth, full.truth)


def test_a_failed_motor_runs_down(hover: HoverTrim) -> None:
    vehicle = make(InitialState(height_m=100.0, rotor_rad_s=hover.rotor_rad_s))
    vehicle.set_motor_effectiveness(0, 0.0)
    assert vehicle.motor_effectiveness(0) == 0.0
    for _ in range(75):
        vehicle.step(command(*hover.actuators))
    assert vehicle.truth[32] < 0.1 * hover.rotor_rad_s[0]
    assert vehicle.truth[33] > 0.9 * hover.rotor_rad_s[1]
    assert vehicle.truth[10] > 1.0  # front right is gone: rolls right, pitches down
    assert vehicle.truth[11] < -1.0


def test_bad_failures_are_refused() -> None:
    vehicle = make()
    with pytest.raises(ValueError, match=r"1\.5"):
        vehicle.set_motor_effectiveness(0, 1.5)
    with pytest.raises(ValueError, match="actuator 4"):
        vehicle.set_motor_effectiveness(4, 0.0)


def test_trim_in_wind_balances(hover: HoverTrim) -> None:
    windy = trim_hover(home=Home(), environment=Environment(wind_ned_m_s=(-8.0, 0.0, 0.0)))
    assert windy.residual_n < 1e-5
    assert windy.residual_nm < 1e-5
    assert -0.3 < windy.pitch_rad < -0.05
    assert abs(windy.roll_rad) < 0.01


def test_trim_says_why_it_fails() -> None:
    with pytest.raises(TrimError, match="no hover"):
        trim_hover(home=Home(), environment=Environment(wind_ned_m_s=(-45.0, 0.0, 0.0)))
    with pytest.raises(AirframeError, match="unknown"):
        trim_hover("blimp", home=Home())
