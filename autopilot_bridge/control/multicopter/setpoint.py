"""Layout of the control setpoint: the command of a flight task to the control laws.

One preallocated float64 array, written by the active flight task, read by the control kernels. At level
`TRAJECTORY` NaN means "not controlled here" as in PX4's TrajectorySetpoint: position feeds velocity,
velocity feeds acceleration, and given velocity and acceleration add as feed-forward.
"""

from typing import Final

from flightsim.foundation.records import Record, Vector3, Vector4, place, size_of, vector


class Setpoint(Record):
    """The setpoint as kernels take it; its numbers follow each other in the array."""

    level: float
    pos_ned_m: Vector3
    vel_ned_m_s: Vector3
    acc_ned_m_s2: Vector3
    yaw_rad: float  # NaN: hold by yaw rate only
    yaw_rate_rad_s: float
    q_ned_from_frd: Vector4  # level ATTITUDE
    rates_frd_rad_s: Vector3  # level RATES; feed-forward at level ATTITUDE (NaN: none)
    # collective, 0..1 (levels ATTITUDE and RATES); NaN: the vertical part of the trajectory
    thrust: float


LEVEL: Final = place(Setpoint, "level")
POS_NED_M: Final = vector(Setpoint, "pos_ned_m")
VEL_NED_M_S: Final = vector(Setpoint, "vel_ned_m_s")
ACC_NED_M_S2: Final = vector(Setpoint, "acc_ned_m_s2")
YAW_RAD: Final = place(Setpoint, "yaw_rad")
YAW_RATE_RAD_S: Final = place(Setpoint, "yaw_rate_rad_s")
Q_NED_FROM_FRD: Final = vector(Setpoint, "q_ned_from_frd")
RATES_FRD_RAD_S: Final = vector(Setpoint, "rates_frd_rad_s")
THRUST: Final = place(Setpoint, "thrust")
SETPOINT_SIZE: Final = size_of(Setpoint)

# First places of the vectors, for single components
POS: Final[int] = POS_NED_M.start
VEL: Final[int] = VEL_NED_M_S.start
ACC: Final[int] = ACC_NED_M_S2.start
Q: Final[int] = Q_NED_FROM_FRD.start
BODY_RATES: Final[int] = RATES_FRD_RAD_S.start
POS_HORIZONTAL: Final = slice(POS, POS + 2)
VEL_HORIZONTAL: Final = slice(VEL, VEL + 2)
ACC_HORIZONTAL: Final = slice(ACC, ACC + 2)
MOTION: Final = slice(POS, ACC + 3)

# values of LEVEL
OFF: Final = 0.0  # motors stopped
IDLE: Final = 1.0  # armed, motors at idle
RATES: Final = 2.0
ATTITUDE: Final = 3.0
TRAJECTORY: Final = 4.0
