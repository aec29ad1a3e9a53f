"""Layout of the truth vector: the true state of one vehicle after a physics step.

One preallocated float64 array per vehicle, written in place by the vehicle model and read by the sensor
kernels and the log. It never reaches an autopilot, a mission or an estimator.

Motion (position, velocity, attitude, rates, specific force) is written every step; air, battery, rotors,
airspeed, height above ground and ground contact every step or, in a `World`, at its slow rate.

Frames: NED is the local geodetic frame at the vehicle; FRD is the body frame (x forward, y right, z down).
"""

from typing import Final

LAT_RAD: Final = 0  # geodetic latitude, WGS84
LON_RAD: Final = 1  # longitude
ALT_M: Final = 2  # height above mean sea level (JSBSim's geodetic altitude), m
VEL_NED_M_S: Final = slice(3, 6)  # velocity over ground
Q_NED_FROM_FRD: Final = slice(6, 10)  # Hamilton, w x y z
RATES_FRD_RAD_S: Final = slice(10, 13)  # body rates against inertial space, what a perfect gyro reads
SPECIFIC_FORCE_FRD_M_S2: Final = slice(13, 16)  # what a perfect accelerometer at the CG reads
PRESSURE_PA: Final = 16  # static pressure at the vehicle
TEMPERATURE_K: Final = 17  # air temperature at the vehicle
DENSITY_KG_M3: Final = 18
WIND_NED_M_S: Final = slice(19, 22)  # air's velocity over ground, turbulence and gusts included
MAG_NED_GAUSS: Final = slice(22, 25)  # Earth's field at the vehicle
HEIGHT_ABOVE_GROUND_M: Final = 25  # of the CG over the terrain below it
AIRSPEED_TRUE_M_S: Final = 26
BATTERY_VOLTAGE_V: Final = 27  # at the terminals, sag included
BATTERY_CURRENT_A: Final = 28
BATTERY_USED_AH: Final = 29
BATTERY_CAPACITY_AH: Final = 30
ON_GROUND: Final = 31  # 1.0 when any contact point carries weight
ROTOR_RAD_S: Final = slice(32, 40)  # rotor or propeller speeds, unused ones zero
ANGLE_OF_ATTACK_RAD: Final = 40  # of the body's x axis against the air; 0 without airspeed
SIDESLIP_RAD: Final = 41
DYNAMIC_PRESSURE_PA: Final = 42  # of the undisturbed flow, 1/2 rho V^2
TRUTH_SIZE: Final = 43
