"""When a sensor counts as healthy: its age, a value that never changes, and the range of its values."""

import math
from typing import Any

import pytest

from autopilot_bridge.commander.health import HealthMonitor
from flightsim import interface as i
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.interface import SensorReadings
from tests.commander.rig import Judgement

NOW_US = 10_000_000
STALE_US = {
    "imu": 100_000,
    "barometer": 500_000,
    "magnetometer": 500_000,
    "gps": 1_000_000,
    "battery": 3_000_000,
    "airspeed": 1_000_000,
    "rangefinder": 500_000,
}
FLAGS = {"imu": ("gyro", "accelerometer")}


def fill(readings: SensorReadings, change: float = 0.0) -> None:
    """Plausible values; `change` makes them new ones."""
    imu = readings.imu.values
    imu[i.IMU_GYRO_FRD_RAD_S], imu[i.IMU_ACCEL_FRD_M_S2] = change, -9.81
    readings.barometer.values[:] = (95_000.0 + change, 15.0)
    readings.magnetometer.values[:] = (0.2 + change, 0.0, 0.4)
    readings.airspeed.values[:] = (200.0 + change, 15.0)
    readings.battery.values[:] = (16.0, 1.0 + change, 0.25, 0.75)
    readings.rangefinder.values[:] = 1.0 + change
    gps = readings.gps.values
    gps[:] = 0.0
    gps[i.GPS_LAT_DEG] = 47.0 + change
    gps[i.GPS_LON_DEG], gps[i.GPS_ALT_M] = 8.0, 500.0
    gps[i.GPS_FIX_TYPE], gps[i.GPS_SATELLITES], gps[i.GPS_EPH_M] = 3.0, 6.0, 5.0


def stamp(readings: SensorReadings, time_us: int) -> None:
    for name in STALE_US:
        getattr(readings, name).time_us = time_us


class Watched:
    """Sensors that are all well, and the monitor of them."""

    def __init__(self, **arguments: Any) -> None:
        self.readings, self.judgement = SensorReadings(), Judgement()
        self.monitor = HealthMonitor(self.readings, self.judgement, airspeed=True, **arguments)
        fill(self.readings)
        stamp(self.readings, NOW_US)

    def flags(self, name: str, time_us: int = NOW_US) -> set[bool]:
        self.monitor.update(time_us)
        return {getattr(self.monitor.health, flag) for flag in FLAGS.get(name, (name,))}


@pytest.mark.parametrize("name", STALE_US)
def test_a_sensor_is_healthy_until_its_newest_sample_is_too_old(name: str) -> None:
    watched = Watched()
    assert watched.flags(name) == {True}
    assert watched.flags(name, NOW_US + STALE_US[name]) == {True}
    assert watched.flags(name, NOW_US + STALE_US[name] + 1) == {False}
    getattr(watched.readings, name).time_us = -1  # never received
    assert watched.flags(name, 0) == {False}


@pytest.mark.parametrize("name", STALE_US)
def test_a_value_that_does_not_change_for_two_seconds_is_frozen(name: str) -> None:
    watched = Watched()
    results = []
    for k in range(21):
        stamp(watched.readings, NOW_US + 100_000 * k)
        results.append(watched.flags(name, NOW_US + 100_000 * k))
    assert results == [{True}] * 20 + [{False}]
    fill(watched.readings, 1e-9 if name == "gps" else 1e-3)
    stamp(watched.readings, NOW_US + 2_100_000)
    assert watched.flags(name, NOW_US + 2_100_000) == {True}


def test_the_same_sample_read_again_is_not_frozen() -> None:
    watched = Watched()
    for _ in range(30):
        assert watched.flags("battery") == {True}


def test_fixes_by_messages_may_repeat() -> None:
    watched = Watched(gps_may_repeat=True)
    for k in range(30):
        stamp(watched.readings, NOW_US + 100_000 * k)
        assert watched.flags("gps", NOW_US + 100_000 * k) == {True}


@pytest.mark.parametrize(
    ("name", "slot", "healthy", "failed"),
    [
        *(("imu", axis, (39.9, -39.9), (40.0, -40.0, math.nan)) for axis in range(3)),
        *(("imu", axis, (249.9, -249.9), (250.0, -250.0, math.nan)) for axis in range(3, 6)),
        ("barometer", i.BARO_PRESSURE_PA, (10_001.0, 119_999.5), (10_000.0, 120_000.0, math.nan)),
        ("airspeed", i.AIRSPEED_DIFFERENTIAL_PRESSURE_PA, (-1999.0, 19_999.0), (-2000.0, 20_000.0, math.nan)),
        ("gps", i.GPS_FIX_TYPE, (3.0, 6.0), (2.0,)),
        ("gps", i.GPS_SATELLITES, (6.0,), (5.0,)),
        ("gps", i.GPS_EPH_M, (5.0,), (5.1, math.nan)),
        ("battery", i.BATTERY_VOLTAGE_V, (0.1,), (0.0, math.nan)),
    ],
)
def test_impossible_values_are_a_failure(
    name: str, slot: int, healthy: tuple[float, ...], failed: tuple[float, ...]
) -> None:
    for value, sound in (*((value, True) for value in healthy), *((value, False) for value in failed)):
        watched = Watched()
        getattr(watched.readings, name).values[slot] = value
        assert (False not in watched.flags(name)) == sound, value


@pytest.mark.parametrize(
    ("field", "healthy"),
    [
        ((0.1, 0.0, 0.0), False),
        ((0.0, 0.11, 0.0), True),
        ((0.0, 0.0, -1.19), True),
        ((0.0, 0.0, 1.2), False),
        ((0.06, 0.06, 0.06), True),
        ((0.7, 0.7, 0.7), False),
        ((math.nan, 0.0, 0.4), False),
    ],
)
def test_the_strength_of_the_magnetic_field(field: tuple[float, ...], healthy: bool) -> None:
    watched = Watched()
    watched.readings.magnetometer.values[:] = field
    assert watched.flags("magnetometer") == {healthy}


def test_what_the_filter_and_the_battery_report() -> None:
    watched = Watched()
    judgement, health = watched.judgement, watched.monitor.health
    for name in ("attitude", "altitude", "velocity", "position"):
        setattr(judgement, f"{name}_valid", False)
        watched.monitor.update(NOW_US)
        assert not getattr(health, name)
        setattr(judgement, f"{name}_valid", True)
        watched.monitor.update(NOW_US)
        assert getattr(health, name)
    judgement.airspeed_rejected, judgement.external, judgement.position_accuracy_m = True, True, 1.5
    watched.monitor.update(NOW_US)
    assert (health.airspeed, health.external, health.position_accuracy_m) == (False, True, 1.5)
    assert (health.battery_voltage_v, health.battery_used_ah, health.battery_remaining) == (16.0, 0.25, 0.75)


def test_the_receivers_position_is_known_with_a_frame_and_a_fix() -> None:
    watched = Watched()
    frame = LocalFrame(GeodeticPosition(lat_deg=47.0, lon_deg=8.0, alt_m=490.0))
    assert watched.monitor.gps_position_ned(frame) is None  # not yet healthy
    watched.monitor.update(NOW_US)
    assert watched.monitor.gps_position_ned(None) is None
    assert watched.monitor.gps_position_ned(frame) == pytest.approx((0.0, 0.0, -10.0), abs=1e-3)
