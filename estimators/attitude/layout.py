"""Layout of the attitude filter's state: one float64 array that the compiled step works on in place.

Indices have the names of what they hold; vectors take three places from theirs on. FRD is the body (forward,
right, down), level is the body without roll and pitch. SI units, radians.
"""

from typing import Final

DOWN: Final = 0
"""Unit vector down in FRD, the third row of `r_level_from_frd`: all of roll and pitch, nothing of yaw."""
GYRO_BIAS: Final = 3
"""What the gyro reads too much, rad/s."""
RATE: Final = 6
"""Newest angular rate as measured, rad/s; NaN before the first sample."""

# The air as it was heard
AIRSPEED: Final = 9
"""Newest true airspeed, m/s; NaN: none, or an old one."""
AIRSPEED_FRESH: Final = 10
"""1: not yet used."""
CLIMB: Final = 11
"""Newest rate of climb, m/s; NaN: none."""
THROTTLE: Final = 12
"""Newest throttle, 0..1; NaN: none."""

# What is made of it
VELOCITY: Final = 13
"""Velocity against the air in FRD, m/s."""
SPEED: Final = 16
"""Filtered true airspeed of the fixed-wing form, m/s; NaN: none yet."""
SPEED_ERROR: Final = 17
"""Measured less filtered airspeed, m/s."""
ALPHA: Final = 18
"""Angle of attack, rad."""
ALPHA_MEAN: Final = 19
"""Angle of attack that makes the mean lift, rad."""
BETA: Final = 20
"""Sideslip, rad."""
LIFT: Final = 21
"""Mean lift acceleration per square of airspeed, 1/m; 0: not yet known."""
WING_TIME: Final = 22
"""How long there was lift to learn from, s."""
DRAG_TIME: Final = 23
"""Reciprocal of a rotorcraft's drag coefficient, s."""
DRAG_TIME_VARIANCE: Final = 24
SIDEWAYS: Final = 25
"""Smoothed forward and right specific force, m/s^2 (two places)."""

# Rest
AGE: Final = 27
"""Time filtered since the start, s."""
REST_TIME: Final = 28
"""How long nothing has moved, s."""
MEAN_RATE: Final = 29
"""Slow mean of the measured rate, rad/s."""
MEAN_FORCE: Final = 32
"""Slow mean of the specific force, m/s^2."""

# The newest correction
REFERENCE: Final = 35
"""Where the accelerometer and the model of motion say that down is: m/s^2, FRD, of length g when they agree."""
WEIGHT: Final = 38
"""Trust in it, 0..1."""
INNOVATION: Final = 39
"""Angle between reference and estimate, rad."""

# Uncertainty
ROLL_COVARIANCE: Final = 40
"""Six places, see `uncertainty`."""
PITCH_COVARIANCE: Final = 46
STATE_SIZE: Final = 52

# Forms of the filter
STILL: Final = 0
"""Without a model of motion: the specific force points up."""
WING: Final = 1
ROTOR: Final = 2
