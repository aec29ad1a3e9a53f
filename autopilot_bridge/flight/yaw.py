"""Heading with limited rate and acceleration (PX4 MPC_YAWRAUTO_MAX, MPC_YAWRAUTO_ACC)."""

import math

from autopilot_bridge.flight.parameters import FlightParameters

_GAIN_1_S = 2.0


def wrap_pi(angle_rad: float) -> float:
    """Angle wrapped to [-pi, pi)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


class YawSteering:
    """A heading that turns smoothly.

    Attributes:
        yaw_rad: heading now, -pi..pi.
        rate_rad_s: its rate.
    """

    __slots__ = ("rate_rad_s", "yaw_rad")

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
        """One tick of the shorter way to `target_rad`, which turns at a rate itself; NaN stops the turn."""
        rate_max = parameters.yaw_rate_max_rad_s if rate_max_rad_s is None else rate_max_rad_s
        acc = parameters.yaw_acceleration_rad_s2
        wanted = 0.0
        if math.isfinite(target_rad):
            error = wrap_pi(target_rad - self.yaw_rad)
            size = min(rate_max, _GAIN_1_S * abs(error), math.sqrt(1.6 * acc * abs(error)))
            wanted = target_rate_rad_s + math.copysign(size, error)
            wanted = min(rate_max, max(-rate_max, wanted))
        self.turn(wanted, parameters, dt_s)

    def turn(self, rate_rad_s: float, parameters: FlightParameters, dt_s: float) -> None:
        """One tick towards a rate."""
        step = parameters.yaw_acceleration_rad_s2 * dt_s
        before = self.rate_rad_s
        self.rate_rad_s += min(step, max(-step, rate_rad_s - before))
        self.yaw_rad = wrap_pi(self.yaw_rad + 0.5 * (before + self.rate_rad_s) * dt_s)
