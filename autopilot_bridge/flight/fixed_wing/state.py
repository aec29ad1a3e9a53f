"""The aircraft as its flight tasks see it: the navigation state in plain numbers, read once per update.

The fixed-wing setpoint of a flight task as plain numbers, written to the control laws at once.
"""

import math
from typing import Final

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.navigation import layout as nav_layout

_SLOW_M_S: Final = 1.0  # below this speed over ground the course means nothing: the nose's direction counts


class AircraftState:
    """Navigation state of one update, local NED, as floats.

    Attributes:
        north_m, east_m, down_m: position.
        vel_north_m_s, vel_east_m_s, vel_down_m_s: over ground.
        wind_north_m_s, wind_east_m_s: 0 while not estimated, so that air and ground are one.
        ground_speed_m_s, course_rad: horizontal velocity; course is the nose's direction when (nearly) still.
        airspeed_m_s: equivalent airspeed; NaN when not known.
        lasting_airspeed_m_s: equivalent airspeed in the wind as it is estimated, without the gust of the
            moment; NaN when not known.
        true_airspeed_m_s: horizontal speed through the air.
        roll_rad, pitch_rad, yaw_rad: attitude.
        forward_force_m_s2: specific force along the body's x axis.
        height_above_ground_m: of the rangefinder; NaN when not known.
    """

    def __init__(self) -> None:
        self.north_m = self.east_m = self.down_m = 0.0
        self.vel_north_m_s = self.vel_east_m_s = self.vel_down_m_s = 0.0
        self.wind_north_m_s = self.wind_east_m_s = self.ground_speed_m_s = self.course_rad = 0.0
        self.airspeed_m_s = self.lasting_airspeed_m_s = self.true_airspeed_m_s = 0.0
        self.roll_rad = self.pitch_rad = self.yaw_rad = 0.0
        self.forward_force_m_s2 = self.height_above_ground_m = 0.0

    def read(self, ctx: FlightContext) -> None:
        """Take over the newest navigation state."""
        nav = ctx.nav.tolist()
        self.north_m, self.east_m, self.down_m = nav[nav_layout.POS_NED_M]
        self.vel_north_m_s, self.vel_east_m_s, self.vel_down_m_s = nav[nav_layout.VEL_NED_M_S]
        self.roll_rad, self.pitch_rad, self.yaw_rad = nav[nav_layout.EULER_RAD]
        self.forward_force_m_s2 = nav[nav_layout.FORCE]
        self.airspeed_m_s = nav[nav_layout.AIRSPEED_M_S]
        self.height_above_ground_m = nav[nav_layout.HEIGHT_ABOVE_GROUND_M]
        wind_north, wind_east = nav[nav_layout.WIND], nav[nav_layout.WIND + 1]
        wind_known = wind_north == wind_north and wind_east == wind_east
        if not wind_known:
            wind_north = wind_east = 0.0
        self.wind_north_m_s, self.wind_east_m_s = wind_north, wind_east
        self.ground_speed_m_s = math.hypot(self.vel_north_m_s, self.vel_east_m_s)
        self.true_airspeed_m_s = math.hypot(self.vel_north_m_s - wind_north, self.vel_east_m_s - wind_east)
        self.lasting_airspeed_m_s = math.nan
        true_m_s = nav[nav_layout.AIRSPEED_TRUE_M_S]
        if true_m_s > _SLOW_M_S and wind_known:
            self.lasting_airspeed_m_s = self.true_airspeed_m_s * self.airspeed_m_s / true_m_s
        self.course_rad = (
            math.atan2(self.vel_east_m_s, self.vel_north_m_s)
            if self.ground_speed_m_s > _SLOW_M_S
            else self.yaw_rad
        )


_NAN: Final = math.nan


class FlightCommand:
    """One setpoint of level FLY; NaN means not given. Fields as in `control.fixed_wing.setpoint`."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Nothing given."""
        self.course_rad = self.heading_rad = self.lateral_acceleration_m_s2 = self.roll_rad = _NAN
        self.down_m = self.height_rate_m_s = self.airspeed_m_s = self.pitch_rad = self.throttle = _NAN
        self.steering_heading_rad = self.pitch_min_rad = self.pitch_max_rad = self.throttle_max = _NAN
        self.roll_limit_rad = self.flaps = self.brake = self.yaw_stick = _NAN

    def clear_lateral(self) -> None:
        """Nothing given of course, heading, lateral acceleration, roll."""
        self.course_rad = self.heading_rad = self.lateral_acceleration_m_s2 = self.roll_rad = _NAN

    def write(self, ctx: FlightContext) -> None:
        """Write the setpoint. Without a height the pitch and throttle of level flight are flown."""
        if not ctx.altitude_valid:
            p = ctx.fixed_wing
            self.down_m = self.height_rate_m_s = _NAN
            if self.pitch_rad != self.pitch_rad:
                self.pitch_rad = p.trim_pitch_rad
            if self.throttle != self.throttle:
                self.throttle = p.trim_throttle
        setpoint = ctx.setpoint
        setpoint[:] = _NAN
        setpoint[sp.LEVEL] = sp.FLY
        setpoint[sp.COURSE_RAD] = self.course_rad
        setpoint[sp.HEADING_RAD] = self.heading_rad
        setpoint[sp.LATERAL_ACCELERATION_M_S2] = self.lateral_acceleration_m_s2
        setpoint[sp.ROLL_RAD] = self.roll_rad
        setpoint[sp.DOWN_M] = self.down_m
        setpoint[sp.HEIGHT_RATE_M_S] = self.height_rate_m_s
        setpoint[sp.AIRSPEED_M_S] = self.airspeed_m_s
        setpoint[sp.PITCH_RAD] = self.pitch_rad
        setpoint[sp.THROTTLE] = self.throttle
        setpoint[sp.STEERING_HEADING_RAD] = self.steering_heading_rad
        setpoint[sp.PITCH_MIN_RAD] = self.pitch_min_rad
        setpoint[sp.PITCH_MAX_RAD] = self.pitch_max_rad
        setpoint[sp.THROTTLE_MAX] = self.throttle_max
        setpoint[sp.ROLL_LIMIT_RAD] = self.roll_limit_rad
        setpoint[sp.FLAPS] = self.flaps
        setpoint[sp.BRAKE] = self.brake
        setpoint[sp.YAW_STICK] = self.yaw_stick
