"""A receiver on another computer: fixes by GPS_INPUT and HIL_GPS, on the whole stack."""

import math
from collections import deque
from typing import Any

import numpy as np
import pytest

from autopilot_bridge.firmware.ardupilot.gps_input import GpsInputService
from autopilot_bridge.mavlink import dialect
from flightsim import truth as t
from tests.flights.flight import FLAVOURS, SYSTEM_ID, Flight

GPS, OFF = 4, 1
RATE_HZ = 5.0
ALT, HDOP, VDOP, HORIZONTAL, VERTICAL, SPEED, EPH, EPV = (1 << bit for bit in (0, 1, 2, 3, 4, 5, 6, 7))
DELAYED = 1  # of fixes at 5 Hz: 0.2 s, as ArduPilot takes these to be
MAV = {"GPS1_TYPE": 14.0}


class Receiver:
    """Sees the vehicle as a usual receiver does, and tells it what it saw a fix ago."""

    def __init__(self, flight: Flight, **changed: Any) -> None:
        self.flight = flight
        self.changed = changed
        self._rng = np.random.Generator(np.random.PCG64(7))
        self._seen: deque[dict[str, Any]] = deque(maxlen=DELAYED + 1)

    def fix(self) -> dict[str, Any]:
        truth, noise = self.flight.truth, self._rng.normal(0.0, 1.0, 6)
        lat, lon = float(truth[t.LAT_RAD]), float(truth[t.LON_RAD])
        north, east, down = truth[t.VEL_NED_M_S] + 0.1 * noise[3:]
        return {
            "time_usec": 0,
            "gps_id": 0,
            "ignore_flags": 0,
            "time_week_ms": 0,
            "time_week": 0,
            "fix_type": 4,
            "lat": round(math.degrees(lat + 0.2 * noise[0] / 6.371e6) * 1e7),
            "lon": round(math.degrees(lon + 0.2 * noise[1] / 6.371e6 / math.cos(lat)) * 1e7),
            "alt": float(truth[t.ALT_M]) + 0.4 * noise[2],
            "hdop": 0.8,
            "vdop": 1.2,
            "vn": north,
            "ve": east,
            "vd": down,
            "speed_accuracy": 0.2,
            "horiz_accuracy": 0.4,
            "vert_accuracy": 0.8,
            "satellites_visible": 13,
        }

    def gps_input(self, time_s: float) -> Any:
        """GPS_INPUT."""
        self._seen.append(self.fix())
        return dialect.MAVLink_gps_input_message(**{**self._seen[0], **self.changed})

    def hil_gps(self, time_s: float) -> Any:
        """HIL_GPS."""
        self._seen.append(self.fix())
        seen = self._seen[0]
        speeds = [round(100.0 * seen[name]) for name in ("vn", "ve", "vd")]
        return dialect.MAVLink_hil_gps_message(  # type: ignore[call-arg]
            0, 3, seen["lat"], seen["lon"], round(1e3 * seen["alt"]), 80, 120, 0, *speeds, 65535, 13
        )


def copter(**parameters: float) -> Flight:
    flight = Flight("ardupilot", parameters=parameters)
    show_fixes(flight)
    return flight


def show_fixes(flight: Flight) -> None:
    flight.fly(0.1)
    flight.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, dialect.MAVLINK_MSG_ID_GPS_RAW_INT, 200_000)


def service(flight: Flight) -> GpsInputService:
    return next(more for more in flight.vehicle.autopilot._services if isinstance(more, GpsInputService))


def hovers(flight: Flight) -> None:
    flight.get_ready()
    flight.take_off(8.0)
    flight.send(flight.position_setpoint((6.0, -4.0, -8.0)))
    flight.fly(12.0)
    away: list[float] = []
    flight.fly(8.0, lambda: away.append(math.dist(flight.position_ned_m, (6.0, -4.0, -8.0))))
    assert max(away) < 1.5


@pytest.mark.parametrize("message", ["gps_input", "hil_gps"])
@pytest.mark.slow
def test_a_copter_flies_by_fixes_that_come_by_messages_until_they_stop(message: str) -> None:
    flight = copter(**MAV)
    flight.inject(GPS, OFF)  # whatever the one on board does
    flight.fly(20.0)
    none = flight.newest["GPS_RAW_INT"]
    assert (none.fix_type, none.eph, none.satellites_visible) == (0, 65535, 0)
    flight.repeat(RATE_HZ, getattr(Receiver(flight), message))
    hovers(flight)
    shown = flight.newest["GPS_RAW_INT"]
    assert (shown.fix_type, shown.satellites_visible, shown.eph) == (
        4 if message == "gps_input" else 3,
        13,
        80,
    )
    flight.stop_repeating()
    before = flight.time_s
    flight.fly_until(
        lambda: flight.text_time("EKF Failsafe: changed to LAND Mode", before) < math.inf, 15.0, "failsafe"
    )
    assert flight.newest["GPS_RAW_INT"].fix_type == 0
    flight.wait_disarmed(40.0)


@pytest.mark.slow
def test_a_script_may_say_the_same_place_again_and_again() -> None:
    """As many do, on the ground, with whole seconds of GPS time."""
    flight = Flight("ardupilot", parameters=MAV)
    receiver = Receiver(flight, vn=0.0, ve=0.0, vd=0.0)
    place = {name: receiver.fix()[name] for name in ("lat", "lon", "alt")}
    receiver.changed |= place
    flight.repeat(RATE_HZ, receiver.gps_input)
    flight.get_ready()
    flight.fly(5.0)
    position = flight.newest["GLOBAL_POSITION_INT"]
    assert (position.lat, position.lon) == pytest.approx((place["lat"], place["lon"]), abs=10)


