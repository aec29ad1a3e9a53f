"""GPS_INPUT and HIL_GPS, field by field, as the navigation filter receives them (GPS1_TYPE 14)."""

import math
from typing import Any

import pytest

from autopilot_bridge.firmware.ardupilot.gps_input import GpsInputService
from autopilot_bridge.mavlink import dialect
from flightsim import interface as i
from tests.services.command_rig import ServiceRig
from tests.services.dispatch import deliver
from tests.services.parts_rig import parts_of

NOW_US = 60_000_000
WEEK, WEEK_MS = 2300, 604_800_000


class Receiver:
    """The service and the reading that it writes."""

    def __init__(self, **parameters: float) -> None:
        rig = ServiceRig("ardupilot", **{"GPS1_TYPE": 14, **parameters})
        self.source = rig.source
        self.reading = rig.readings.gps
        self.reading.time_us = -1
        self.reading.values[:] = math.nan
        self.service = GpsInputService(parts_of(rig))

    def take(self, message: Any, time_us: int = NOW_US) -> Any:
        """Deliver; the values of the reading."""
        deliver(message, self.source, time_us, self.service)
        return self.reading.values


def gps_input(ignore: int = 0, **fields: Any) -> Any:
    values: dict[str, Any] = {
        "time_usec": 0,
        "gps_id": 0,
        "ignore_flags": ignore,
        "time_week_ms": 0,
        "time_week": 0,
        "fix_type": 4,
        "lat": 473977400,
        "lon": -85455900,
        "alt": 489.5,
        "hdop": 0.75,
        "vdop": 1.25,
        "vn": 1.5,
        "ve": -2.5,
        "vd": 0.5,
        "speed_accuracy": 0.125,
        "horiz_accuracy": 0.875,
        "vert_accuracy": 1.75,
        "satellites_visible": 13,
    }
    return dialect.MAVLink_gps_input_message(**{**values, **fields})


def hil_gps(**fields: Any) -> Any:
    values: dict[str, Any] = {
        "time_usec": 0,
        "fix_type": 3,
        "lat": 473977400,
        "lon": -85455900,
        "alt": 489500,
        "eph": 120,
        "epv": 180,
        "vel": 0,
        "vn": 150,
        "ve": -250,
        "vd": 50,
        "cog": 0,
        "satellites_visible": 13,
    }
    return dialect.MAVLink_hil_gps_message(**{**values, **fields})


def test_gps_input_has_floats_in_si_units() -> None:
    values = Receiver().take(gps_input())
    assert values[[i.GPS_LAT_DEG, i.GPS_LON_DEG, i.GPS_ALT_M]] == pytest.approx((47.39774, -8.54559, 489.5))
    assert values[i.GPS_VEL_NED_M_S] == pytest.approx((1.5, -2.5, 0.5))
    assert values[[i.GPS_EPH_M, i.GPS_EPV_M, i.GPS_SPEED_ACCURACY_M_S]] == pytest.approx((0.875, 1.75, 0.125))
    assert values[[i.GPS_FIX_TYPE, i.GPS_SATELLITES]] == pytest.approx((4.0, 13.0))
    assert values[[i.GPS_HDOP, i.GPS_VDOP]] == pytest.approx((0.75, 1.25))


def test_hil_gps_has_integers_and_no_accuracies() -> None:
    """The accuracies are 1 m for each unit of dilution of precision, and 0.3 m/s."""
    values = Receiver().take(hil_gps())
    assert values[[i.GPS_LAT_DEG, i.GPS_LON_DEG, i.GPS_ALT_M]] == pytest.approx((47.39774, -8.54559, 489.5))
    assert values[i.GPS_VEL_NED_M_S] == pytest.approx((1.5, -2.5, 0.5))
    assert values[[i.GPS_EPH_M, i.GPS_EPV_M, i.GPS_SPEED_ACCURACY_M_S]] == pytest.approx((1.2, 1.8, 0.3))
    assert values[[i.GPS_FIX_TYPE, i.GPS_SATELLITES]] == pytest.approx((3.0, 13.0))
    assert values[[i.GPS_HDOP, i.GPS_VDOP]] == pytest.approx((1.2, 1.8))


@pytest.mark.parametrize(
    ("flag", "changed"),
    [
        (dialect.GPS_INPUT_IGNORE_FLAG_ALT, {i.GPS_ALT_M: 0.0}),
        (dialect.GPS_INPUT_IGNORE_FLAG_HDOP, {i.GPS_HDOP: 99.99}),
        (dialect.GPS_INPUT_IGNORE_FLAG_VDOP, {i.GPS_VDOP: 99.99}),
        (dialect.GPS_INPUT_IGNORE_FLAG_VEL_HORIZ, {3: math.nan, 4: math.nan, 5: math.nan}),
        (dialect.GPS_INPUT_IGNORE_FLAG_VEL_VERT, {5: math.nan}),
        (dialect.GPS_INPUT_IGNORE_FLAG_SPEED_ACCURACY, {i.GPS_SPEED_ACCURACY_M_S: 0.3}),
        (dialect.GPS_INPUT_IGNORE_FLAG_HORIZONTAL_ACCURACY, {i.GPS_EPH_M: 0.75}),
        (dialect.GPS_INPUT_IGNORE_FLAG_VERTICAL_ACCURACY, {i.GPS_EPV_M: 1.25}),
    ],
)
def test_an_ignored_field_is_unknown_and_changes_no_other(flag: int, changed: dict[int, float]) -> None:
    wanted = Receiver().take(gps_input()).copy()
    for slot, value in changed.items():
        wanted[slot] = value
    assert Receiver().take(gps_input(flag)) == pytest.approx(wanted, nan_ok=True)


