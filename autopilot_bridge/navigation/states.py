"""Layout of the filter's own arrays: the error state, the nominal state and the mechanisation's workspace.

The filter is an error-state (indirect) Kalman filter after Sola, "Quaternion kinematics for the error-state
Kalman filter" (arXiv:1711.02508), with the attitude error in the global (NED) frame, so that a wind state or
another aiding source only appends rows. Errors are true minus estimated; `R_true = exp([theta]x)
R_estimated`.

Error state, 22 entries: attitude, velocity, position, gyro bias, accelerometer bias, GPS position error
(Gauss-Markov), barometer offset, magnetometer bias. A fixed wing has two more, the wind; kernels take the
size of the error state from the covariance they are given. The nominal state (first part of the `core` array)
has the same order with a quaternion for the attitude, so entry `i >= 3` of the error belongs to entry `i + 1`
of `core`.
"""

from typing import Final

from flightsim.foundation.layouts import Slots

# error state
_error = Slots()
ATT: Final = _error.place(3)  # rotation vector in NED, rad
VEL: Final = _error.place(3)  # NED, m/s
POS: Final = _error.place(3)  # NED from the origin, m
GYRO_BIAS: Final = _error.place(3)  # FRD, rad/s
ACCEL_BIAS: Final = _error.place(3)  # FRD, m/s^2
GPS_ERROR: Final = _error.place(3)  # slowly varying part of the GPS position error, NED, m
BARO_OFFSET: Final = _error.place()  # pressure altitude minus height over the origin, m
MAG_BIAS: Final = _error.place(3)  # residual hard iron, FRD, gauss
ERROR_SIZE: Final = _error.size
WIND: Final = _error.place(2)  # north and east, m/s; of a fixed wing only
ERROR_SIZE_WITH_WIND: Final = _error.size

# core: nominal state
Q: Final = 0  # q_ned_from_frd
X_VEL: Final = VEL + 1
X_POS: Final = POS + 1
X_GYRO_BIAS: Final = GYRO_BIAS + 1
X_ACCEL_BIAS: Final = ACCEL_BIAS + 1
X_GPS_ERROR: Final = GPS_ERROR + 1
X_BARO_OFFSET: Final = BARO_OFFSET + 1
X_MAG_BIAS: Final = MAG_BIAS + 1
X_WIND: Final = WIND + 1  # stays zero without wind states
NOMINAL_SIZE: Final = ERROR_SIZE_WITH_WIND + 1

# core: mechanisation
_core = Slots(NOMINAL_SIZE)
R: Final = _core.place(9)  # 9 entries, r_ned_from_frd by rows
GYRO: Final = _core.place(3)  # newest valid gyro sample (raw), rad/s
ACCEL: Final = _core.place(3)  # newest valid accelerometer sample (raw), m/s^2
GYRO_LAST: Final = _core.place(3)  # gyro sample used in the step before
FORCE_NED: Final = _core.place(3)  # bias-corrected specific force of the step before, NED, m/s^2
SAMPLE_AGE_S: Final = _core.place()  # since the newest valid IMU sample
INVALID_SAMPLES: Final = _core.place()  # IMU samples refused so far
GRAVITY: Final = _core.place()  # m/s^2
EARTH_RATE: Final = _core.place(3)  # of the Earth against inertial space, NED, rad/s
STRETCH: Final = _core.place(2)  # metres of the frame in a metre over ground, north and east
TERRAIN_DOWN: Final = _core.place()  # down position of the ground below, m; NaN when not known

# core: sums since the last covariance prediction
SUM_TIME: Final = _core.place()  # s
SUM_R: Final = _core.place(9)  # 9 entries, integral of r_ned_from_frd, s
SUM_FORCE: Final = _core.place(3)  # integral of the specific force, NED, m/s
SUM_TURN: Final = _core.place(3)  # absolute angles turned about north, east, down, rad
SUM_GYRO: Final = _core.place(3)  # integral of the raw gyro since `take_mean_gyro`, rad
SUM_GYRO_TIME: Final = _core.place()

# core: corrections made to position and velocity so far. The history holds estimates less these, so that a
# delayed measurement is compared with the past as the filter sees it now.
CORRECTION_POS: Final = _core.place(3)
CORRECTION_VEL: Final = _core.place(3)
CORE_SIZE: Final = _core.size

# one row of the history
_history = Slots()
HISTORY_POS: Final = _history.place(3)
HISTORY_VEL: Final = _history.place(3)
HISTORY_Q: Final = _history.place(4)
HISTORY_COLUMNS: Final = _history.size

# work: scratch of the update
DX: Final = 0  # error-state estimate of this update
PH: Final = ERROR_SIZE_WITH_WIND  # P H^T of the scalar being fused
WORK_SIZE: Final = 2 * ERROR_SIZE_WITH_WIND
