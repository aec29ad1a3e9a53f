"""Layout of the navigation state: the output of the filter to the autopilot, at every physics step.

One preallocated float64 array, written in place by the navigation filter. Positions are in the local NED
frame at the filter's origin, metres; body is FRD.
"""

from typing import Final

Q_NED_FROM_FRD: Final = slice(0, 4)
RATES_FRD_RAD_S: Final = slice(4, 7)  # bias-corrected body rates
VEL_NED_M_S: Final = slice(7, 10)
POS_NED_M: Final = slice(10, 13)
ACC_NED_M_S2: Final = slice(13, 16)  # kinematic acceleration (gravity removed)
GYRO_BIAS_RAD_S: Final = slice(16, 19)
ACCEL_BIAS_M_S2: Final = slice(19, 22)
SPECIFIC_FORCE_FRD_M_S2: Final = slice(22, 25)  # bias-corrected
EULER_RAD: Final = slice(25, 28)  # roll, pitch, yaw
HEIGHT_ABOVE_GROUND_M: Final = 28  # NaN when not known
WIND_NED_M_S: Final = slice(29, 32)  # NaN when not estimated
AIRSPEED_M_S: Final = 32  # equivalent; of the sensor, or by wind and speed while it is out; NaN: not known
AIRSPEED_TRUE_M_S: Final = 33
NAV_SIZE: Final = 34
