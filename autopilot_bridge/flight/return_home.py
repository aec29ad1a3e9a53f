"""Return to home and land: PX4's Return and ArduPilot's RTL, told apart by parameters only."""

import math
from enum import IntEnum

import numpy as np

from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase
from autopilot_bridge.flight.ground import TakeoffRamp
from autopilot_bridge.flight.land import LandTask
from autopilot_bridge.flight.motion import SmoothMotion
from autopilot_bridge.flight.parameters import FlightParameters
from autopilot_bridge.flight.task import SpeedKind, TaskStatus
from autopilot_bridge.navigation import layout as nav_layout


class ReturnPhase(IntEnum):
    """Where the return stands."""

    CLIMB = 0
    FLY = 1
    DESCEND = 2
    LOITER = 3
    LAND = 4


def return_height(distance_m: float, height_m: float, parameters: FlightParameters) -> float:
    """Height over home to fly home at.

    Never lower than now; otherwise the return altitude, and near home only as high as the cone around home
    (PX4 RTL_CONE_ANG within RTL_MIN_DIST; ArduPilot RTL_CONE_SLOPE everywhere) asks for.
    """
    p = parameters
    wanted = p.return_altitude_m
    if p.return_cone_half_angle_rad > 0.0 and distance_m <= p.return_min_distance_m:
        tangent = math.tan(p.return_cone_half_angle_rad)
        floor = min(wanted, p.return_descend_altitude_m)
        wanted = min(wanted, max(distance_m / tangent, floor))
    return max(height_m + p.return_climb_min_m, wanted)


class ReturnTask:
    """Climb, fly home, descend, wait, land. Without a home or a position it lands where it is.

    With a negative loiter time it stays over home (PX4 RTL_LAND_DELAY = -1).

    Attributes:
        phase: see `ReturnPhase`.
    """

    __slots__ = ("_land", "_motion", "_ramp", "_target", "_wait_s", "phase")

    def __init__(self) -> None:
        self.phase = ReturnPhase.CLIMB
        self._motion: SmoothMotion | None = None
        self._ramp: TakeoffRamp | None = None
        self._land: LandTask | None = None
        self._target: Array = np.zeros(3)
        self._wait_s = 0.0

    def activate(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.CRUISE
        self.phase = ReturnPhase.CLIMB
        self._wait_s = 0.0
        self._land = None
        self._ramp = TakeoffRamp(ctx)
        self._motion = SmoothMotion(ctx, speed_m_s=ctx.multicopter.return_speed_m_s)
        if not self._can_return(ctx):
            self._start_landing(ctx)
            return
        position = self._motion.trajectory.position_ned_m
        velocity = self._motion.trajectory.velocity_ned_m_s
        home = ctx.home_ned_m
        distance = math.hypot(float(home[0] - position[0]), float(home[1] - position[1]))
        height = return_height(distance, float(home[2] - position[2]), ctx.multicopter)
        # the climb ends where braking ends
        brake_s = float(np.hypot(velocity[0], velocity[1])) / (2.0 * ctx.multicopter.acceleration_m_s2)
        self._target[:] = position + velocity * brake_s
        self._target[2] = float(home[2]) - height

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Another speed on the way home (DO_CHANGE_SPEED); the landing has speeds of its own."""
        if self._motion is None:
            return
        horizontal = kind in (SpeedKind.AIRSPEED, SpeedKind.GROUND_SPEED)
        if speed_m_s is None and horizontal:
            speed_m_s = ctx.multicopter.return_speed_m_s
        self._motion.change_speed(ctx, kind, speed_m_s)

    @staticmethod
    def _can_return(ctx: FlightContext) -> bool:
        return ctx.position_valid and math.isfinite(float(ctx.home_ned_m.sum()))

    def _start_landing(self, ctx: FlightContext) -> None:
        self.phase = ReturnPhase.LAND
        over_home = self._can_return(ctx)
        yaw = ctx.home_yaw_rad
        self._land = LandTask(
            ctx.home_ned_m.copy() if over_home else None,
            yaw if over_home and math.isfinite(yaw) else None,
        )
        self._land.activate(ctx)

    def _close(self, ctx: FlightContext, motion: SmoothMotion, horizontal_m: float) -> bool:
        position = ctx.nav[nav_layout.POS_NED_M]
        away = math.hypot(float(position[0] - self._target[0]), float(position[1] - self._target[1]))
        height_error = abs(float(position[2] - self._target[2]))
        return away < horizontal_m and height_error < ctx.multicopter.acceptance_altitude_m and motion.stopped

    def _advance(self, ctx: FlightContext, motion: SmoothMotion) -> None:
        """Go on to the next phase when this one is done."""
        p = ctx.multicopter
        home_down = float(ctx.home_ned_m[2])
        low_down = max(float(self._target[2]), home_down - p.return_descend_altitude_m)
        if self.phase is ReturnPhase.CLIMB and self._close(ctx, motion, math.inf):
            self.phase = ReturnPhase.FLY
            self._target[0:2] = ctx.home_ned_m[0:2]
        elif self.phase is ReturnPhase.FLY and self._close(ctx, motion, p.acceptance_radius_m):
            self.phase = ReturnPhase.LOITER if p.return_loiters_high else ReturnPhase.DESCEND
            if self.phase is ReturnPhase.DESCEND:
                self._target[2] = low_down
        elif self.phase is ReturnPhase.DESCEND and self._close(ctx, motion, p.acceptance_radius_m):
            self.phase = ReturnPhase.LOITER
        else:
            return
        motion.begin_leg()

    def update(self, ctx: FlightContext) -> TaskStatus:
        motion, ramp = self._motion, self._ramp
        if motion is None or ramp is None:
            self.activate(ctx)
            return self.update(ctx)
        if self._land is not None:
            return self._land.update(ctx)
        if not ramp.update(ctx, False, 0.0):
            motion.restart(ctx)
            return TaskStatus.DONE
        if not self._can_return(ctx):
            self._start_landing(ctx)
            return TaskStatus.RUNNING
        motion.synchronise(ctx)
        self._advance(ctx, motion)
        if self.phase is ReturnPhase.LOITER:
            wait = ctx.multicopter.return_loiter_time_s
            self._wait_s += ctx.dt_s
            if 0.0 <= wait <= self._wait_s:
                self._start_landing(ctx)
                assert self._land is not None
                return self._land.update(ctx)
        motion.fly_to(ctx, self._target)
        over_home = self.phase in (ReturnPhase.DESCEND, ReturnPhase.LOITER)
        climbing = self.phase is ReturnPhase.CLIMB
        yaw = ctx.home_yaw_rad if over_home else (motion.heading.yaw_rad if climbing else math.nan)
        motion.steer(ctx, yaw, self._target)
        motion.write(ctx)
        return TaskStatus.RUNNING
