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
from flightsim.foundation.records import Record, Vector3, place, size_of, vector


class Setpoint(Record):
    """The setpoint as kernels take it; its numbers follow each other in the array."""

    level: float
    course_rad: float  # direction over ground to fly
    heading_rad: float  # direction through the air (of the nose, without sideslip) to fly
    lateral_acceleration_m_s2: float  # to the right; feed-forward of a curved path
    roll_rad: float  # bank angle, past the lateral guidance
    down_m: float  # height to fly, local NED
    height_rate_m_s: float  # climb rate, up; alone, or as the slope of the path `DOWN_M` is on
    airspeed_m_s: float  # equivalent airspeed; NaN: the trim airspeed of the parameters
    pitch_rad: float  # pitch angle of the body, past the total-energy control
    throttle: float  # 0..1, past the total-energy control; 0 stops the propeller
    rates_frd_rad_s: Vector3  # level RATES
    surfaces: Vector3  # level SURFACES: aileron, elevator, rudder, -1..1
    steering_heading_rad: float  # held on the ground by wheels and rudder; NaN: off
    pitch_min_rad: float  # limit of the total-energy control's pitch; NaN: the parameter's
    pitch_max_rad: float
    throttle_max: float  # limit of the total-energy control's throttle; NaN: the parameter's
    roll_limit_rad: float  # of the lateral guidance; NaN: the parameter's (wing tips at the ground)
    flaps: float  # 0..1; NaN: 0
    brake: float  # 0..1; NaN: 0
    yaw_stick: float  # -1..1, added to the coordinating rudder; NaN: 0


LEVEL: Final = place(Setpoint, "level")
COURSE_RAD: Final = place(Setpoint, "course_rad")
HEADING_RAD: Final = place(Setpoint, "heading_rad")
LATERAL_ACCELERATION_M_S2: Final = place(Setpoint, "lateral_acceleration_m_s2")
ROLL_RAD: Final = place(Setpoint, "roll_rad")
DOWN_M: Final = place(Setpoint, "down_m")
HEIGHT_RATE_M_S: Final = place(Setpoint, "height_rate_m_s")
AIRSPEED_M_S: Final = place(Setpoint, "airspeed_m_s")
PITCH_RAD: Final = place(Setpoint, "pitch_rad")
THROTTLE: Final = place(Setpoint, "throttle")
RATES_FRD_RAD_S: Final = vector(Setpoint, "rates_frd_rad_s")
SURFACES: Final = vector(Setpoint, "surfaces")
STEERING_HEADING_RAD: Final = place(Setpoint, "steering_heading_rad")
PITCH_MIN_RAD: Final = place(Setpoint, "pitch_min_rad")
PITCH_MAX_RAD: Final = place(Setpoint, "pitch_max_rad")
THROTTLE_MAX: Final = place(Setpoint, "throttle_max")
ROLL_LIMIT_RAD: Final = place(Setpoint, "roll_limit_rad")
FLAPS: Final = place(Setpoint, "flaps")
BRAKE: Final = place(Setpoint, "brake")
YAW_STICK: Final = place(Setpoint, "yaw_stick")
SETPOINT_SIZE: Final = size_of(Setpoint)

# values of LEVEL
OFF: Final = multicopter.OFF  # propeller stopped, surfaces neutral
IDLE: Final = multicopter.IDLE  # armed, propeller stopped, surfaces neutral
RATES: Final = multicopter.RATES  # body rates and THROTTLE
FLY: Final = 5.0
SURFACES_DIRECT: Final = 6.0  # SURFACES and THROTTLE as they are (MANUAL)