def test_unknown_accuracies_and_satellites() -> None:
    """Without dilutions of precision the accuracy is 99 m; 255 satellites mean an unknown number."""
    values = Receiver().take(gps_input(hdop=0.0, vdop=0.0, horiz_accuracy=0.0, vert_accuracy=0.0))
    assert values[[i.GPS_HDOP, i.GPS_VDOP, i.GPS_EPH_M, i.GPS_EPV_M]] == pytest.approx((99.99, 99.99, 99, 99))
    values = Receiver().take(gps_input(hdop=200.0, vdop=200.0, speed_accuracy=200.0, satellites_visible=255))
    assert values[[i.GPS_HDOP, i.GPS_VDOP, i.GPS_SPEED_ACCURACY_M_S]] == pytest.approx((99.99, 99.99, 99))
    assert values[i.GPS_SATELLITES] == 0.0
    assert Receiver().take(gps_input(satellites_visible=254))[i.GPS_SATELLITES] == 254.0


@pytest.mark.parametrize(
    ("message", "valid"),
    [
        (gps_input(fix_type=8), True),
        (gps_input(fix_type=9), False),
        (gps_input(alt=99_999.0), True),
        (gps_input(alt=100_000.0), False),
        (gps_input(alt=-100_000.0), False),
        (gps_input(alt=math.nan), False),
        (gps_input(vn=399.0, ve=-399.0, vd=399.0), True),
        (gps_input(vn=400.0), False),
        (gps_input(ve=-400.0), False),
        (gps_input(vd=math.nan), False),
        (gps_input(dialect.GPS_INPUT_IGNORE_FLAG_VEL_VERT, vd=400.0), True),
        (gps_input(dialect.GPS_INPUT_IGNORE_FLAG_VEL_VERT, ve=400.0), False),
        (gps_input(dialect.GPS_INPUT_IGNORE_FLAG_VEL_HORIZ, vn=400.0, ve=400.0, vd=400.0), True),
        (gps_input(dialect.GPS_INPUT_IGNORE_FLAG_ALT, alt=1e9), True),
        (hil_gps(alt=99_999_000), True),
        (hil_gps(alt=100_000_000), False),
    ],
)
def test_a_message_with_an_invalid_value_is_refused_as_a_whole(message: Any, valid: bool) -> None:
    receiver = Receiver()
    receiver.take(message)
    assert (receiver.service.taken, receiver.service.refused) == ((1, 0) if valid else (0, 1))


@pytest.mark.parametrize(("parameter_ms", "delay_ms"), [(0, 200), (1, 1), (120, 120), (250, 250)])
def test_the_time_of_measurement_is_the_delay_before_the_arrival(parameter_ms: int, delay_ms: int) -> None:
    receiver = Receiver(GPS1_DELAY_MS=parameter_ms)
    receiver.take(gps_input())
    assert receiver.reading.time_us == NOW_US - 1000 * delay_ms


def stamped(at_ms: int, **fields: Any) -> Any:
    """A fix sent `at_ms` after 50 ms before the end of a GPS week."""
    since_ms = WEEK_MS - 50 + at_ms
    return gps_input(time_week=WEEK + since_ms // WEEK_MS, time_week_ms=since_ms % WEEK_MS, **fields)


def test_gps_time_removes_the_variation_of_the_transport_delay() -> None:
    """The shortest delay counts; the assumed one grows by 20 us with each message, because clocks drift."""
    receiver, sent_us = Receiver(), NOW_US - 200_000
    for k, (late_us, wanted_us) in enumerate(((0, 0), (50_000, 20), (30, 30), (90_000, 50), (10, 10))):
        receiver.take(stamped(100 * k), NOW_US + 100_000 * k + late_us)
        assert receiver.reading.time_us == sent_us + 100_000 * k + wanted_us


@pytest.mark.parametrize(
    ("late_us", "wanted_us"), [(499_999, 20), (500_000, 500_000), (-499_999, -499_999), (-500_000, -500_000)]
)
def test_a_step_of_half_a_second_is_another_clock(late_us: int, wanted_us: int) -> None:
    receiver = Receiver()
    receiver.take(stamped(0))
    receiver.take(stamped(1000), NOW_US + 1_000_000 + late_us)
    assert receiver.reading.time_us == NOW_US + 800_000 + wanted_us
    receiver.take(stamped(3000), NOW_US + 3_000_000 + late_us)
    assert receiver.reading.time_us - (NOW_US + 2_800_000) == pytest.approx(min(wanted_us + 20, late_us))


@pytest.mark.parametrize(("fields", "by_stamp"), [({"fix_type": 3}, True), ({"fix_type": 2}, False)])
def test_only_a_3d_fix_has_the_time(fields: dict[str, int], by_stamp: bool) -> None:
    receiver = Receiver()
    receiver.take(stamped(0))
    receiver.take(stamped(100, **fields), NOW_US + 150_000)
    assert receiver.reading.time_us == NOW_US - 200_000 + (100_020 if by_stamp else 150_000)


def test_a_second_receiver_and_a_repeated_fix_are_not_used() -> None:
    receiver = Receiver()
    receiver.take(gps_input(gps_id=1))
    assert (receiver.service.taken, receiver.service.refused, receiver.reading.time_us) == (0, 0, -1)
    receiver.take(gps_input())
    receiver.take(gps_input(vn=9.0))
    assert receiver.service.taken == 1 and receiver.reading.values[3] == 1.5


def test_messages_are_not_used_beside_a_receiver_on_board() -> None:
    receiver = Receiver(GPS1_TYPE=1)
    receiver.take(gps_input())
    assert receiver.service.taken == 0 and receiver.reading.time_us == -1
