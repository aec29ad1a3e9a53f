"""The fixed-wing setpoint of a flight task as plain numbers, written to the control laws at once."""

import math
from typing import Final

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import FlightContext

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
