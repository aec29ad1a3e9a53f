"""Layout of the attitude filter's state: one float64 array that the compiled step works on in place.

Indices have the names of what they hold; vectors take three places from theirs on. FRD is the body (forward,
right, down), level is the body without roll and pitch. SI units, radians.
"""

from typing import Final

# The sample at hand, written in one piece before each step
FORM: Final = 0
"""STILL, WING or ROTOR."""
DISARMED: Final = 1
"""1: the vehicle can't be flying."""
ELAPSED: Final = 2
"""Since the sample before, s; nothing at the first."""
SAMPLE_RATE: Final = 3
"""Measured angular rate, rad/s, FRD."""
SAMPLE_FORCE: Final = 6
"""Specific force, m/s^2, FRD."""
SAMPLE_FORMAT: Final = "9d"

# Attitude
DOWN: Final = 9
"""Unit vector down in FRD, the third row of `r_level_from_frd`: all of roll and pitch, nothing of yaw."""
GYRO_BIAS: Final = 12
"""What the gyro reads too much, rad/s."""
RATE: Final = 15
"""Newest angular rate as measured, rad/s; NaN before the first sample."""

# The air as it was heard
AIRSPEED: Final = 18
"""Newest true airspeed, m/s; NaN: none, or an old one."""
AIRSPEED_FRESH: Final = 19
"""1: not yet used."""
CLIMB: Final = 20
"""Newest rate of climb, m/s; NaN: none."""
THROTTLE: Final = 21
"""Newest throttle, 0..1; NaN: none."""

# What is made of it
VELOCITY: Final = 22
"""Velocity against the air in FRD, m/s."""
SPEED: Final = 25
"""Filtered true airspeed of the fixed-wing form, m/s; NaN: none yet."""
SPEED_ERROR: Final = 26
"""Measured less filtered airspeed, m/s."""
ALPHA: Final = 27
"""Angle of attack, rad."""
ALPHA_MEAN: Final = 28
"""Angle of attack that makes the mean lift, rad."""
BETA: Final = 29
"""Sideslip, rad."""
LIFT: Final = 30
"""Mean lift acceleration per square of airspeed, 1/m; 0: not yet known."""
DRAG_TIME: Final = 31
"""Reciprocal of a rotorcraft's drag coefficient, s."""
DRAG_TIME_VARIANCE: Final = 32
SIDEWAYS: Final = 33
"""Smoothed forward and right specific force, m/s^2 (two places)."""

# Rest
AGE: Final = 35
"""Time filtered since the start, s."""
REST_TIME: Final = 36
"""How long nothing has moved, s."""
MEAN_RATE: Final = 37
"""Slow mean of the measured rate, rad/s."""
MEAN_FORCE: Final = 40
"""Slow mean of the specific force, m/s^2."""

# The newest correction
REFERENCE: Final = 43
"""Where accelerometer and motion say that down is: m/s^2, FRD, of length g when they agree."""
WEIGHT: Final = 46
"""Trust in it, 0..1."""
INNOVATION: Final = 47
"""Angle between reference and estimate, rad."""

# Uncertainty
ROLL_COVARIANCE: Final = 48
"""Six places, see `uncertainty`."""
PITCH_COVARIANCE: Final = 54
LENGTH: Final = 60
"""Smoothed length of the reference, m/s^2."""
REST_SUM: Final = 61
"""All rest so far that bears on the bias, s."""
STATE_SIZE: Final = 62

# Forms of the filter
STILL: Final = 0
"""Without a model of motion: the specific force points up."""
WING: Final = 1
ROTOR: Final = 2
