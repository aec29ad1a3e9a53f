"""Failsafes of the whole stack, commanded and observed over MAVLink alone.

Their times are those of docs/firmware.
"""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import dialect
from tests.flights.flight import FLAVOURS, Flight
from tests.slow import slow, slow_after

CRITICAL = 5
OK, OFF, STUCK, GARBAGE, SLOW, DELAYED, INTERMITTENT = 0, 1, 2, 3, 5, 6, 7
GYRO, ACCEL, MAG, BARO, GPS = 0, 1, 2, 3, 4
GUIDED = {"px4": "offboard", "ardupilot": "guided"}


def guided_north(flight: Flight, speed_m_s: float) -> None:
    """Fly north by streamed velocity setpoints."""
    flight.repeat(10.0, lambda _: flight.position_setpoint(velocity_ned_m_s=(speed_m_s, 0.0, 0.0)))
    flight.fly(1.0)
    flight.set_mode(GUIDED[flight.flavour])


def hovering(flavour: str, height_m: float = 12.0, seed: int = 3, **parameters: float) -> Flight:
    flight = Flight(flavour, seed=seed, parameters=parameters)
    flight.take_off(height_m)
    return flight


def status(flight: Flight) -> int:
    return flight.heartbeats[-1][3]


def test_px4_offboard_setpoints_lost_and_resumed() -> None:
    flight = hovering("px4")
    guided_north(flight, 3.0)
    flight.fly(6.0)
    assert flight.velocity_ned_m_s[0] == pytest.approx(3.0, abs=0.3)
    flight.stop_repeating()
    lost_s = flight.time_s
    flight.fly(5.0)
    assert flight.text_time("Failsafe activated", lost_s) - lost_s == pytest.approx(1.0, abs=0.15)
    assert flight.mode == "position" and status(flight) == CRITICAL
    assert flight.speed_m_s < 0.3
    flight.repeat(10.0, lambda _: flight.position_setpoint(velocity_ned_m_s=(0.0, 3.0, 0.0)))
    flight.fly(6.0)
    assert flight.mode == "offboard" and status(flight) == 4
    assert flight.velocity_ned_m_s[1] == pytest.approx(3.0, abs=0.3)


@pytest.mark.slow
def test_ardupilot_brakes_when_velocity_setpoints_stop() -> None:
    flight = hovering("ardupilot")
    guided_north(flight, 3.0)
    flight.fly(6.0)
    flight.stop_repeating()
    flight.fly(2.8)
    assert flight.speed_m_s == pytest.approx(3.0, abs=0.3)  # GUID_TIMEOUT: 3 s at the old speed
    flight.fly(2.5)
    assert flight.speed_m_s < 0.3
    assert flight.mode == "guided" and status(flight) == 4
    guided_north(flight, -2.0)
    flight.fly(4.0)
    assert flight.velocity_ned_m_s[0] == pytest.approx(-2.0, abs=0.3)


def test_ground_station_lost_px4() -> None:
    flight = hovering("px4", NAV_DLL_ACT=2)
    flight.heartbeat = False
    lost_s = flight.time_s
    flight.fly(12.0)
    assert 8.9 < flight.text_time("Failsafe activated", lost_s) - lost_s < 11.6
    assert flight.mode == "hold"  # COM_FAIL_ACT_T, so that a person can step in
    flight.fly(6.0)
    assert flight.mode == "return" and status(flight) == CRITICAL
    flight.heartbeat = True
    flight.fly(3.0)
    assert flight.mode == "return"


@pytest.mark.slow
def test_ground_station_lost_ardupilot() -> None:
    flight = hovering("ardupilot", FS_GCS_ENABLE=1)
    flight.heartbeat = False
    lost_s = flight.time_s
    flight.fly(7.0)
    assert 4.0 < flight.text_time("GCS Failsafe", lost_s) - lost_s < 5.3
    assert flight.mode == "return" and status(flight) == CRITICAL
    flight.heartbeat = True
    flight.fly(2.0)
    assert flight.text_time("GCS Failsafe Cleared", lost_s) < math.inf
    assert flight.mode == "return" and status(flight) == 4


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_a_silent_ground_station_changes_nothing_by_default(flavour: str) -> None:
    flight = hovering(flavour)
    before = flight.mode
    flight.heartbeat = False
    texts = len(flight.texts)
    flight.fly(20.0)
    assert flight.mode == before and len(flight.texts) == texts


