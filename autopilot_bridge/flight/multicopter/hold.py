"""Tasks that fly smoothly in the air and stay idle on the ground: hold a position, brake.

Fly to a position and hold there.
"""

import math
from abc import ABC, abstractmethod

import numpy as np

from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase, TaskFinished
from autopilot_bridge.flight.heading import Turn
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.multicopter.takeoff import TakeoffRamp
from autopilot_bridge.flight.task import SpeedKind, TaskStatus
from autopilot_bridge.navigation import layout as nav_layout
from flightsim.foundation.vectors import wrap_pi


class CruiseTask(ABC):
    """A flight task that never takes off by itself: on the ground it keeps the motors at idle."""

    def __init__(self) -> None:
        self._motion: SmoothMotion | None = None
        self._ramp: TakeoffRamp | None = None

    def activate(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.CRUISE
        self._motion = SmoothMotion(ctx)
        self._ramp = TakeoffRamp(ctx)
        self._begin(ctx, self._motion)

    def update(self, ctx: FlightContext) -> TaskStatus:
        motion, ramp = self._motion, self._ramp
        if motion is None or ramp is None:
            self.activate(ctx)
            return self.update(ctx)
        if not ramp.update(ctx, False, 0.0):
            motion.restart(ctx)
            return TaskStatus.RUNNING
        motion.synchronise(ctx)
        return self._fly(ctx, motion)

    @abstractmethod
    def _begin(self, ctx: FlightContext, motion: SmoothMotion) -> None:
        """Start from the present state."""

    @abstractmethod
    def _fly(self, ctx: FlightContext, motion: SmoothMotion) -> TaskStatus:
        """Update the motion, which is synchronised with the vehicle, and write the setpoint."""


class HoldTask(CruiseTask):
    """Brake within the limits, then hold the position; or fly to a given position and hold it.

    On the ground it stays at idle. Without a position it stops by velocity; without a velocity it
    flies level.

    Args:
        position_ned_m: position to hold, (3,); None: where the vehicle comes to rest.
        yaw_rad: heading to hold; None: the present one.
    """

    def __init__(self, position_ned_m: Array | None = None, yaw_rad: float | None = None) -> None:
        super().__init__()
        self._target = None if position_ned_m is None else np.array(position_ned_m, dtype=np.float64)
        self._yaw_rad = math.nan if yaw_rad is None else yaw_rad

    def _begin(self, ctx: FlightContext, motion: SmoothMotion) -> None:
        """Nothing to set: the motion starts from the present state."""

    def _fly(self, ctx: FlightContext, motion: SmoothMotion) -> TaskStatus:
        if self._target is None:
            motion.brake(ctx)
        else:
            motion.fly_to(ctx, self._target)
        motion.steer(ctx, motion.heading.yaw_rad if math.isnan(self._yaw_rad) else self._yaw_rad)
        motion.write(ctx)
        return TaskStatus.RUNNING


class BrakeTask(CruiseTask):
    """Stop as fast as the limits allow and hold (ArduPilot BRAKE); DONE when stopped."""

    def __init__(self) -> None:
        super().__init__()
        self._done = False

    def _begin(self, ctx: FlightContext, motion: SmoothMotion) -> None:
        self._done = False

    def _fly(self, ctx: FlightContext, motion: SmoothMotion) -> TaskStatus:
        motion.brake(ctx)
        motion.steer(ctx, motion.heading.yaw_rad)
        motion.write(ctx)
        if motion.stopped and not self._done:
            self._done = True
            ctx.events.append(TaskFinished("brake"))
        return TaskStatus.DONE if self._done else TaskStatus.RUNNING


_WANTS_UP_M = 0.3


class GotoTask:
    """Fly straight to a position with limited speed, acceleration and jerk, then hold it. DONE on arrival.

    On the ground it takes off when the position is above the vehicle (as PX4 does on DO_REPOSITION).

    Args:
        position_ned_m: position, (3,); NaN components: where the vehicle comes to rest.
        yaw_rad: heading; NaN: by the vehicle's yaw behaviour.
        turn: a commanded turn on the way, flown while `yaw_rad` is NaN.
        speed_m_s: None: the cruise speed.
        acceptance_m: distance at which the position counts as reached; None: the parameter.
    """

    def __init__(
        self,
        position_ned_m: Array,
        *,
        yaw_rad: float = math.nan,
        turn: Turn | None = None,
        speed_m_s: float | None = None,
        acceptance_m: float | None = None,
    ) -> None:
        self._wanted: Array = np.array(position_ned_m, dtype=np.float64)
        self._place: Array = self._wanted.copy()
        self._yaw_rad = yaw_rad
        self._yaw_rate_rad_s = math.nan
        self._yaw_age_s = 0.0
        self._turn = turn
        self._speed_m_s = speed_m_s
        self._acceptance_m = acceptance_m
        self._motion: SmoothMotion | None = None
        self._ramp: TakeoffRamp | None = None
        self._reached = False

    def set_target(
        self,
        ctx: FlightContext,
        position_ned_m: Array,
        *,
        yaw_rad: float = math.nan,
        speed_m_s: float | None = None,
    ) -> None:
        """Set another target, without a stop."""
        self._wanted[:] = position_ned_m
        self._yaw_rad = yaw_rad
        self._speed_m_s = speed_m_s
        self._reached = False
        if self._motion is not None:
            self._begin(ctx, self._motion)

    def set_yaw(self, yaw_rad: float, yaw_rate_rad_s: float) -> None:
        """Set the heading or its rate; NaN: not given. The rate ends after GUID_TIMEOUT."""
        self._yaw_rad = yaw_rad
        self._yaw_rate_rad_s = yaw_rate_rad_s
        self._yaw_age_s = 0.0

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Change the speed (DO_CHANGE_SPEED)."""
        if kind in (SpeedKind.AIRSPEED, SpeedKind.GROUND_SPEED):
            self._speed_m_s = speed_m_s
        if self._motion is not None:
            self._motion.change_speed(ctx, kind, speed_m_s)

    def _begin(self, ctx: FlightContext, motion: SmoothMotion) -> None:
        motion.trajectory.set_limits(ctx.multicopter, speed_m_s=self._speed_m_s)
        motion.begin_leg()
        position, velocity = motion.trajectory.position_ned_m, motion.trajectory.velocity_ned_m_s
        acc = ctx.multicopter.acceleration_m_s2
        stop_ahead = float(np.hypot(velocity[0], velocity[1])) / (2.0 * acc)
        self._place[:] = np.where(np.isfinite(self._wanted), self._wanted, position + velocity * stop_ahead)

    def activate(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.CRUISE
        self._reached = False
        self._ramp = TakeoffRamp(ctx)
        self._motion = SmoothMotion(ctx)
        self._begin(ctx, self._motion)

    def update(self, ctx: FlightContext) -> TaskStatus:
        motion, ramp = self._motion, self._ramp
        if motion is None or ramp is None:
            self.activate(ctx)
            return self.update(ctx)
        position = ctx.nav[nav_layout.POS_NED_M]
        wants_up = float(position[2] - self._place[2]) > _WANTS_UP_M
        if not ramp.update(ctx, wants_up, ctx.multicopter.takeoff_speed_m_s):
            motion.restart(ctx)
            return TaskStatus.RUNNING
        motion.synchronise(ctx)
        motion.fly_to(ctx, self._place)
        self._steer(ctx, motion)
        motion.write(ctx)
        if not self._reached:
            radius = ctx.multicopter.acceptance_radius_m if self._acceptance_m is None else self._acceptance_m
            away = math.dist(position, self._place)
            if away < radius and ctx.position_valid and motion.stopped:
                self._reached = True
                ctx.events.append(TaskFinished("goto"))
        return TaskStatus.DONE if self._reached else TaskStatus.RUNNING

    def _steer(self, ctx: FlightContext, motion: SmoothMotion) -> None:
        """Update the heading by one tick."""
        rate_rad_s = self._yaw_rate_rad_s
        if math.isnan(rate_rad_s):
            motion.steer(ctx, self._yaw_rad, self._place, turn=self._turn)
            return
        self._yaw_age_s += ctx.dt_s
        if self._yaw_age_s > ctx.multicopter.guided_timeout_s:
            self.set_yaw(motion.heading.yaw_rad, math.nan)
            motion.steer(ctx, self._yaw_rad)
        elif math.isnan(self._yaw_rad):
            motion.heading.turn(rate_rad_s, ctx.multicopter, ctx.dt_s)
        else:
            wanted = wrap_pi(self._yaw_rad + rate_rad_s * self._yaw_age_s)
            motion.steer(ctx, wanted, yaw_rate_rad_s=rate_rad_s)


class RepositionTask(GotoTask):
    """DO_REPOSITION: a `GotoTask` that keeps holding the position and is never DONE."""

    def update(self, ctx: FlightContext) -> TaskStatus:
        super().update(ctx)
        return TaskStatus.RUNNING
