"""The narrow interface where simulator and autopilot meet: sensor readings in, actuator commands out.

A `Reading` is the newest *delivered* sample of one sensor. The sensor suite writes it in place; the autopilot
only reads it. Any real firmware (PX4's HIL_* lockstep, ArduPilot's JSON interface) can stand on the same
line.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

# imu.values
IMU_GYRO_FRD_RAD_S: Final = slice(0, 3)
IMU_ACCEL_FRD_M_S2: Final = slice(3, 6)  # specific force, (0, 0, -9.81) at rest
IMU_TEMPERATURE_C: Final = 6
IMU_SIZE: Final = 7
# barometer.values
BARO_PRESSURE_PA: Final = 0
BARO_TEMPERATURE_C: Final = 1
BARO_SIZE: Final = 2
# magnetometer.values
MAG_FRD_GAUSS: Final = slice(0, 3)
MAG_SIZE: Final = 3
# gps.values
GPS_LAT_DEG: Final = 0
GPS_LON_DEG: Final = 1
GPS_ALT_M: Final = 2  # above mean sea level
GPS_VEL_NED_M_S: Final = slice(3, 6)
GPS_EPH_M: Final = 6  # 1-sigma horizontal accuracy the receiver reports
GPS_EPV_M: Final = 7
GPS_SPEED_ACCURACY_M_S: Final = 8
GPS_FIX_TYPE: Final = 9  # MAVLink GPS_FIX_TYPE: 0 no GPS, 1 no fix, 3 3D, 6 RTK fixed
GPS_SATELLITES: Final = 10
GPS_HDOP: Final = 11
GPS_VDOP: Final = 12
GPS_SIZE: Final = 13
# battery.values
BATTERY_VOLTAGE_V: Final = 0
BATTERY_CURRENT_A: Final = 1
BATTERY_USED_AH: Final = 2
BATTERY_REMAINING: Final = 3  # 0..1
BATTERY_SIZE: Final = 4
# rangefinder.values
RANGE_DISTANCE_M: Final = 0  # NaN when out of range
RANGE_MIN_M: Final = 1
RANGE_MAX_M: Final = 2
RANGE_SIZE: Final = 3

# airspeed.values (pitot tube)
AIRSPEED_DIFFERENTIAL_PRESSURE_PA: Final = 0  # total less static pressure
AIRSPEED_TEMPERATURE_C: Final = 1
AIRSPEED_SIZE: Final = 2
# flow_vane.values (angle-of-attack and sideslip vanes)
VANE_ANGLE_OF_ATTACK_RAD: Final = 0
VANE_SIDESLIP_RAD: Final = 1
VANE_SIZE: Final = 2


class Reading:
    """Newest delivered sample of one sensor.

    Attributes:
        values: float64 array, layout given by the constants above; NaN before the first sample.
        time_us: time the sample was measured (not delivered), microseconds since boot; -1 before the first.
        fresh: True only during the physics step in which the sample was delivered.
    """

    __slots__ = ("fresh", "time_us", "values")

    def __init__(self, size: int) -> None:
        self.values: NDArray[np.float64] = np.full(size, np.nan)
        self.time_us: int = -1
        self.fresh: bool = False


class SensorReadings:
    """All readings of one vehicle: the autopilot's whole view of the world."""

    __slots__ = (
        "airspeed",
        "barometer",
        "battery",
        "flow_vane",
        "gps",
        "imu",
        "magnetometer",
        "rangefinder",
    )

    def __init__(self) -> None:
        self.imu = Reading(IMU_SIZE)
        self.barometer = Reading(BARO_SIZE)
        self.magnetometer = Reading(MAG_SIZE)
        self.gps = Reading(GPS_SIZE)
        self.battery = Reading(BATTERY_SIZE)
        self.rangefinder = Reading(RANGE_SIZE)
        self.airspeed = Reading(AIRSPEED_SIZE)
        self.flow_vane = Reading(VANE_SIZE)


MAX_ACTUATORS: Final = 8
"""Actuator commands are a float64 array of this size: motors 0..1, surfaces -1..1, unused ones zero."""

# Actuators of a fixed-wing vehicle, in ArduPilot's channel order. Positive rolls right, pitches the nose up,
# turns the nose right; throttle, flaps and brake are 0..1.
AILERON: Final = 0
ELEVATOR: Final = 1
THROTTLE: Final = 2
RUDDER: Final = 3
FLAPS: Final = 4
STEERING: Final = 5  # nose or tail wheel
BRAKE: Final = 6
