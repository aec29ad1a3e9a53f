"""Layout of the control setpoint: the command of a flight task to the control laws.

One preallocated float64 array, written by the active flight task, read by the control kernels. At level
`TRAJECTORY` NaN means "not controlled here" as in PX4's TrajectorySetpoint: position feeds velocity,
velocity feeds acceleration, and given velocity and acceleration add as feed-forward.
"""

from typing import Final

POS_NED_M: Final = slice(0, 3)
VEL_NED_M_S: Final = slice(3, 6)
ACC_NED_M_S2: Final = slice(6, 9)
YAW_RAD: Final = 9  # NaN: hold by yaw rate only
YAW_RATE_RAD_S: Final = 10
Q_NED_FROM_FRD: Final = slice(11, 15)  # level ATTITUDE
RATES_FRD_RAD_S: Final = slice(15, 18)  # level RATES; feed-forward at level ATTITUDE (NaN: none)
THRUST: Final = 18  # collective, 0..1 (levels ATTITUDE and RATES); NaN: the vertical part of the trajectory
LEVEL: Final = 19
SETPOINT_SIZE: Final = 20

# values of LEVEL
OFF: Final = 0.0  # motors stopped
IDLE: Final = 1.0  # armed, motors at idle
RATES: Final = 2.0
ATTITUDE: Final = 3.0
TRAJECTORY: Final = 4.0
