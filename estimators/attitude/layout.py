"""Layout of the attitude filter's state: one float64 array that the compiled step works on in place.

Each index is named after the quantity at it; a vector occupies three places from its index. FRD is the body
frame (forward, right, down); level is the body frame without roll and pitch. SI units, radians.
"""

from typing import Final

from flightsim.foundation.layouts import Slots

_at = Slots()
# The current sample, written as a block before each step
FORM: Final = _at.place()
"""STILL, WING or ROTOR."""
DISARMED: Final = _at.place()
"""1: the vehicle cannot be flying."""
ELAPSED: Final = _at.place()
"""Time since the previous sample, s; 0 at the first."""
SAMPLE_FORCE: Final = _at.place(3)
"""Specific force, m/s^2, FRD."""
SAMPLE_RATE: Final = _at.place(3)
"""Measured angular rate, rad/s, FRD."""
SAMPLE_FORMAT: Final = f"{_at.size - FORM}d"

# Attitude
DOWN: Final = _at.place(3)
"""Unit vector down in FRD, the third row of `r_level_from_frd`. It contains roll and pitch, and no yaw."""
GYRO_BIAS: Final = _at.place(3)
"""Bias of the gyro (reading minus true rate), rad/s."""
RATE: Final = _at.place(3)
"""Newest measured angular rate, rad/s; NaN before the first sample."""

# Received air data
AIRSPEED: Final = _at.place()
"""Newest true airspeed, m/s; NaN: none, or too old."""
AIRSPEED_FRESH: Final = _at.place()
"""1: not yet used."""
CLIMB: Final = _at.place()
"""Newest rate of climb, m/s; NaN: none."""
THROTTLE: Final = _at.place()
"""Newest throttle, 0..1; NaN: none."""

# Quantities derived from the air data
VELOCITY: Final = _at.place(3)
"""Velocity against the air in FRD, m/s."""
SPEED: Final = _at.place()
"""Filtered true airspeed of the fixed-wing form, m/s; NaN: none yet."""
SPEED_ERROR: Final = _at.place()
"""Measured minus filtered airspeed, m/s."""
ALPHA: Final = _at.place()
"""Angle of attack, rad."""
ALPHA_MEAN: Final = _at.place()
"""Angle of attack that makes the mean lift, rad."""
BETA: Final = _at.place()
"""Sideslip, rad."""
LIFT: Final = _at.place()
"""Mean lift acceleration per square of airspeed, 1/m; 0: not yet known."""
LIFT_SUM: Final = _at.place()
LIFT_WEIGHT: Final = _at.place()
CLIMB_WEIGHT: Final = _at.place()
"""These sums belong to the means from which lift and angle of attack are learned."""
DRAG: Final = _at.place()
"""Drag acceleration of a multirotor per speed, 1/s."""
SPEED_SQUARE: Final = _at.place()
"""Square of the speed, summed over time for learning the drag, m^2/s."""
FORCE_SQUARE: Final = _at.place()
"""Square of the sideways force, summed in the same way, m^2/s^3."""
SIDEWAYS: Final = _at.place(2)
"""Smoothed forward and right specific force, m/s^2 (two places)."""

# Rest
AGE: Final = _at.place()
"""Time filtered since the start, s."""
REST_TIME: Final = _at.place()
"""Time since the last motion, s."""
REST_SUM: Final = _at.place()
"""Total time at rest that is used for the bias, s."""
MEAN_RATE: Final = _at.place(3)
"""Slow mean of the measured rate, rad/s."""
MEAN_FORCE: Final = _at.place(3)
"""Low pass of the specific force in a frame that does not turn, given in FRD, m/s^2; NaN: none."""
SLOW_FORCE: Final = _at.place(3)
"""Slow mean of the specific force, m/s^2, FRD."""

# The newest correction
REFERENCE: Final = _at.place(3)
"""Direction down according to accelerometer and motion: m/s^2, FRD, of length g when both agree."""
LENGTH: Final = _at.place()
"""Smoothed length of the reference, m/s^2."""
WEIGHT: Final = _at.place()
"""Trust in the reference, 0..1."""
SLOW_INNOVATION: Final = _at.place(3)
"""Smoothed cross product of the directions of reference and estimate, FRD."""
INNOVATION: Final = _at.place()
"""Angle between reference and estimate, rad."""

# Uncertainty
ROLL_COVARIANCE: Final = _at.place(6)
"""First of six places, see `uncertainty`."""
PITCH_COVARIANCE: Final = _at.place(6)
STATE_SIZE: Final = _at.size

# Forms of the filter
STILL: Final = 0
"""Without a model of motion (rovers, boats): the mean specific force is taken as the direction up."""
WING: Final = 1
ROTOR: Final = 2
