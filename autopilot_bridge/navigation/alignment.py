"""Initial alignment: tilt from the mean specific force, yaw from the mean magnetic field."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.interface import IMU_ACCEL_FRD_M_S2, IMU_GYRO_FRD_RAD_S, SensorReadings

Array = NDArray[np.float64]

_MAX_RATE_RAD_S: Final = 0.26  # 15 deg/s
_MAX_FORCE_ERROR: Final = 0.2  # of gravity
_MAG_WAIT: Final = 4.0  # alignment times to wait for a magnetometer


class Alignment:
    """Averages while the vehicle is about still; `ready` when they are long enough.

    Attributes:
        accel_frd_m_s2: mean specific force.
        mag_frd_gauss: mean magnetic field; None without a magnetometer.
    """

    def __init__(self, *, duration_s: float, dt_s: float) -> None:
        self._time_s = duration_s
        self._dt_s = dt_s
        self._accel: Array = np.zeros(3)
        self._mag: Array = np.zeros(3)
        self.restart()

    def restart(self) -> None:
        """Restart."""
        self._elapsed_s = 0.0
        self._accel[:] = 0.0
        self._mag[:] = 0.0
        self._mag_samples = 0

    def step(self, readings: SensorReadings) -> None:
        """Add this step's fresh samples; restart on motion or on invalid samples."""
        imu = readings.imu
        if imu.fresh:
            accel = imu.values[IMU_ACCEL_FRD_M_S2]
            gyro = imu.values[IMU_GYRO_FRD_RAD_S]
            force = math.hypot(*accel) / GRAVITY_M_S2
            if not (abs(force - 1.0) <= _MAX_FORCE_ERROR and math.hypot(*gyro) <= _MAX_RATE_RAD_S):
                self.restart()
                return
            self._elapsed_s += self._dt_s
            self._accel += (accel - self._accel) * (self._dt_s / self._elapsed_s)
        mag = readings.magnetometer
        if mag.fresh and 0.05 < math.hypot(*mag.values) < 2.0:
            self._mag_samples += 1
            self._mag += (mag.values - self._mag) / self._mag_samples

    @property
    def ready(self) -> bool:
        """Averaged long enough; a missing magnetometer is waited for a little longer."""
        needed = self._time_s if self._mag_samples else self._time_s * _MAG_WAIT
        return self._elapsed_s >= needed

    @property
    def accel_frd_m_s2(self) -> Array:
        return self._accel

    @property
    def mag_frd_gauss(self) -> Array | None:
        return self._mag if self._mag_samples else None


def tilt_from_accel(accel_frd_m_s2: Array) -> tuple[float, float]:
    """(roll, pitch) in rad of a vehicle at rest from its specific force."""
    x, y, z = accel_frd_m_s2
    return math.atan2(-y, -z), math.atan2(x, math.hypot(y, z))


def magnetic_heading_rad(
    mag_frd_gauss: Array, roll_rad: float, pitch_rad: float
) -> tuple[float, float, float]:
    """(heading from magnetic north in rad, horizontal field, downward field in gauss) from the field in
    FRD."""
    sin_r, cos_r = math.sin(roll_rad), math.cos(roll_rad)
    sin_p, cos_p = math.sin(pitch_rad), math.cos(pitch_rad)
    x, y, z = mag_frd_gauss
    lateral = y * cos_r - z * sin_r
    level = y * sin_r + z * cos_r
    forward = x * cos_p + level * sin_p
    return math.atan2(-lateral, forward), math.hypot(forward, lateral), -x * sin_p + level * cos_p
