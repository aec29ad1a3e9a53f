"""Layout of the navigation state: the output of the filter to the autopilot, at every physics step.

One preallocated float64 array, written in place by the navigation filter. Positions are in the local NED
frame at the filter's origin, metres; body is FRD.
"""

from typing import Final

from flightsim.foundation.layouts import Slots

_at = Slots()
Q_NED_FROM_FRD: Final = _at.vector(4)
RATES_FRD_RAD_S: Final = _at.vector(3)  # bias-corrected body rates
VEL_NED_M_S: Final = _at.vector(3)
POS_NED_M: Final = _at.vector(3)
ACC_NED_M_S2: Final = _at.vector(3)  # kinematic acceleration (gravity removed)
GYRO_BIAS_RAD_S: Final = _at.vector(3)
ACCEL_BIAS_M_S2: Final = _at.vector(3)
SPECIFIC_FORCE_FRD_M_S2: Final = _at.vector(3)  # bias-corrected
EULER_RAD: Final = _at.vector(3)  # roll, pitch, yaw
HEIGHT_ABOVE_GROUND_M: Final = _at.place()  # NaN when not known
WIND_NED_M_S: Final = _at.vector(3)  # NaN when not estimated
# equivalent; of the sensor, or by wind and speed while it is out; NaN: not known
AIRSPEED_M_S: Final = _at.place()
AIRSPEED_TRUE_M_S: Final = _at.place()
NAV_SIZE: Final = _at.size

# First places of the vectors, for kernels and single components
Q: Final[int] = Q_NED_FROM_FRD.start
RATES: Final[int] = RATES_FRD_RAD_S.start
VEL: Final[int] = VEL_NED_M_S.start
POS: Final[int] = POS_NED_M.start
ACC: Final[int] = ACC_NED_M_S2.start
FORCE: Final[int] = SPECIFIC_FORCE_FRD_M_S2.start
WIND: Final[int] = WIND_NED_M_S.start
ROLL: Final[int] = EULER_RAD.start
PITCH: Final = ROLL + 1
YAW: Final = ROLL + 2
