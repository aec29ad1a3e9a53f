"""Faults of aircraft as a ground station sees them: sensor bits, filter flags, texts, answers to commands.

How the aircraft fly on is tested in `tests/flights/test_fixed_wing_failsafes.py`.
"""

import math

import pytest

from autopilot_bridge.mavlink import dialect
from tests.flights.aircraft import AircraftFlight

FLAVOURS = ("px4", "ardupilot")
OK, OFF, STUCK = dialect.FAILURE_TYPE_OK, dialect.FAILURE_TYPE_OFF, dialect.FAILURE_TYPE_STUCK
GPS, AIRSPEED = dialect.FAILURE_UNIT_SENSOR_GPS, dialect.FAILURE_UNIT_SENSOR_AIRSPEED
MOTOR, SERVO = dialect.FAILURE_UNIT_SYSTEM_MOTOR, dialect.FAILURE_UNIT_SYSTEM_SERVO
GPS_BIT = dialect.MAV_SYS_STATUS_SENSOR_GPS
AIRSPEED_BIT = dialect.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE
INJECT, INTERVAL = dialect.MAV_CMD_INJECT_FAILURE, dialect.MAV_CMD_SET_MESSAGE_INTERVAL
UNSUPPORTED = 3

TEXTS = {
    "px4": ("Airspeed sensor failure detected. Return to launch (RTL) is advised", None),
    "ardupilot": ("Airspeed sensor 1 failure. Disabling", "Airspeed sensor 1 now OK. Re-enabled"),
}
"""Of an airspeed sensor lost and found again; PX4 uses one again only where ASPD_FS_T_START allows it."""

FILTER = {"px4": "ESTIMATOR_STATUS", "ardupilot": "EKF_STATUS_REPORT"}
NOT_ARMED = {
    (AIRSPEED, "px4"): "Airspeed data missing or unhealthy",
    (AIRSPEED, "ardupilot"): "Airspeed 1 not healthy",
    (GPS, "px4"): "GNSS data fusion stopped or no 3D fix",
    (GPS, "ardupilot"): "GPS 1: Bad fix",
}


def circling(flavour: str, **parameters: float) -> AircraftFlight:
    flight = AircraftFlight(flavour, seed=3, parameters=parameters)
    flight.take_off(60.0)
    for name in ("ESTIMATOR_STATUS", "EKF_STATUS_REPORT"):
        flight.command(INTERVAL, getattr(dialect, f"MAVLINK_MSG_ID_{name}"), 200_000)
    flight.fly(2.0)
    return flight


def healthy(flight: AircraftFlight, bit: int) -> bool:
    return bool(flight.newest["SYS_STATUS"].onboard_control_sensors_health & bit)


@pytest.mark.parametrize("failure", [OFF, STUCK])
@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_airspeed_lost_is_reported(flavour: str, failure: int) -> None:
    flight = circling(flavour)
    lost_text, found_text = TEXTS[flavour]
    assert healthy(flight, AIRSPEED_BIT)
    flight.inject(AIRSPEED, failure)
    lost_s = flight.time_s
    flight.fly(15.0)
    assert flight.text_time(lost_text, lost_s) < lost_s + 10.0
    assert not healthy(flight, AIRSPEED_BIT)
    flight.inject(AIRSPEED, OK)
    found_s = flight.time_s
    flight.fly(30.0)
    assert healthy(flight, AIRSPEED_BIT) is (found_text is not None)
    if found_text is not None:
        assert flight.text_time(found_text, found_s) < math.inf
    assert sum(lost_text in text for _, text in flight.texts) == 1


@pytest.mark.slow
def test_px4_uses_an_airspeed_sensor_again_where_it_may() -> None:
    flight = circling("px4", ASPD_FS_T_START=5.0)
    flight.inject(AIRSPEED, OFF)
    flight.fly(10.0)
    flight.inject(AIRSPEED, OK)
    found_s = flight.time_s
    flight.fly(20.0)
    assert flight.text_time("Airspeed sensor healthy, start using again", found_s) >= found_s + 4.0
    assert healthy(flight, AIRSPEED_BIT)


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_gps_lost_is_reported(flavour: str) -> None:
    """Dead reckoning on airspeed: PX4 tells how well the position is still known, ArduPilot no longer calls
    it absolute.
    """
    flight = circling(flavour)
    name = FILTER[flavour]
    absolute = dialect.ESTIMATOR_POS_HORIZ_ABS
    assert healthy(flight, GPS_BIT) and flight.newest[name].flags & absolute
    before = flight.newest[name]
    flight.inject(GPS, OFF)
    flight.fly(30.0)
    assert not healthy(flight, GPS_BIT)
    flags = flight.newest[name].flags
    assert flags & dialect.ESTIMATOR_ATTITUDE
    assert flags & dialect.ESTIMATOR_POS_HORIZ_REL
    if flavour == "px4":
        assert flags & absolute
        assert flight.newest[name].pos_horiz_accuracy > 1.5 * before.pos_horiz_accuracy
    else:
        assert not flags & absolute
    assert flight.newest["GPS_RAW_INT"].fix_type <= 1
    flight.inject(GPS, OK)
    flight.fly(20.0)
    assert healthy(flight, GPS_BIT) and flight.newest[name].flags & absolute


@pytest.mark.parametrize("unit", [GPS, AIRSPEED])
@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(2)
def test_no_take_off_without(flavour: str, unit: int) -> None:
    flight = AircraftFlight(flavour, seed=3)
    flight.get_ready()
    flight.inject(unit, OFF)
    flight.fly(15.0)
    assert flight.result(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1) not in (0, None)
    flight.fly(1.0)
    assert not flight.armed
    assert any(NOT_ARMED[unit, flavour] in text for _, text in flight.texts), flight.texts


def test_failures_that_an_aircraft_can_not_have() -> None:
    flight = AircraftFlight("px4", seed=3)
    flight.get_ready()
    for unit, failure, instance in ((99, OFF, 0), (MOTOR, OFF, 5), (MOTOR, STUCK, 1), (SERVO, OFF, 9)):
        assert flight.result(INJECT, unit, failure, instance) == UNSUPPORTED
    for absurd in (math.nan, math.inf, -1.0, 1e30):
        assert flight.result(INJECT, absurd, OFF, 0) not in (0, None)
        assert flight.result(INJECT, GPS, absurd, 0) not in (0, None)
    assert flight.vehicle.vehicle.motor_effectiveness(0) == 1.0


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_an_aileron_that_sticks(flavour: str) -> None:
    """Where it was in the circle: held against by the other controls, the aircraft flies on."""
    flight = circling(flavour)
    flight.inject(SERVO, STUCK)
    heights: list[float] = []
    flight.fly(5.0, lambda: heights.append(flight.height_over_home_m))
    flight.inject(SERVO, OK)
    flight.fly(40.0)
    assert min(heights) > 30.0
    assert flight.actuators_finite
    assert flight.height_over_home_m == pytest.approx(60.0, abs=8.0)
