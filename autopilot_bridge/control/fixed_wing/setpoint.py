"""Layout of the fixed-wing control setpoint: the command of a flight task to the fixed-wing control laws.

One preallocated float64 array, written by the active flight task at 50 Hz, read by the control kernels. At
level `FLY` the lateral and the longitudinal part stand for themselves, as PX4 1.16's FixedWingLateralSetpoint
and FixedWingLongitudinalSetpoint do. NaN means "not given": lateral, the first one given of roll, course,
heading counts (lateral acceleration adds to course or heading, or stands alone); longitudinal, a given pitch
or throttle goes past the total-energy control, and what is left is flown by it.

`LEVEL` has the place and the values of `control.setpoint`; `TRAJECTORY` isn't flown by a fixed wing.
"""

from typing import Final

from autopilot_bridge.control.multicopter import setpoint as multicopter

COURSE_RAD: Final = 0  # direction over ground to fly
HEADING_RAD: Final = 1  # direction through the air (of the nose, without sideslip) to fly
LATERAL_ACCELERATION_M_S2: Final = 2  # to the right; feed-forward of a curved path
ROLL_RAD: Final = 3  # bank angle, past the lateral guidance
DOWN_M: Final = 4  # height to fly, local NED
HEIGHT_RATE_M_S: Final = 5  # climb rate, up; alone, or as the slope of the path `DOWN_M` is on
AIRSPEED_M_S: Final = 6  # equivalent airspeed; NaN: the trim airspeed of the parameters
PITCH_RAD: Final = 7  # pitch angle of the body, past the total-energy control
THROTTLE: Final = 8  # 0..1, past the total-energy control; 0 stops the propeller
RATES_FRD_RAD_S: Final = slice(9, 12)  # level RATES
SURFACES: Final = slice(12, 15)  # level SURFACES: aileron, elevator, rudder, -1..1
STEERING_HEADING_RAD: Final = 15  # the wheels and the rudder hold this heading on the ground; NaN: off
PITCH_MIN_RAD: Final = 16  # limit of the total-energy control's pitch; NaN: the parameter's
PITCH_MAX_RAD: Final = 17
THROTTLE_MAX: Final = 18  # limit of the total-energy control's throttle; NaN: the parameter's
LEVEL: Final = multicopter.LEVEL  # 19
ROLL_LIMIT_RAD: Final = 20  # of the lateral guidance; NaN: the parameter's (wing tips near the ground)
FLAPS: Final = 21  # 0..1; NaN: 0
BRAKE: Final = 22  # 0..1; NaN: 0
YAW_STICK: Final = 23  # -1..1, added to the coordinating rudder; NaN: 0
SETPOINT_SIZE: Final = 24

# values of LEVEL
OFF: Final = multicopter.OFF  # propeller stopped, surfaces neutral
IDLE: Final = multicopter.IDLE  # armed, propeller stopped, surfaces neutral
RATES: Final = multicopter.RATES  # body rates and THROTTLE
FLY: Final = 5.0
SURFACES_DIRECT: Final = 6.0  # SURFACES and THROTTLE as they are (MANUAL)
