"""Pointing the nose of a multicopter at a region of interest, whatever heading its task commands."""

import math

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.heading import Turn
from autopilot_bridge.flight.multicopter.yaw import YawSteering


class Nose:
    """Replaces the heading of a setpoint that a task has written."""

    __slots__ = ("_heading",)

    def __init__(self) -> None:
        self._heading = YawSteering()

    def point(self, ctx: FlightContext, yaw_rad: float, turn: Turn | None = None) -> None:
        """Turn towards a heading; if it is NaN, by the commanded turn; without a turn the task's heading is
        kept.
        """
        setpoint = ctx.setpoint
        if setpoint[sp.LEVEL] != sp.TRAJECTORY:
            return
        if math.isnan(yaw_rad) and turn is None:
            yaw, rate = float(setpoint[sp.YAW_RAD]), float(setpoint[sp.YAW_RATE_RAD_S])
            if math.isfinite(yaw):
                self._heading.reset(yaw, rate if math.isfinite(rate) else 0.0)
            return
        if turn is not None and math.isnan(yaw_rad):
            self._heading.follow(turn, ctx.multicopter, ctx.dt_s)
        else:
            self._heading.turn_to(yaw_rad, ctx.multicopter, ctx.dt_s)
        setpoint[sp.YAW_RAD] = self._heading.yaw_rad
        setpoint[sp.YAW_RATE_RAD_S] = self._heading.rate_rad_s
