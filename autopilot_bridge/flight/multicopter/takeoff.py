"""Vertical take-off.

Leaving the ground: motors idle until a task commands a climb, spool up, then thrust rises to lift-off.

PX4's take-off states (`Takeoff`): disarmed, spool-up, ready, ramp-up, flight.
"""

import math
from enum import IntEnum
from typing import Final

import numpy as np

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase, TaskFinished
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.multicopter.trajectory import SPEED_UP
from autopilot_bridge.flight.task import TaskStatus, clear_setpoint
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


_ARRIVAL_SPEED_M_S: Final = 0.5


class TakeoffTask:
    """Spool up, lift off, climb straight up to a height over home, hold there. DONE on arrival.

    A vehicle that is already flying only climbs; one above the height holds its position.

    Args:
        altitude_above_home_m: height to reach; None: the parameter. Over the start position while home is
            unset.
        climb_speed_m_s: None: the parameter.
        yaw_rad: heading during the climb; None: the present one.
    """

    def __init__(
        self,
        altitude_above_home_m: float | None = None,
        *,
        climb_speed_m_s: float | None = None,
        yaw_rad: float | None = None,
    ) -> None:
        if altitude_above_home_m is not None and not math.isfinite(altitude_above_home_m):
            raise ValueError(f"take-off altitude {altitude_above_home_m} m is not a finite number")
        self._altitude_m = altitude_above_home_m
        self._climb_m_s = climb_speed_m_s
        self._yaw_rad = math.nan if yaw_rad is None else yaw_rad
        self._motion: SmoothMotion | None = None
        self._ramp: TakeoffRamp | None = None
        self._place: Array = np.zeros(3)
        self._arrived = False

    @property
    def place_ned_m(self) -> Array:
        """Where the climb ends, (3,); a copy, valid after `activate`."""
        return self._place.copy()

    def _set_height(self, ctx: FlightContext) -> None:
        altitude = ctx.multicopter.takeoff_altitude_m if self._altitude_m is None else self._altitude_m
        down = float(ctx.nav[nav_layout.POS_NED_M][2])
        home = float(ctx.home_ned_m[2])
        self._place[2] = min(down, (down if math.isnan(home) else home) - altitude)

    def activate(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.TAKEOFF
        self._arrived = False
        self._motion = SmoothMotion(ctx)
        self._ramp = TakeoffRamp(ctx)
        self._place[0:2] = ctx.nav[nav_layout.POS_NED_M][0:2]
        self._set_height(ctx)

    def update(self, ctx: FlightContext) -> TaskStatus:
        motion, ramp = self._motion, self._ramp
        if motion is None or ramp is None:
            self.activate(ctx)
            return self.update(ctx)
        climb = ctx.multicopter.takeoff_speed_m_s if self._climb_m_s is None else self._climb_m_s
        if not ramp.update(ctx, True, climb):
            motion.restart(ctx)
            self._place[0:2] = ctx.nav[nav_layout.POS_NED_M][0:2]
            return TaskStatus.RUNNING
        motion.synchronise(ctx)
        motion.trajectory.limits[SPEED_UP] = climb
        motion.fly_to(ctx, self._place)
        motion.steer(ctx, motion.heading.yaw_rad if math.isnan(self._yaw_rad) else self._yaw_rad)
        motion.write(ctx)
        error = abs(float(ctx.nav[nav_layout.POS_NED_M][2]) - float(self._place[2]))
        slow = abs(float(motion.trajectory.velocity_ned_m_s[2])) < _ARRIVAL_SPEED_M_S
        if not self._arrived and error < 0.6 * ctx.multicopter.acceptance_altitude_m and slow:
            self._arrived = True
            ctx.phase = FlightPhase.CRUISE
            ctx.events.append(TaskFinished("takeoff"))
        return TaskStatus.DONE if self._arrived else TaskStatus.RUNNING