@pytest.mark.parametrize("ignored", [VERTICAL, HORIZONTAL | VERTICAL, ALT, EPH | EPV | SPEED])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_what_a_sender_does_not_know(ignored: int) -> None:
    flight = copter(**MAV)
    wild = {name: math.nan for name in ("horiz_accuracy", "vert_accuracy", "speed_accuracy")}
    if ignored & HORIZONTAL:
        wild |= {"vn": 50.0, "ve": -50.0}
    if ignored & VERTICAL:
        wild["vd"] = 50.0
    flight.repeat(
        RATE_HZ,
        Receiver(
            flight, ignore_flags=ignored, **(wild if not ignored & ALT else {"alt": math.inf})
        ).gps_input,
    )
    if ignored & ALT:  # as the firmware has it: the fix is at sea level, and heights are the barometer's
        flight.get_ready()
        assert abs(flight.newest["GPS_RAW_INT"].alt) < 1
        return
    hovers(flight)
    shown = flight.newest["GPS_RAW_INT"]
    assert shown.h_acc == 800  # what its dilution of precision stands for
    assert (shown.vel == 65535) is bool(ignored & HORIZONTAL)


@pytest.mark.parametrize(
    "changed",
    [
        {"fix_type": 200},
        {"alt": math.nan},
        {"alt": 1e30},
        {"vn": math.inf},
        {"gps_id": 1},
        {"ignore_flags": HDOP},
        {"fix_type": 2},
        {"satellites_visible": 255},
        {"horiz_accuracy": 80.0},
    ],
)
@pytest.mark.sampled(1)
def test_fixes_that_are_none(changed: dict[str, Any]) -> None:
    """Refused, or shown and not used; the vehicle has no position."""
    flight = Flight("ardupilot", parameters=MAV)
    flight.repeat(RATE_HZ, Receiver(flight, **changed).gps_input)
    flight.fly(25.0)
    assert flight.vehicle.autopilot.navigation.origin is None
    refused = service(flight).refused
    assert (refused > 100) is (set(changed) <= {"fix_type", "alt", "vn"} and changed.get("fix_type") != 2)


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_no_service_listens_by_default(flavour: str) -> None:
    flight = Flight(flavour)
    show_fixes(flight)
    flight.repeat(RATE_HZ, Receiver(flight, lat=0, lon=0, satellites_visible=3).gps_input)
    flight.get_ready()
    assert flight.newest["GPS_RAW_INT"].satellites_visible == 10
    if flavour == "px4":  # has no service for it
        assert dialect.MAVLINK_MSG_ID_GPS_INPUT not in flight.vehicle.autopilot._receivers
    else:
        assert service(flight).taken == 0


@pytest.mark.slow
def test_the_parameter_counts_from_the_next_boot_on() -> None:
    flight = copter()
    flight.get_ready()
    flight.send(dialect.MAVLink_param_set_message(SYSTEM_ID, 1, b"GPS1_TYPE", 14.0, 2))
    flight.fly(3.0)
    assert flight.newest["GPS_RAW_INT"].satellites_visible == 10
    flight.command(dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1)
    flight.fly(3.0)
    show_fixes(flight)
    flight.fly(17.0)
    assert flight.newest["GPS_RAW_INT"].fix_type == 0
    flight.repeat(RATE_HZ, Receiver(flight).gps_input)
    flight.get_ready()


def test_gps_time_takes_out_what_the_way_differs() -> None:
    """Fixes that are late by up to 0.3 s, now more, now less, are placed where they were measured."""
    flight = Flight("ardupilot", parameters={**MAV, "GPS1_DELAY_MS": 50.0})
    flight.fly(1.0)
    taker, receiver = service(flight), Receiver(flight)
    errors: list[int] = []
    rng = np.random.Generator(np.random.PCG64(3))
    for _ in range(40):
        sent_us = flight.sitl.time_us
        fix = receiver.fix() | {"time_week": 2300, "time_week_ms": 345_600_000 + sent_us // 1000}
        flight.fly(0.02 + 0.04 * float(rng.integers(0, 8)))
        flight.send(dialect.MAVLink_gps_input_message(**fix))
        flight.fly(0.02)
        errors.append(flight.vehicle.autopilot._readings.gps.time_us - (sent_us - 50_000))
    late_us = errors[20:]
    assert taker.taken == 40
    assert max(late_us) - min(late_us) < 3_000


def test_whatever_is_sent_the_vehicle_goes_on() -> None:
    """Extreme values of every field, in any mixture: nothing raises, and what is reported can be packed."""
    flight = copter(**MAV)
    rng = np.random.Generator(np.random.PCG64(11))
    floats = (math.nan, math.inf, -math.inf, 3.4e38, -3.4e38, 1e-40, 0.0, 1e5 - 1.0, 399.0, -399.0, 65535.0)
    whole = {
        "lat": 31,
        "lon": 31,
        "ignore_flags": 16,
        "time_week": 16,
        "time_week_ms": 32,
        "fix_type": 8,
        "satellites_visible": 8,
    }
    receiver = Receiver(flight)
    for _ in range(400):
        fix = receiver.fix()
        for name in fix:
            if name == "gps_id" or rng.random() < 0.6:
                continue
            if name in whole:
                largest = 1 << whole[name]
                fix[name] = int(rng.choice((0, 1, 3, largest - 1, largest // 2)))
            elif name != "time_usec":
                fix[name] = float(rng.choice(floats))
        flight.send(dialect.MAVLink_gps_input_message(**fix))
        flight.fly(0.02)
    assert service(flight).taken > 20 and service(flight).refused > 20
    assert np.isfinite(flight.vehicle.autopilot.navigation.state[:28]).all()
    flight.repeat(RATE_HZ, receiver.gps_input)
    flight.get_ready()
