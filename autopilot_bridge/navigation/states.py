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

# error state
ATT: Final = 0  # rotation vector in NED, rad
VEL: Final = 3  # NED, m/s
POS: Final = 6  # NED from the origin, m
GYRO_BIAS: Final = 9  # FRD, rad/s
ACCEL_BIAS: Final = 12  # FRD, m/s^2
GPS_ERROR: Final = 15  # slowly varying part of the GPS position error, NED, m
BARO_OFFSET: Final = 18  # pressure altitude minus height over the origin, m
MAG_BIAS: Final = 19  # residual hard iron, FRD, gauss
ERROR_SIZE: Final = 22
WIND: Final = ERROR_SIZE  # north and east, m/s; of a fixed wing only
ERROR_SIZE_WITH_WIND: Final = WIND + 2

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
R: Final = NOMINAL_SIZE  # 9 entries, r_ned_from_frd by rows
GYRO: Final = R + 9  # newest valid gyro sample (raw), rad/s
ACCEL: Final = GYRO + 3  # newest valid accelerometer sample (raw), m/s^2
GYRO_LAST: Final = ACCEL + 3  # gyro sample used in the step before
FORCE_NED: Final = GYRO_LAST + 3  # bias-corrected specific force of the step before, NED, m/s^2
SAMPLE_AGE_S: Final = FORCE_NED + 3  # since the newest valid IMU sample
INVALID_SAMPLES: Final = SAMPLE_AGE_S + 1  # IMU samples refused so far
GRAVITY: Final = INVALID_SAMPLES + 1  # m/s^2
EARTH_RATE: Final = GRAVITY + 1  # of the Earth against inertial space, NED, rad/s
TERRAIN_DOWN: Final = EARTH_RATE + 3  # down position of the ground below, m; NaN when not known

# core: sums since the last covariance prediction
SUM_TIME: Final = TERRAIN_DOWN + 1  # s
SUM_R: Final = SUM_TIME + 1  # 9 entries, integral of r_ned_from_frd, s
SUM_FORCE: Final = SUM_R + 9  # integral of the specific force, NED, m/s
SUM_TURN: Final = SUM_FORCE + 3  # absolute angles turned about north, east, down, rad
SUM_GYRO: Final = SUM_TURN + 3  # integral of the raw gyro since `take_mean_gyro`, rad
SUM_GYRO_TIME: Final = SUM_GYRO + 3

# core: corrections made to position and velocity so far. The history holds estimates less these, so that a
# delayed measurement is compared with the past as the filter sees it now.
CORRECTION_POS: Final = SUM_GYRO_TIME + 1
CORRECTION_VEL: Final = CORRECTION_POS + 3
CORE_SIZE: Final = CORRECTION_VEL + 3

# one row of the history
HISTORY_POS: Final = 0
HISTORY_VEL: Final = 3
HISTORY_Q: Final = 6
HISTORY_COLUMNS: Final = 10

# work: scratch of the update
DX: Final = 0  # error-state estimate of this update
PH: Final = ERROR_SIZE_WITH_WIND  # P H^T of the scalar being fused
WORK_SIZE: Final = 2 * ERROR_SIZE_WITH_WIND
