"""Heading with limited rate and acceleration (PX4 MPC_YAWRAUTO_MAX, MPC_YAWRAUTO_ACC)."""

import math

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.heading import Turn
from autopilot_bridge.flight.parameters import FlightParameters
from flightsim.foundation.vectors import wrap_pi

_GAIN_1_S = 2.0


class YawSteering:
    """A heading that turns smoothly.

    Attributes:
        yaw_rad: heading now, -pi..pi.
        rate_rad_s: its rate.
    """

    def __init__(self) -> None:
        self.yaw_rad = 0.0
        self.rate_rad_s = 0.0

    def reset(self, yaw_rad: float, rate_rad_s: float = 0.0) -> None:
        """Start from a present heading."""
        self.yaw_rad = wrap_pi(yaw_rad)
        self.rate_rad_s = rate_rad_s

    def turn_to(
        self,
        target_rad: float,
        parameters: FlightParameters,
        dt_s: float,
        rate_max_rad_s: float | None = None,
        target_rate_rad_s: float = 0.0,
    ) -> None:
        """One tick of the shorter way to `target_rad`, which may itself turn at a rate; NaN stops the
        turn.
        """
        rate_max = parameters.yaw_rate_max_rad_s if rate_max_rad_s is None else rate_max_rad_s
        wanted = 0.0
        if math.isfinite(target_rad):
            wanted = target_rate_rad_s + _rate(wrap_pi(target_rad - self.yaw_rad), rate_max, parameters)
            wanted = min(rate_max, max(-rate_max, wanted))
        self.turn(wanted, parameters, dt_s)

    def follow(self, turn: Turn, parameters: FlightParameters, dt_s: float) -> None:
        """One tick of a commanded turn."""
        rate_max = parameters.yaw_rate_max_rad_s
        if turn.rate_max_rad_s is not None:
            rate_max = min(rate_max, turn.rate_max_rad_s)
        before = self.yaw_rad
        self.turn(_rate(turn.left_rad(before), rate_max, parameters), parameters, dt_s)
        turn.advance(wrap_pi(self.yaw_rad - before))

    def turn(self, rate_rad_s: float, parameters: FlightParameters, dt_s: float) -> None:
        """One tick towards a rate."""
        step = parameters.yaw_acceleration_rad_s2 * dt_s
        before = self.rate_rad_s
        self.rate_rad_s += min(step, max(-step, rate_rad_s - before))
        self.yaw_rad = wrap_pi(self.yaw_rad + 0.5 * (before + self.rate_rad_s) * dt_s)


def _rate(error_rad: float, rate_max_rad_s: float, parameters: FlightParameters) -> float:
    """Rate of a turn by an angle, slowing down towards its end."""
    size = abs(error_rad)
    braking = math.sqrt(1.6 * parameters.yaw_acceleration_rad_s2 * size)
    return math.copysign(min(rate_max_rad_s, _GAIN_1_S * size, braking), error_rad)


class Nose:
    """Replaces the heading of a setpoint that a task has written."""

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
