"""What any task flies while there is no position: a gentle bank at the present height, later a descent."""

import math

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.fixed_wing.command import FlightCommand


class PositionLost:
    """PX4's FW_GPSF_R and FW_GPSF_LT: bank and hold the height, and sink after a while.

    Attributes:
        time_s: since the position was lost.
    """

    __slots__ = ("time_s",)

    def __init__(self) -> None:
        self.time_s = 0.0

    def reset(self) -> None:
        """The position is there."""
        self.time_s = 0.0

    def found(self) -> bool:
        """True in the update in which the position is there again."""
        was_lost = self.time_s > 0.0
        self.time_s = 0.0
        return was_lost

    def fly(self, ctx: FlightContext, command: FlightCommand, direction: float) -> None:
        """Fill the lateral part (and the sink) of a command; direction 1 banks right, -1 left."""
        p = ctx.fixed_wing
        self.time_s += ctx.dt_s
        command.clear_lateral()
        command.roll_rad = math.copysign(p.position_lost_bank_rad, direction)
        if self.time_s > p.position_lost_wait_s:
            command.down_m = math.nan
            command.height_rate_m_s = -p.position_lost_sink_m_s
