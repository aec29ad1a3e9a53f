"""The controller's state as a record."""

from autopilot_bridge.control.controller import ControllerState
from flightsim.foundation.records import Vector3


class FixedWingState(ControllerState):
    """The controller's state, of a flight from `counter` on: zero at levels OFF and IDLE."""

    # state, kept until the physics rate changes
    # state of a flight: zero at levels OFF and IDLE
    counter: float  # physics steps since guidance ran
    last_level: float
    flying: float  # 1.0 once guidance has run since the level became FLY
    # air
    eas: float  # filtered equivalent airspeed, m/s; trim airspeed when it isn't known
    eas_rate: float  # its rate, m/s^2
    eas_to_tas: float  # true over equivalent airspeed
    eas_known: float  # 1.0 while the airspeed is known
    # lateral
    heading_setpoint: float  # through the air, rad; NaN where none is flown
    course_setpoint: float
    lateral_acceleration: float  # wanted, m/s^2
    roll_setpoint: float
    roll_limited: float  # bank limit in force
    # longitudinal
    height_reference: float  # up, local, m
    height_rate_reference: float  # of the height trajectory, m/s
    height_controlled: float  # 1.0 while the reference is flown
    height_rate_setpoint: float  # wanted climb rate, m/s; NaN where none is flown
    airspeed_setpoint: float  # equivalent, limits applied, m/s
    pitch_integral: float  # rad
    throttle_integral: float
    energy_rate: float  # specific total energy rate, low-passed, m^2/s^3
    energy_rate_setpoint: float
    balance_rate: float  # specific energy balance rate
    balance_rate_setpoint: float
    underspeed: float  # 0 none .. 1 full
    pitch_setpoint: float
    throttle: float
    # attitude
    rate_integral: Vector3  # surface
    rate_previous: Vector3  # FRD, rad/s
    rate_derivative: Vector3  # FRD, rad/s^2, low-passed
    unallocated: Vector3  # surface command beyond the stops
    wheel_integral: float
    airspeed_floor: float  # equivalent airspeed that the least ground speed requires, m/s
    powerless: float  # 0 the throttle does its work .. 1 the energy falls at full throttle
    climb_flown: float  # 1.0 while pitch alone flies the vertical speed
    liftless_pitch: float  # pitch over the path without lift, rad, low-passed
