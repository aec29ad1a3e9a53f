"""Failsafes of aircraft in the whole stack, as each firmware documents them."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import dialect
from flightsim import truth as t
from flightsim.environment import Environment, Turbulence
from tests.flights.aircraft import AircraftFlight
from tests.flights.flight import FLAVOURS
from tests.slow import slow_after

WIND = Environment(wind_ned_m_s=(0.0, 4.0, 0.0), turbulence=Turbulence.LIGHT)
OK, OFF, STUCK, WRONG = 0, 1, 2, 4
GPS, AIRSPEED, MOTOR, SERVO = 4, 8, 101, 102
CRITICAL, ACTIVE = 5, 4


def circling(flavour: str, height_m: float = 80.0, **parameters: float) -> AircraftFlight:
    flight = AircraftFlight(flavour, seed=3, environment=WIND, parameters=parameters)
    flight.take_off(height_m)
    return flight


def status(flight: AircraftFlight) -> int:
    return flight.heartbeats[-1][3]


@pytest.mark.slow
def test_ground_station_lost_px4() -> None:
    flight = circling("px4", NAV_DLL_ACT=2)
    flight.heartbeat = False
    lost_s = flight.time_s
    flight.fly(12.0)
    assert 8.9 < flight.text_time("Failsafe activated", lost_s) - lost_s < 11.6
    flight.fly(6.0)
    assert flight.mode == "return" and status(flight) == CRITICAL


@pytest.mark.slow
def test_ground_station_lost_arduplane() -> None:
    flight = circling("ardupilot", FS_GCS_ENABL=1, FS_LONG_ACTN=1)
    flight.heartbeat = False
    flight.fly(4.0)
    assert flight.mode == "guided"
    flight.fly(3.5)
    assert flight.mode == "return" and status(flight) == CRITICAL  # FS_LONG_TIMEOUT 5 s
    flight.heartbeat = True
    flight.fly(3.0)
    assert flight.mode == "return"


@pytest.mark.slow
def test_arduplane_goes_on_in_guided_without_a_ground_station() -> None:
    flight = circling("ardupilot", FS_GCS_ENABL=1)  # FS_LONG_ACTN 0: continue in AUTO and GUIDED
    flight.heartbeat = False
    flight.fly(10.0)
    assert flight.mode == "guided"


@pytest.mark.parametrize("flavour", slow_after(1, FLAVOURS))
@pytest.mark.slow
def test_gps_lost_while_circling(flavour: str) -> None:
    """Dead reckoning on airspeed and wind: the mode stays, the reported accuracy grows as the true error."""
    flight = circling(flavour)
    mode = flight.mode
    flight.inject(GPS, OFF)
    heights: list[float] = []
    flight.fly(60.0, lambda: heights.append(flight.height_over_home_m))  # two turns and a half
    assert flight.mode == mode and status(flight) == ACTIVE
    assert np.ptp(heights) < 12.0
    assert flight.distance_m(150.0, 150.0) < 250.0
    flight.inject(GPS, OK)
    flight.fly(45.0)
    assert flight.distance_m(150.0, 150.0) == pytest.approx(100.0, abs=12.0)


@pytest.mark.slow
def test_px4_without_gps_and_airspeed_descends() -> None:
    flight = circling("px4", 60.0)
    flight.inject(GPS, OFF)
    flight.inject(AIRSPEED, OFF)
    lost_s = flight.time_s
    flight.fly(40.0)
    assert flight.text_time("Failsafe activated", lost_s) < math.inf
    assert flight.mode == "land" and status(flight) == CRITICAL  # Descend is shown as AUTO.LAND
    flight.fly_until(lambda: flight.truth[t.ON_GROUND] > 0.0, 240.0, "ground")
    assert flight.actuators_finite


@pytest.mark.slow
def test_px4_offboard_attitudes_go_on_without_gps() -> None:
    flight = circling("px4", 120.0)
    flight.repeat(20.0, lambda _: flight.attitude_setpoint(22.0, 6.0, 0.7))
    flight.fly(0.5)
    flight.set_mode("offboard")
    flight.inject(GPS, OFF)
    rolls: list[float] = []
    flight.fly(60.0, lambda: rolls.append(flight.roll_deg))
    assert flight.mode == "offboard" and status(flight) == ACTIVE
    assert np.mean(rolls) == pytest.approx(22.0, abs=2.0) and np.std(rolls) < 3.0


@pytest.mark.slow
def test_arduplane_guided_attitudes_go_on_without_gps() -> None:
    flight = circling("ardupilot", 100.0)
    flight.repeat(20.0, lambda _: flight.attitude_setpoint(22.0, 0.0, 0.0, 0xC6))
    flight.fly(2.0)
    flight.inject(GPS, OFF)
    rolls, heights = [], []

    def look() -> None:
        rolls.append(flight.roll_deg)
        heights.append(flight.height_over_home_m)

    flight.fly(60.0, look)
    assert flight.mode == "guided" and status(flight) == ACTIVE
    assert np.mean(rolls) == pytest.approx(22.0, abs=2.0)
    assert np.ptp(heights) < 12.0
    # a mode is chosen without a position, too
    flight.stop_repeating()
    flight.set_mode("return")
    flight.set_mode("guided")


@pytest.mark.parametrize("failure", slow_after(1, [STUCK, OFF]))
@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_airspeed_fails(flavour: str, failure: int) -> None:
    flight = circling(flavour, 80.0)
    mode = flight.mode
    flight.inject(AIRSPEED, failure)
    speeds, heights = [], []

    def look() -> None:
        speeds.append(flight.airspeed_m_s)
        heights.append(flight.height_over_home_m)

    flight.fly(60.0, look)
    assert flight.mode == mode
    assert min(speeds) > 14.0 and max(speeds) < 40.0
    assert np.ptp(heights) < 25.0
    flight.inject(AIRSPEED, OK)
    flight.fly(20.0)
    assert flight.mode == mode


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_motor_fails(flavour: str) -> None:
    """It glides, at a speed that carries it, down to the ground."""
    flight = circling(flavour, 80.0)
    flight.inject(MOTOR, OFF)
    speeds, sinks = [], []

    def look() -> bool:
        if flight.height_m > 8.0:
            speeds.append(flight.airspeed_m_s)
            sinks.append(float(flight.velocity_ned_m_s[2]))
        return bool(flight.truth[t.ON_GROUND] > 0.0)

    flight.fly_until(look, 180.0, "ground")
    assert np.mean(speeds) > 15.5 and min(speeds) > 11.0  # it stalls at 14 m/s, and doesn't stay there
    assert np.mean(sinks) < 4.0
    assert abs(flight.roll_deg) < 60.0 and flight.actuators_finite


@pytest.mark.parametrize("flavour", FLAVOURS[::-1])
@pytest.mark.slow
def test_geofence(flavour: str) -> None:
    fence = (
        {"GF_ACTION": 3}
        if flavour == "px4"
        else {"FENCE_ENABLE": 1, "FENCE_TYPE": 2, "FENCE_RADIUS": 400.0, "FENCE_ACTION": 1}
    )
    flight = circling(flavour, 60.0, **fence)
    assert flight.circle(900.0, 0.0, 60.0) == 0
    if flavour == "px4":  # which refuses a place that is outside already
        set_real(flight, "GF_MAX_HOR_DIST", 400.0)
        assert flight.circle(1200.0, 0.0, 60.0) == 1
    flight.fly_until(lambda: flight.mode == "return", 45.0, "return")
    flight.fly(1.2)
    assert status(flight) == CRITICAL
    flight.fly(60.0)
    assert flight.distance_m(0.0, 0.0) < 250.0


def set_real(flight: AircraftFlight, name: str, value: float) -> None:
    flight.send(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, 9))


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
def test_battery_runs_low(flavour: str) -> None:
    if flavour == "px4":
        flight = circling(flavour, 60.0, COM_LOW_BAT_ACT=3)
        set_real(flight, "BAT_CRIT_THR", 0.999)
    else:
        flight = circling(flavour, 60.0, BATT_FS_LOW_ACT=1)
        set_real(flight, "BATT_LOW_VOLT", 60.0)
    flight.fly_until(lambda: flight.mode == "return", 30.0, "return on a low battery")
    flight.fly(1.2)
    assert status(flight) == CRITICAL


@pytest.mark.slow
def test_arduplane_radio_lost_for_a_moment() -> None:
    """FBWA: CIRCLE after FS_SHORT_TIMEOUT, back when the radio is; RTL after FS_LONG_TIMEOUT."""
    flight = AircraftFlight("ardupilot", seed=3)
    flight.start()
    flight.fly(25.0)
    flight.sticks(roll=0.0, throttle=0.6)
    flight.fly(2.0)
    flight.set_mode("fbwa")
    flight.fly(5.0)
    flight.vehicle.autopilot.commander.pilot.radio_failed_since_us = flight.sitl.time_us
    flight.stop_repeating()
    flight.fly(4.0)  # RC_OVERRIDE_TIME of them the override still counts
    assert flight.mode == "circle" and status(flight) == CRITICAL
    flight.vehicle.autopilot.commander.pilot.radio_failed_since_us = None
    flight.sticks(roll=0.0, throttle=0.6)
    flight.fly(2.0)
    assert flight.mode == "fbwa" and status(flight) == ACTIVE
    flight.vehicle.autopilot.commander.pilot.radio_failed_since_us = flight.sitl.time_us
    flight.stop_repeating()
    flight.fly(8.0)
    assert flight.mode == "return"