def set_real(flight: Flight, name: str, value: float) -> None:
    """PARAM_SET of a floating-point parameter; both firmwares take what is out of its range, too."""
    flight.send(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, 9))


@pytest.mark.slow
def test_battery_px4_returns_when_critical_and_lands_when_empty() -> None:
    flight = hovering("px4", height_m=6.0, COM_LOW_BAT_ACT=3)
    set_real(flight, "BAT_LOW_THR", 0.995)
    flight.fly(3.0)
    assert flight.text_time("Low battery level, return advised") < math.inf
    assert flight.mode == "hold"
    set_real(flight, "BAT_CRIT_THR", 0.99)
    flight.fly_until(lambda: flight.mode == "return", 20.0, "return on a critical battery")
    assert flight.text_time("Critical battery level, land now") < math.inf
    assert status(flight) == CRITICAL
    set_real(flight, "BAT_EMERGEN_THR", 0.985)
    flight.fly_until(lambda: flight.mode == "land", 20.0, "landing on an empty battery")
    assert flight.text_time("Dangerous battery level, land immediately") < math.inf
    flight.wait_disarmed()


@pytest.mark.slow
def test_battery_ardupilot_returns_when_low_and_lands_when_critical() -> None:
    flight = hovering("ardupilot", height_m=6.0, BATT_FS_LOW_ACT=2, BATT_FS_CRT_ACT=1)
    set_real(flight, "BATT_LOW_VOLT", 16.0)
    low_s = flight.time_s
    flight.fly_until(lambda: flight.mode == "return", 14.0, "return on a low battery")
    assert flight.time_s - low_s > 9.5  # BATT_LOW_TIMER
    assert flight.text_time("Battery 1 is low") < math.inf
    set_real(flight, "BATT_CRT_VOLT", 16.0)
    flight.fly_until(lambda: flight.mode == "land", 14.0, "landing on a critical battery")
    assert flight.text_time("Battery 1 is critical") < math.inf
    flight.wait_disarmed()


FENCES = {
    "px4": {"GF_MAX_HOR_DIST": 30.0, "GF_ACTION": 3},
    "ardupilot": {"FENCE_RADIUS": 30.0, "FENCE_TYPE": 2, "FENCE_ACTION": 1, "FENCE_ENABLE": 1},
}


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
def test_the_fence_turns_the_vehicle_back(flavour: str) -> None:
    flight = hovering(flavour, **FENCES[flavour])
    guided_north(flight, 4.0)
    farthest = 0.0

    def look() -> None:
        nonlocal farthest
        farthest = max(farthest, math.hypot(*flight.position_ned_m[:2]))

    flight.fly(14.0, look)
    assert 29.0 < farthest < 37.0
    assert flight.mode == "return"
    text = "Failsafe activated" if flavour == "px4" else "Circle fence breached"
    assert flight.text_time(text) < math.inf
    flight.fly(20.0)
    assert math.hypot(*flight.position_ned_m[:2]) < 15.0


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.parametrize("failure", slow_after(1, [OFF, STUCK, GARBAGE]))
@pytest.mark.sampled(1)
def test_without_gps_the_vehicle_lands(flavour: str, failure: int) -> None:
    flight = hovering(flavour)
    lost_s = flight.time_s
    flight.inject(GPS, failure)
    flight.fly(12.0)
    assert flight.mode == "land" and status(flight) == CRITICAL
    if flavour == "px4":
        assert 4.0 < flight.text_time("Failsafe activated", lost_s) - lost_s < 8.0
    else:
        assert 7.0 < flight.text_time("EKF Failsafe: changed to LAND Mode", lost_s) - lost_s < 10.5
    assert flight.tilt_deg < 15.0
    flight.wait_disarmed(60.0)
    assert flight.tilt_deg < 3.0
    assert math.hypot(*flight.position_ned_m[:2]) < 30.0
    assert flight.actuators_finite


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_without_gps_at_cruise_the_vehicle_sinks_level_and_disarms(flavour: str) -> None:
    flight = hovering(flavour, height_m=20.0)
    guided_north(flight, 8.0)
    flight.fly(6.0)
    assert flight.speed_m_s > 7.0
    flight.inject(GPS, OFF)
    flight.fly_until(lambda: flight.mode == "land", 12.0, "landing")
    flight.fly(2.0)
    assert flight.tilt_deg < 2.0
    flight.fly_until(lambda: flight.height_m < 1.0, 50.0, "the ground")
    assert flight.tilt_deg < 2.0
    # EK3_ABIAS_P_NSE lets the accelerometer's bias walk seven times as fast as EKF2_ACC_B_NOISE does, so the
    # tilt is known less exactly: a tenth of a degree over 20 s is 0.3 m/s.
    assert flight.speed_m_s < {"px4": 1.2, "ardupilot": 1.6}[flavour]
    flight.wait_disarmed(12.0)
    assert flight.tilt_deg < 3.0 and flight.speed_m_s < 0.05


