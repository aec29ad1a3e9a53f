"""Layout of the truth vector: the true state of one vehicle after a physics step.

One preallocated float64 array per vehicle, written in place by the vehicle model and read by the sensor
kernels and the log. It never reaches an autopilot, a mission or an estimator.

Motion (position, velocity, attitude, rates, specific force) is written every step; air, battery, rotors,
airspeed, height above ground and ground contact every step or, in a `World`, at its slow rate.

Frames: NED is the local geodetic frame at the vehicle; FRD is the body frame (x forward, y right, z down).
"""

from typing import Final

from flightsim.foundation.layouts import Slots

_at = Slots()
LAT_RAD: Final = _at.place()  # geodetic latitude, WGS84
LON_RAD: Final = _at.place()  # longitude
ALT_M: Final = _at.place()  # height above mean sea level (JSBSim's geodetic altitude), m
VEL_NED_M_S: Final = _at.vector(3)  # velocity over ground
Q_NED_FROM_FRD: Final = _at.vector(4)  # Hamilton, w x y z
RATES_FRD_RAD_S: Final = _at.vector(3)  # body rates against inertial space, what a perfect gyro reads
SPECIFIC_FORCE_FRD_M_S2: Final = _at.vector(3)  # what a perfect accelerometer at the CG reads
PRESSURE_PA: Final = _at.place()  # static pressure at the vehicle
TEMPERATURE_K: Final = _at.place()  # air temperature at the vehicle
DENSITY_KG_M3: Final = _at.place()
WIND_NED_M_S: Final = _at.vector(3)  # air's velocity over ground, turbulence and gusts included
MAG_NED_GAUSS: Final = _at.vector(3)  # Earth's field at the vehicle
HEIGHT_ABOVE_GROUND_M: Final = _at.place()  # of the CG over the terrain below it
AIRSPEED_TRUE_M_S: Final = _at.place()
BATTERY_VOLTAGE_V: Final = _at.place()  # at the terminals, sag included
BATTERY_CURRENT_A: Final = _at.place()
BATTERY_USED_AH: Final = _at.place()
BATTERY_CAPACITY_AH: Final = _at.place()
ON_GROUND: Final = _at.place()  # 1.0 when any contact point carries weight
ROTOR_RAD_S: Final = _at.vector(8)  # rotor or propeller speeds, unused ones zero
ANGLE_OF_ATTACK_RAD: Final = _at.place()  # of the body's x axis against the air; 0 without airspeed
SIDESLIP_RAD: Final = _at.place()
DYNAMIC_PRESSURE_PA: Final = _at.place()  # of the undisturbed flow, 1/2 rho V^2
TRUTH_SIZE: Final = _at.size
