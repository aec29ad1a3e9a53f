"""The narrow interface where simulator and autopilot meet: sensor readings in, actuator commands out.

A `Reading` is the newest *delivered* sample of one sensor. The sensor suite writes it in place; the autopilot
only reads it. Any real firmware (PX4's HIL_* lockstep, ArduPilot's JSON interface) can stand on the same
line.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.layouts import Slots

_imu = Slots()
# imu.values
IMU_GYRO_FRD_RAD_S: Final = _imu.vector(3)
IMU_ACCEL_FRD_M_S2: Final = _imu.vector(3)  # specific force, (0, 0, -9.81) at rest
IMU_TEMPERATURE_C: Final = _imu.place()
IMU_SIZE: Final = _imu.size
_barometer = Slots()
# barometer.values
BARO_PRESSURE_PA: Final = _barometer.place()
BARO_TEMPERATURE_C: Final = _barometer.place()
BARO_SIZE: Final = _barometer.size
_magnetometer = Slots()
# magnetometer.values
MAG_FRD_GAUSS: Final = _magnetometer.vector(3)
MAG_SIZE: Final = _magnetometer.size
_gps = Slots()
# gps.values
GPS_LAT_DEG: Final = _gps.place()
GPS_LON_DEG: Final = _gps.place()
GPS_ALT_M: Final = _gps.place()  # above mean sea level
GPS_VEL_NED_M_S: Final = _gps.vector(3)
GPS_EPH_M: Final = _gps.place()  # 1-sigma horizontal accuracy the receiver reports
GPS_EPV_M: Final = _gps.place()
GPS_SPEED_ACCURACY_M_S: Final = _gps.place()
GPS_FIX_TYPE: Final = _gps.place()  # MAVLink GPS_FIX_TYPE: 0 no GPS, 1 no fix, 3 3D, 6 RTK fixed
GPS_SATELLITES: Final = _gps.place()
GPS_HDOP: Final = _gps.place()
GPS_VDOP: Final = _gps.place()
GPS_SIZE: Final = _gps.size
_battery = Slots()
# battery.values
BATTERY_VOLTAGE_V: Final = _battery.place()
BATTERY_CURRENT_A: Final = _battery.place()
BATTERY_USED_AH: Final = _battery.place()
BATTERY_REMAINING: Final = _battery.place()  # 0..1
BATTERY_SIZE: Final = _battery.size
_rangefinder = Slots()
# rangefinder.values
RANGE_DISTANCE_M: Final = _rangefinder.place()  # NaN when out of range
RANGE_MIN_M: Final = _rangefinder.place()
RANGE_MAX_M: Final = _rangefinder.place()
RANGE_SIZE: Final = _rangefinder.size

_airspeed = Slots()
# airspeed.values (pitot tube)
AIRSPEED_DIFFERENTIAL_PRESSURE_PA: Final = _airspeed.place()  # total less static pressure
AIRSPEED_TEMPERATURE_C: Final = _airspeed.place()
AIRSPEED_SIZE: Final = _airspeed.size
_vane = Slots()
# flow_vane.values (angle-of-attack and sideslip vanes)
VANE_ANGLE_OF_ATTACK_RAD: Final = _vane.place()
VANE_SIDESLIP_RAD: Final = _vane.place()
VANE_SIZE: Final = _vane.size


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

    __slots__ = ("airspeed", "barometer", "battery", "flow_vane", "gps", "imu", "magnetometer", "rangefinder")

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
