"""Layout of the fixed-wing control setpoint: the command of a flight task to the fixed-wing control laws.

One preallocated float64 array, written by the active flight task at 50 Hz, read by the control kernels. At
level `FLY` the lateral and the longitudinal part stand for themselves, as PX4 1.16's FixedWingLateralSetpoint
and FixedWingLongitudinalSetpoint do. NaN means "not given": lateral, the first one given of roll, course,
heading counts (lateral acceleration adds to course or heading, or stands alone); longitudinal, a given pitch
or throttle goes past the total-energy control, and what is left is flown by it.

`LEVEL` has the place and the values of `control.multicopter.setpoint`; `TRAJECTORY` isn't flown by a
fixed wing.
"""

from typing import Final

from autopilot_bridge.control.multicopter import setpoint as multicopter
from flightsim.foundation.layouts import Slots

LEVEL: Final = multicopter.LEVEL
_at = Slots(LEVEL + 1)
COURSE_RAD: Final = _at.place()  # direction over ground to fly
HEADING_RAD: Final = _at.place()  # direction through the air (of the nose, without sideslip) to fly
LATERAL_ACCELERATION_M_S2: Final = _at.place()  # to the right; feed-forward of a curved path
ROLL_RAD: Final = _at.place()  # bank angle, past the lateral guidance
DOWN_M: Final = _at.place()  # height to fly, local NED
HEIGHT_RATE_M_S: Final = _at.place()  # climb rate, up; alone, or as the slope of the path `DOWN_M` is on
AIRSPEED_M_S: Final = _at.place()  # equivalent airspeed; NaN: the trim airspeed of the parameters
PITCH_RAD: Final = _at.place()  # pitch angle of the body, past the total-energy control
THROTTLE: Final = _at.place()  # 0..1, past the total-energy control; 0 stops the propeller
RATES_FRD_RAD_S: Final = _at.vector(3)  # level RATES
SURFACES: Final = _at.vector(3)  # level SURFACES: aileron, elevator, rudder, -1..1
STEERING_HEADING_RAD: Final = _at.place()  # held on the ground by wheels and rudder; NaN: off
PITCH_MIN_RAD: Final = _at.place()  # limit of the total-energy control's pitch; NaN: the parameter's
PITCH_MAX_RAD: Final = _at.place()
THROTTLE_MAX: Final = _at.place()  # limit of the total-energy control's throttle; NaN: the parameter's
ROLL_LIMIT_RAD: Final = _at.place()  # of the lateral guidance; NaN: the parameter's (wing tips at the ground)
FLAPS: Final = _at.place()  # 0..1; NaN: 0
BRAKE: Final = _at.place()  # 0..1; NaN: 0
YAW_STICK: Final = _at.place()  # -1..1, added to the coordinating rudder; NaN: 0
SETPOINT_SIZE: Final = _at.size

# values of LEVEL
OFF: Final = multicopter.OFF  # propeller stopped, surfaces neutral
IDLE: Final = multicopter.IDLE  # armed, propeller stopped, surfaces neutral
RATES: Final = multicopter.RATES  # body rates and THROTTLE
FLY: Final = 5.0
SURFACES_DIRECT: Final = 6.0  # SURFACES and THROTTLE as they are (MANUAL)