@pytest.mark.slow
def test_gps_recovered_px4_goes_back_to_what_it_did_ardupilot_does_not() -> None:
    for flavour, then in (("px4", "hold"), ("ardupilot", "land")):
        flight = hovering(flavour, height_m=25.0)
        flight.inject(GPS, OFF)
        flight.fly(10.0)
        assert flight.mode == "land"
        flight.inject(GPS, OK)
        back_s = flight.time_s
        flight.fly(5.0)
        assert flight.mode == then and status(flight) == 4
        if flavour == "ardupilot":
            assert flight.text_time("EKF Failsafe Cleared", back_s) < math.inf
        else:
            flight.fly(5.0)
            assert flight.speed_m_s < 0.3


@pytest.mark.parametrize(
    ("unit", "failure"),
    [
        *((GPS, SLOW), (GPS, INTERMITTENT), (MAG, OFF), (MAG, GARBAGE), (BARO, STUCK), (BARO, INTERMITTENT)),
        *(slow(GPS, DELAYED), slow(ACCEL, SLOW), slow(GYRO, SLOW)),
        *(slow(MAG, STUCK), slow(MAG, INTERMITTENT), slow(BARO, OFF), slow(BARO, GARBAGE)),
    ],
)
@pytest.mark.sampled(2)
@pytest.mark.slow
def test_the_vehicle_holds_its_place_with_a_poor_sensor(unit: int, failure: int) -> None:
    flight = hovering("px4", height_m=6.0)
    place = np.array(flight.position_ned_m)
    flight.inject(unit, failure)
    farthest = 0.0

    def look() -> None:
        nonlocal farthest
        farthest = max(farthest, float(np.linalg.norm(flight.position_ned_m - place)))

    flight.fly(12.0, look)
    assert flight.armed and flight.mode == "hold"
    assert farthest < 1.5
    assert flight.actuators_finite


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.parametrize("unit", [GYRO, ACCEL])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_a_broken_inertial_sensor_breaks_no_software(flavour: str, unit: int) -> None:
    """There is one of each: the vehicle may crash, but numbers stay numbers and it goes on talking."""
    flight = hovering(flavour, height_m=6.0)
    for failure in (STUCK, GARBAGE, OFF):
        flight.inject(unit, failure)
        flight.fly(6.0)
        flight.inject(unit, OK)
        flight.fly(4.0)
    assert flight.actuators_finite
    assert flight.time_s - flight.heartbeats[-1][0] < 1.2
    assert np.isfinite(flight.truth).all()


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_a_weak_motor_is_carried_and_a_dead_one_breaks_no_software(flavour: str) -> None:
    flight = hovering(flavour, height_m=8.0)
    flight.vehicle.vehicle.set_motor_effectiveness(1, 0.75)
    flight.fly(6.0)
    assert flight.height_m == pytest.approx(8.0, abs=1.0)
    assert flight.tilt_deg < 6.0
    flight.vehicle.vehicle.set_motor_effectiveness(1, 0.0)
    flight.fly(8.0)
    assert flight.height_m < 1.0
    assert flight.actuators_finite
    assert flight.time_s - flight.heartbeats[-1][0] < 1.2


@pytest.mark.slow
def test_a_crashed_arducopter_is_disarmed() -> None:
    flight = hovering("ardupilot", height_m=8.0)
    flight.vehicle.vehicle.set_motor_effectiveness(3, 0.0)  # it tumbles, and comes to rest on its back
    flight.wait_disarmed(15.0)
    assert flight.height_m < 1.0 and flight.tilt_deg > 90.0
    assert flight.text_time("Crash: Disarming: AngErr=") < math.inf
