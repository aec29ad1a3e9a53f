"""Vertical take-off."""

import math
from typing import Final

import numpy as np

from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase, TaskFinished
from autopilot_bridge.flight.multicopter.ground import TakeoffRamp
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.multicopter.trajectory import SPEED_UP
from autopilot_bridge.flight.task import TaskStatus
from autopilot_bridge.navigation import layout as nav_layout

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
