"""Layout of the navigation state: the output of the filter to the autopilot, at every physics step.

One preallocated float64 array, written in place by the navigation filter. Positions are in the local NED
frame at the filter's origin, metres; body is FRD.
"""

from typing import Final

from flightsim.foundation.records import Record, Vector3, Vector4, place, size_of, vector


class NavigationState(Record):
    """The navigation state as kernels take it; its numbers follow each other in the array."""

    q_ned_from_frd: Vector4
    rates_frd_rad_s: Vector3  # bias-corrected body rates
    vel_ned_m_s: Vector3
    pos_ned_m: Vector3
    acc_ned_m_s2: Vector3  # kinematic acceleration (gravity removed)
    gyro_bias_rad_s: Vector3
    accel_bias_m_s2: Vector3
    specific_force_frd_m_s2: Vector3  # bias-corrected
    euler_rad: Vector3  # roll, pitch, yaw
    height_above_ground_m: float  # NaN when not known
    wind_ned_m_s: Vector3  # NaN when not estimated
    # equivalent; of the sensor, or by wind and speed while it is out; NaN: not known
    airspeed_m_s: float
    airspeed_true_m_s: float


_S = NavigationState
Q_NED_FROM_FRD: Final = vector(_S, "q_ned_from_frd")
RATES_FRD_RAD_S: Final = vector(_S, "rates_frd_rad_s")
VEL_NED_M_S: Final = vector(_S, "vel_ned_m_s")
POS_NED_M: Final = vector(_S, "pos_ned_m")
ACC_NED_M_S2: Final = vector(_S, "acc_ned_m_s2")
GYRO_BIAS_RAD_S: Final = vector(_S, "gyro_bias_rad_s")
ACCEL_BIAS_M_S2: Final = vector(_S, "accel_bias_m_s2")
SPECIFIC_FORCE_FRD_M_S2: Final = vector(_S, "specific_force_frd_m_s2")
EULER_RAD: Final = vector(_S, "euler_rad")
HEIGHT_ABOVE_GROUND_M: Final = place(_S, "height_above_ground_m")
WIND_NED_M_S: Final = vector(_S, "wind_ned_m_s")
AIRSPEED_M_S: Final = place(_S, "airspeed_m_s")
AIRSPEED_TRUE_M_S: Final = place(_S, "airspeed_true_m_s")
NAV_SIZE: Final = size_of(_S)

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
