"""The input of telemetry, converted once per physics step to plain numbers in the wire's units."""

import math
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.mavlink.wire_units import e7
from autopilot_bridge.navigation import layout as nav
from flightsim import interface
from flightsim.foundation.atmosphere import GRAVITY_M_S2, SEA_LEVEL_PRESSURE_PA
from flightsim.foundation.kernels import bound, kernel
from flightsim.interface import SensorReadings

VIBRATION_RATE_HZ: Final = 50.0  # of the slow loop

Array = NDArray[np.float64]


@kernel
def _update(accel_frd: Array, slow: Array, level: Array, blend_slow: float, blend_level: float) -> None:
    for i in range(3):
        if not math.isfinite(accel_frd[i]):
            continue
        slow[i] += blend_slow * (accel_frd[i] - slow[i])
        fast = accel_frd[i] - slow[i]
        level[i] += blend_level * (fast * fast - level[i])


class VibrationMeter:
    """High-passed accelerometer RMS per body axis (ArduPilot: 5 Hz high pass, 2 Hz smoothing).

    Args:
        accel_frd_m_s2: newest accelerometer sample, shape (3,), written in place by the sensor; values that
            are not finite are ignored.
        rate_hz: calls of `update` per second.

    Attributes:
        update: takes the newest sample.
    """

    def __init__(self, accel_frd_m_s2: Array, *, rate_hz: float) -> None:
        self._level = np.zeros(3)
        blend_slow = min(1.0, 2.0 * math.pi * 5.0 / rate_hz)
        blend_level = min(1.0, 2.0 * math.pi * 2.0 / rate_hz)
        slow = np.array([0.0, 0.0, -GRAVITY_M_S2])
        self.update: Callable[[], None] = bound(
            _update, accel_frd_m_s2, slow, self._level, blend_slow, blend_level
        )

    @property
    def rms_m_s2(self) -> tuple[float, float, float]:
        """RMS per axis (x, y, z)."""
        x, y, z = np.sqrt(self._level).tolist()
        return x, y, z


class TelemetryView:
    """Snapshot of one autopilot's state for the message builders, made at most once per step, on demand.

    Attributes (of `refreshed()`): attitude `q` (w, x, y, z), `rates` rad/s, `roll`, `pitch`, `yaw` rad; `pos`
    and `vel` NED m, m/s; `acc` NED m/s^2; and, when the filter has an origin, `lat_e7`,
    `lon_e7`, `alt_amsl_m`, `alt_relative_m` (to home). `time_us` and `time_ms` are always those of the step.
    """

    def __init__(
        self, context: FlightContext, nav_state: NDArray[np.float64], readings: SensorReadings
    ) -> None:
        self.context = context
        self.readings = readings
        self.vibration = VibrationMeter(
            readings.imu.values[interface.IMU_ACCEL_FRD_M_S2], rate_hz=VIBRATION_RATE_HZ
        )
        self._nav_state = nav_state
        self._fresh_us = -1
        self.has_global = False
        self.advance(0)

    def advance(self, time_us: int) -> None:
        """The step is now `time_us`; all other attributes are updated on demand."""
        self.time_us = time_us
        self.time_ms = time_us // 1000

    def refreshed(self) -> "TelemetryView":
        """This view, with every attribute at the present step."""
        if self._fresh_us != self.time_us:
            self._fresh_us = self.time_us
            self._refresh()
        return self

    def _refresh(self) -> None:
        state = self._nav_state.tolist()
        self.q = state[nav.Q_NED_FROM_FRD]
        self.rates = state[nav.RATES_FRD_RAD_S]
        self.vel = state[nav.VEL_NED_M_S]
        self.pos = state[nav.POS_NED_M]
        self.acc = state[nav.ACC_NED_M_S2]
        self.roll, self.pitch, self.yaw = state[nav.EULER_RAD]
        self.heading_deg = math.degrees(self.yaw) % 360.0
        frame = self.context.frame
        self.has_global = frame is not None
        if frame is not None:
            north, east, down = self.pos
            lat_deg, lon_deg, self.alt_amsl_m = frame.geodetic_from_ned(north, east, down)
            self.lat_e7 = e7(lat_deg)
            self.lon_e7 = e7(lon_deg)
            home_down = self.context.home_ned_m[2]
            self.alt_relative_m = (home_down if home_down == home_down else 0.0) - down

    @property
    def ground_speed_m_s(self) -> float:
        """Horizontal speed over ground."""
        return math.hypot(self.vel[0], self.vel[1])

    @property
    def battery(self) -> tuple[float, float, float, float] | None:
        """(voltage V, current A, used Ah, remaining 0..1), or None before the first reading."""
        reading = self.readings.battery
        if reading.time_us < 0:
            return None
        values = reading.values.tolist()
        return (
            values[interface.BATTERY_VOLTAGE_V],
            values[interface.BATTERY_CURRENT_A],
            values[interface.BATTERY_USED_AH],
            values[interface.BATTERY_REMAINING],
        )

    def imu(self) -> list[float]:
        """Newest gyro (rad/s), accelerometer (m/s^2), temperature (deg C)."""
        return self.readings.imu.values.tolist()

    def magnetometer_gauss(self) -> list[float]:
        """Newest body field; zeros before the first reading."""
        reading = self.readings.magnetometer
        return [0.0, 0.0, 0.0] if reading.time_us < 0 else reading.values.tolist()

    def pressure(self) -> tuple[float, float]:
        """(static pressure Pa, temperature deg C); NaN before the first reading."""
        values = self.readings.barometer.values
        return float(values[interface.BARO_PRESSURE_PA]), float(values[interface.BARO_TEMPERATURE_C])


def pressure_altitude_m(pressure_pa: float) -> float:
    """Height in the standard atmosphere of a static pressure, with the rounded constants of ICAO doc 7488."""
    return 44330.769 * (1.0 - (pressure_pa / SEA_LEVEL_PRESSURE_PA) ** 0.190263)
