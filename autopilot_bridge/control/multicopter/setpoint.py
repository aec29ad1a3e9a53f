"""Layout of the control setpoint: the command of a flight task to the control laws.

One preallocated float64 array, written by the active flight task, read by the control kernels. At level
`TRAJECTORY` NaN means "not controlled here" as in PX4's TrajectorySetpoint: position feeds velocity,
velocity feeds acceleration, and given velocity and acceleration add as feed-forward.
"""

from typing import Final

from flightsim.foundation.layouts import Slots

_at = Slots()
LEVEL: Final = _at.place()
POS_NED_M: Final = _at.vector(3)
VEL_NED_M_S: Final = _at.vector(3)
ACC_NED_M_S2: Final = _at.vector(3)
YAW_RAD: Final = _at.place()  # NaN: hold by yaw rate only
YAW_RATE_RAD_S: Final = _at.place()
Q_NED_FROM_FRD: Final = _at.vector(4)  # level ATTITUDE
RATES_FRD_RAD_S: Final = _at.vector(3)  # level RATES; feed-forward at level ATTITUDE (NaN: none)
# collective, 0..1 (levels ATTITUDE and RATES); NaN: the vertical part of the trajectory
THRUST: Final = _at.place()
SETPOINT_SIZE: Final = _at.size

# First places of the vectors, for kernels and single components
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
