"""Flight without a position: a gentle bank at the present height, later a descent."""

import math

from autopilot_bridge.flight.context import FlightContext, FlightPhase, TouchedDown
from autopilot_bridge.flight.fixed_wing.base import AircraftTask
from autopilot_bridge.flight.fixed_wing.state import FlightCommand
from autopilot_bridge.flight.task import TaskStatus


class PositionLost:
    """PX4's FW_GPSF_R and FW_GPSF_LT: bank and hold the height, and sink after a while.

    Attributes:
        time_s: since the position was lost.
    """

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


class DescendTask(AircraftTask):
    """Spiral down at the bank of a lost position; wings level near the ground, throttle idle in the flare.

    DONE on the ground.
    """

    def __init__(self) -> None:
        super().__init__()
        self._lost = PositionLost()
        self._was_in_air = False

    def _begin(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.LANDING
        self._lost.reset()

    def _rest(self, ctx: FlightContext) -> TaskStatus:
        super()._rest(ctx)
        if self._was_in_air:
            self._was_in_air = False
            ctx.phase = FlightPhase.CRUISE
            ctx.events.append(TouchedDown())
        return TaskStatus.DONE

    def _fly(self, ctx: FlightContext) -> TaskStatus:
        self._was_in_air = True
        p, state, command = ctx.fixed_wing, self._state, self._command
        self._lost.fly(ctx, command, p.loiter_radius_m)
        height = state.height_above_ground_m - p.standing_height_m
        if height != height:
            height = ctx.height_above_home_m
        low_m = max(4.0 * p.flare_height_m, p.flare_time_s * 2.0 * p.position_lost_sink_m_s)
        command.height_rate_m_s = -p.position_lost_sink_m_s
        if height < low_m:
            command.roll_rad = 0.0
        if height < max(p.flare_height_m, p.flare_time_s * max(0.0, state.vel_down_m_s)):
            command.height_rate_m_s = -p.flare_sink_m_s
            command.throttle = p.throttle_idle
            command.pitch_min_rad = p.flare_pitch_min_rad
            command.pitch_max_rad = p.flare_pitch_max_rad
        command.write(ctx)
        return TaskStatus.RUNNING
