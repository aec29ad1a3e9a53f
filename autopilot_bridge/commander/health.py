"""Which sensors and which parts of the navigation solution can be trusted now.

The commander's checks, failsafes and SYS_STATUS all read one `VehicleHealth`. `HealthMonitor` fills it from
the newest sensor readings (late, frozen or impossible samples count as failed) and from the state that the
navigation filter reports.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from flightsim import interface
from flightsim.foundation.geodesy import LocalFrame
from flightsim.interface import Reading, SensorReadings

_STALE_US: Final = {
    "imu": 100_000,
    "barometer": 500_000,
    "magnetometer": 500_000,
    "gps": 1_000_000,
    "battery": 3_000_000,
    "airspeed": 1_000_000,
}
_FROZEN_SAMPLES: Final = 20  # at 10 Hz: unchanged for 2 s counts as frozen (PX4's DataValidator)
_MAX_RATE_RAD_S: Final = 40.0
_MAX_ACCEL_M_S2: Final = 250.0
_PRESSURE_PA: Final = (10_000.0, 120_000.0)
_FIELD_GAUSS: Final = (0.1, 1.2)
_DIFFERENTIAL_PRESSURE_PA: Final = (-2_000.0, 20_000.0)
_GPS_MIN_SATELLITES: Final = 6
_GPS_MAX_EPH_M: Final = 5.0
_FIX_3D: Final = 3


class NavigationStatus(Protocol):
    """The state of the navigation filter that the commander reads."""

    @property
    def attitude_valid(self) -> bool: ...
    @property
    def altitude_valid(self) -> bool: ...
    @property
    def velocity_valid(self) -> bool: ...
    @property
    def position_valid(self) -> bool: ...
    @property
    def external(self) -> bool: ...
    @property
    def position_accuracy_m(self) -> float: ...
    @property
    def airspeed_rejected(self) -> bool: ...


@dataclass(slots=True)
class VehicleHealth:
    """Health of one vehicle; every flag is False until a check has passed."""

    gyro: bool = False
    accelerometer: bool = False
    barometer: bool = False
    magnetometer: bool = False
    gps: bool = False
    rangefinder: bool = False
    airspeed: bool = False
    has_airspeed: bool = False
    attitude: bool = False
    altitude: bool = False
    velocity: bool = False
    position: bool = False
    external: bool = False
    position_accuracy_m: float = math.nan
    battery: bool = False
    battery_voltage_v: float = math.nan
    battery_used_ah: float = math.nan
    battery_remaining: float = math.nan


class _Watch:
    """Freshness of one sensor: detects late samples and values that never change."""

    def __init__(self, reading: Reading, stale_us: int, *, may_repeat: bool = False) -> None:
        self._reading = reading
        self._stale_us = stale_us
        self._may_repeat = may_repeat
        self._last = reading.values.tobytes()
        self._last_time_us = -1
        self._equal = 0

    def alive(self, time_us: int) -> bool:
        reading = self._reading
        if reading.time_us < 0 or time_us - reading.time_us > self._stale_us:
            return False
        if reading.time_us != self._last_time_us:
            self._last_time_us = reading.time_us
            newest = reading.values.tobytes()  # NaN fields compare equal as bytes
            self._equal = self._equal + 1 if newest == self._last else 0
            self._last = newest
        return self._equal < _FROZEN_SAMPLES or self._may_repeat


class HealthMonitor:
    """Updates a `VehicleHealth`.

    Args:
        readings: the vehicle's newest sensor samples.
        navigation: the filter's own state.
        airspeed: the vehicle has, and needs, a pitot tube.
        gps_may_repeat: fixes with identical values do not count as a frozen receiver.
    """

    def __init__(
        self,
        readings: SensorReadings,
        navigation: NavigationStatus,
        *,
        airspeed: bool = False,
        gps_may_repeat: bool = False,
    ) -> None:
        self.health = VehicleHealth(has_airspeed=airspeed)
        self.navigation = navigation
        self._readings = readings
        self._imu = _Watch(readings.imu, _STALE_US["imu"])
        self._barometer = _Watch(readings.barometer, _STALE_US["barometer"])
        self._magnetometer = _Watch(readings.magnetometer, _STALE_US["magnetometer"])
        self._gps = _Watch(readings.gps, _STALE_US["gps"], may_repeat=gps_may_repeat)
        self._battery = _Watch(readings.battery, _STALE_US["battery"])
        self._airspeed = _Watch(readings.airspeed, _STALE_US["airspeed"]) if airspeed else None
        self._rangefinder = _Watch(readings.rangefinder, _STALE_US["barometer"])

    def gps_position_ned(self, frame: LocalFrame | None) -> tuple[float, float, float] | None:
        """The receiver's position in local NED; None while it has none."""
        if frame is None or not self.health.gps:
            return None
        gps = self._readings.gps.values
        lat, lon, alt = (
            float(gps[interface.GPS_LAT_DEG]),
            float(gps[interface.GPS_LON_DEG]),
            float(gps[interface.GPS_ALT_M]),
        )
        return frame.ned_from_geodetic(lat, lon, alt)

    def update(self, time_us: int) -> None:
        """Check every source; called by the commander at 10 Hz."""
        health, readings, navigation = self.health, self._readings, self.navigation
        imu_alive = self._imu.alive(time_us)
        values = readings.imu.values.tolist()
        health.gyro = imu_alive and _within(values[interface.IMU_GYRO_FRD_RAD_S], _MAX_RATE_RAD_S)
        health.accelerometer = imu_alive and _within(values[interface.IMU_ACCEL_FRD_M_S2], _MAX_ACCEL_M_S2)
        pressure_pa = float(readings.barometer.values[interface.BARO_PRESSURE_PA])
        health.barometer = self._barometer.alive(time_us) and _PRESSURE_PA[0] < pressure_pa < _PRESSURE_PA[1]
        field = readings.magnetometer.values[interface.MAG_FRD_GAUSS].tolist()
        strength = math.sqrt(field[0] ** 2 + field[1] ** 2 + field[2] ** 2)
        health.magnetometer = (
            self._magnetometer.alive(time_us) and _FIELD_GAUSS[0] < strength < _FIELD_GAUSS[1]
        )
        gps = readings.gps.values.tolist()
        health.gps = (
            self._gps.alive(time_us)
            and gps[interface.GPS_FIX_TYPE] >= _FIX_3D
            and gps[interface.GPS_SATELLITES] >= _GPS_MIN_SATELLITES
            and gps[interface.GPS_EPH_M] <= _GPS_MAX_EPH_M
        )
        health.rangefinder = self._rangefinder.alive(time_us)
        if self._airspeed is not None:
            pressure_pa = float(readings.airspeed.values[interface.AIRSPEED_DIFFERENTIAL_PRESSURE_PA])
            low_pa, high_pa = _DIFFERENTIAL_PRESSURE_PA
            sound = self._airspeed.alive(time_us) and low_pa < pressure_pa < high_pa
            health.airspeed = sound and not navigation.airspeed_rejected
        health.attitude = navigation.attitude_valid
        health.altitude = navigation.altitude_valid
        health.velocity = navigation.velocity_valid
        health.position = navigation.position_valid
        health.external = navigation.external
        health.position_accuracy_m = navigation.position_accuracy_m
        battery = readings.battery.values.tolist()
        health.battery_voltage_v = battery[interface.BATTERY_VOLTAGE_V]
        health.battery_used_ah = battery[interface.BATTERY_USED_AH]
        health.battery_remaining = battery[interface.BATTERY_REMAINING]
        health.battery = self._battery.alive(time_us) and health.battery_voltage_v > 0.0


def _within(vector: Sequence[float], limit: float) -> bool:
    """True when every component is finite and below `limit` in magnitude (NaN compares false)."""
    return abs(vector[0]) < limit and abs(vector[1]) < limit and abs(vector[2]) < limit
