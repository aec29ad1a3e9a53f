"""Aircraft in moderate turbulence with something gone: they keep their speed and their attitude."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import dialect
from flightsim import truth as t
from flightsim.environment import Environment, Turbulence
from tests.flights.aircraft import AircraftFlight
from tests.flights.aircraft_figures import equivalent_airspeed_m_s

ROUGH = Environment.from_wind(speed_m_s=6.0, from_deg=90.0, turbulence=Turbulence.MODERATE)
OFF, STUCK = 1, 2
GPS, AIRSPEED, MOTOR = 4, 8, 101
STALL_M_S = 13.6


class Watch:
    """What counts of a flight that shall stay under control."""

    def __init__(self, flight: AircraftFlight) -> None:
        self.flight = flight
        self.airspeeds_m_s: list[float] = []
        self.incidences_deg: list[float] = []
        self.rolls_deg: list[float] = []
        self.heights_m: list[float] = []

    def look(self) -> bool:
        flight = self.flight
        if flight.height_m > 5.0:
            self.airspeeds_m_s.append(equivalent_airspeed_m_s(flight))
            self.incidences_deg.append(math.degrees(flight.truth[t.ANGLE_OF_ATTACK_RAD]))
            self.rolls_deg.append(abs(flight.roll_deg))
            self.heights_m.append(flight.height_over_home_m)
        return bool(flight.truth[t.ON_GROUND] > 0.0)

    def check_controlled(self) -> None:
        assert min(self.airspeeds_m_s) > 1.05 * STALL_M_S  # in the worst of the gusts
        assert np.percentile(self.airspeeds_m_s, 5) > 1.15 * STALL_M_S
        assert max(self.incidences_deg) < 20.0  # the wing stalls beyond
        assert max(self.rolls_deg) < 60.0
        assert self.flight.actuators_finite


def circling(flavour: str, seed: int, height_m: float = 90.0) -> AircraftFlight:
    flight = AircraftFlight(flavour, seed=seed, environment=ROUGH)
    flight.take_off(height_m)
    return flight


def glides(flavour: str, seed: int, *also: int) -> None:
    flight = circling(flavour, seed)
    mode = flight.mode
    for unit in (MOTOR, *also):
        flight.inject(unit, OFF)
    watch = Watch(flight)
    flight.fly_until(watch.look, 150.0, "ground")
    watch.check_controlled()
    assert flight.mode == mode  # neither firmware has a failsafe for it
    sink_m_s = -np.polyfit(np.arange(len(watch.heights_m)) * 0.1, watch.heights_m, 1)[0]
    assert 0.5 < sink_m_s < 4.0


def holds(flavour: str, seed: int, *failures: tuple[int, int]) -> None:
    flight = circling(flavour, seed)
    for unit, failure in failures:
        flight.inject(unit, failure)
    watch = Watch(flight)
    failed_s = flight.time_s
    flight.fly(60.0, watch.look)
    watch.check_controlled()
    assert np.ptp(watch.heights_m) < 12.0
    if any(unit == AIRSPEED for unit, _ in failures):
        assert flight.text_time("irspeed", failed_s) < failed_s + 30.0  # it is reported


@pytest.mark.slow  # the quick one in light turbulence is in test_fixed_wing_failsafes
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_motor_failed_in_turbulence(flavour: str) -> None:
    glides(flavour, 1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_motor_and_gps_failed(flavour: str, seed: int) -> None:
    glides(flavour, seed, GPS)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("failures", [((AIRSPEED, STUCK),), ((AIRSPEED, OFF),), ((GPS, OFF),)])
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_sensors_failed_in_turbulence(flavour: str, failures: tuple[tuple[int, int], ...], seed: int) -> None:
    holds(flavour, seed, *failures)


@pytest.mark.slow
def test_a_speed_below_the_lowest_is_not_flown() -> None:
    flight = circling("px4", 1)
    assert flight.result(dialect.MAV_CMD_DO_CHANGE_SPEED, 0, 8.0, -1) == 0
    watch = Watch(flight)
    flight.fly(40.0, watch.look)
    watch.check_controlled()
    assert np.mean(watch.airspeeds_m_s) > 18.0  # FW_AIRSPD_MIN
    assert np.ptp(watch.heights_m) < 10.0


@pytest.mark.slow
def test_a_climb_beyond_its_power_is_flown_at_its_speed() -> None:
    flight = circling("ardupilot", 1, 60.0)
    assert flight.circle(150.0, 150.0, 600.0, 100.0) == 0
    watch = Watch(flight)
    flight.fly(40.0, watch.look)
    watch.check_controlled()
    assert min(watch.airspeeds_m_s) > 20.0
    assert watch.heights_m[-1] > watch.heights_m[0] + 80.0


@pytest.mark.parametrize(("wind_from_deg", "seed"), [(90.0, 1), (180.0, 3)])
def test_parked_and_taking_off_in_rough_wind(wind_from_deg: float, seed: int) -> None:
    """Gusts of 14 m/s from the side and from behind: it stands, keeps its heading known, and takes off."""
    wind = Environment.from_wind(speed_m_s=6.0, from_deg=wind_from_deg, turbulence=Turbulence.MODERATE)
    flight = AircraftFlight("px4", seed=seed, environment=wind)
    flight.start()
    worst_rad, banks_deg = [0.0], [0.0]

    def look() -> bool:
        estimated = float(flight.vehicle.autopilot.navigation.state[27])
        error = (estimated - flight.yaw_rad + math.pi) % (2.0 * math.pi) - math.pi
        worst_rad[0] = max(worst_rad[0], abs(error))
        if flight.height_m < 3.0:
            banks_deg[0] = max(banks_deg[0], abs(flight.roll_deg))
        return flight.height_over_home_m > 20.0

    flight.fly_until(look, 40.0, "climb")
    assert worst_rad[0] < math.radians(6.0)
    assert banks_deg[0] < 25.0
    assert flight.text_time("Failsafe") == math.inf
