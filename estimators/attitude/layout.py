"""Layout of the attitude filter's state: one float64 array that the compiled step works on in place.

Each index is named after the quantity at it; a vector occupies three places from its index. FRD is the body
frame (forward, right, down); level is the body frame without roll and pitch. SI units, radians.
"""

from typing import Final

# The current sample, written as a block before each step
FORM: Final = 0
"""STILL, WING or ROTOR."""
DISARMED: Final = 1
"""1: the vehicle cannot be flying."""
ELAPSED: Final = 2
"""Time since the previous sample, s; 0 at the first."""
SAMPLE_FORCE: Final = 3
"""Specific force, m/s^2, FRD."""
SAMPLE_RATE: Final = 6
"""Measured angular rate, rad/s, FRD."""
SAMPLE_FORMAT: Final = "9d"

# Attitude
DOWN: Final = 9
"""Unit vector down in FRD, the third row of `r_level_from_frd`. It contains roll and pitch, and no yaw."""
GYRO_BIAS: Final = 12
"""Bias of the gyro (reading minus true rate), rad/s."""
RATE: Final = 15
"""Newest measured angular rate, rad/s; NaN before the first sample."""

# Received air data
AIRSPEED: Final = 18
"""Newest true airspeed, m/s; NaN: none, or too old."""
AIRSPEED_FRESH: Final = 19
"""1: not yet used."""
CLIMB: Final = 20
"""Newest rate of climb, m/s; NaN: none."""
THROTTLE: Final = 21
"""Newest throttle, 0..1; NaN: none."""

# Quantities derived from the air data
VELOCITY: Final = 22
"""Velocity against the air in FRD, m/s."""
SPEED: Final = 25
"""Filtered true airspeed of the fixed-wing form, m/s; NaN: none yet."""
SPEED_ERROR: Final = 26
"""Measured minus filtered airspeed, m/s."""
ALPHA: Final = 27
"""Angle of attack, rad."""
ALPHA_MEAN: Final = 28
"""Angle of attack that makes the mean lift, rad."""
BETA: Final = 29
"""Sideslip, rad."""
LIFT: Final = 30
"""Mean lift acceleration per square of airspeed, 1/m; 0: not yet known."""
LIFT_SUM: Final = 31
LIFT_WEIGHT: Final = 32
CLIMB_WEIGHT: Final = 33
"""These sums belong to the means from which lift and angle of attack are learned."""
DRAG: Final = 34
"""Drag acceleration of a multirotor per speed, 1/s."""
SPEED_SQUARE: Final = 35
"""Square of the speed, summed over time for learning the drag, m^2/s."""
FORCE_SQUARE: Final = 36
"""Square of the sideways force, summed in the same way, m^2/s^3."""
SIDEWAYS: Final = 37
"""Smoothed forward and right specific force, m/s^2 (two places)."""

# Rest
AGE: Final = 39
"""Time filtered since the start, s."""
REST_TIME: Final = 40
"""Time since the last motion, s."""
REST_SUM: Final = 41
"""Total time at rest that is used for the bias, s."""
MEAN_RATE: Final = 42
"""Slow mean of the measured rate, rad/s."""

# The newest correction
REFERENCE: Final = 45
"""Direction down according to accelerometer and motion: m/s^2, FRD, of length g when both agree."""
LENGTH: Final = 48
"""Smoothed length of the reference, m/s^2."""
WEIGHT: Final = 49
"""Trust in the reference, 0..1."""
SLOW_INNOVATION: Final = 50
"""Smoothed cross product of the directions of reference and estimate, FRD."""
INNOVATION: Final = 53
"""Angle between reference and estimate, rad."""

# Uncertainty
ROLL_COVARIANCE: Final = 54
"""First of six places, see `uncertainty`."""
PITCH_COVARIANCE: Final = 60
STATE_SIZE: Final = 66

# Forms of the filter
STILL: Final = 0
"""Without a model of motion: the specific force is taken as the direction up."""
WING: Final = 1
ROTOR: Final = 2
