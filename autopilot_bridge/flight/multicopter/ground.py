"""Leaving the ground: motors idle until a task commands a climb, spool up, then thrust rises to lift-off.

PX4's take-off states (`Takeoff`): disarmed, spool-up, ready, ramp-up, flight.
"""

import math
from enum import IntEnum
from typing import Final

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.task import clear_setpoint
from autopilot_bridge.navigation import layout as nav_layout

_RAMP_START_M_S: Final = 2.5  # downwards: with the default velocity gain that is no thrust at all
_LIFT_OFF_M: Final = 0.15
_LIFT_OFF_SPEED_M_S: Final = 0.4
_LEAVE_GROUND_S: Final = 4.0


class GroundState(IntEnum):
    """The stage of leaving the ground."""

    RESTING = 0
    SPOOLING = 1
    RAMPING = 2
    FLYING = 3


class TakeoffRamp:
    """Keeps the vehicle on the ground until the task commands a climb, then lifts it off.

    Attributes:
        state: see `GroundState`.
        ramping: the thrust is rising (landed state TAKEOFF).
    """

    def __init__(self, ctx: FlightContext) -> None:
        self.state = GroundState.RESTING if ctx.on_ground else GroundState.FLYING
        self._since_s = 0.0
        self._start_down_m = 0.0
        self._left_ground = not ctx.on_ground

    def _enter(self, state: GroundState) -> None:
        self.state = state
        self._since_s = 0.0

    def update(self, ctx: FlightContext, wants_up: bool, climb_speed_m_s: float) -> bool:
        """True when the task's own setpoint may be flown; otherwise this method has written the setpoint."""
        self._since_s += ctx.dt_s
        if not ctx.armed:
            self._enter(GroundState.RESTING if ctx.on_ground else GroundState.FLYING)
            clear_setpoint(ctx.setpoint, sp.OFF)
            return False
        if self.state is GroundState.FLYING:
            self._left_ground = self._left_ground or not ctx.on_ground
            if not ctx.on_ground or (not self._left_ground and self._since_s < _LEAVE_GROUND_S):
                return True
            self._enter(GroundState.RESTING)
        if self.state is GroundState.RESTING:
            if not ctx.on_ground:
                self._enter(GroundState.FLYING)
                self._left_ground = True
                return True
            if wants_up:
                self._enter(GroundState.SPOOLING)
        elif not wants_up:
            self._enter(GroundState.RESTING)
        if self.state is GroundState.SPOOLING and self._since_s >= ctx.multicopter.spoolup_time_s:
            self._enter(GroundState.RAMPING)
            self._start_down_m = float(ctx.nav[nav_layout.POS_NED_M][2])
        if self.state is not GroundState.RAMPING:
            clear_setpoint(ctx.setpoint, sp.IDLE)
            return False
        climbed_m = self._start_down_m - float(ctx.nav[nav_layout.POS_NED_M][2])
        climb_rate_m_s = -float(ctx.nav[nav_layout.VEL_NED_M_S][2])
        if climbed_m > _LIFT_OFF_M or climb_rate_m_s > _LIFT_OFF_SPEED_M_S:
            self._enter(GroundState.FLYING)
            self._left_ground = False
            return True
        ramp_time_s = ctx.multicopter.takeoff_ramp_time_s
        part = 1.0 if ramp_time_s <= 0.0 else min(1.0, self._since_s / ramp_time_s)
        clear_setpoint(ctx.setpoint, sp.TRAJECTORY)
        # level until lift-off: on the ground any tilt would cause a slide
        ctx.setpoint[sp.ACC_HORIZONTAL] = 0.0
        ctx.setpoint[sp.VEL + 2] = _RAMP_START_M_S * (1.0 - part) - climb_speed_m_s * part
        ctx.setpoint[sp.YAW_RAD] = math.nan
        ctx.setpoint[sp.YAW_RATE_RAD_S] = 0.0
        return False
