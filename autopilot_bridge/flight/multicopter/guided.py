"""External targets, flown smoothly: ArduPilot's GUIDED.

Position targets need not be repeated; velocity, acceleration and attitude targets expire after GUID_TIMEOUT
and the vehicle stops. Attitude thrust is a climb rate: 0.5 holds the height, 1 is the full climb speed
(GUID_OPTIONS 0).
"""

import math

import numpy as np

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase
from autopilot_bridge.flight.heading import Turn
from autopilot_bridge.flight.multicopter.avoidance import limited_velocity
from autopilot_bridge.flight.multicopter.hold import GotoTask, HoldTask
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.multicopter.takeoff import TakeoffRamp
from autopilot_bridge.flight.task import NAN3, AnyVector, GuidedKind, SpeedKind, TaskStatus, clear_setpoint
from autopilot_bridge.navigation import layout as nav_layout


class GuidedTask:
    """Position, velocity, acceleration and attitude targets. They cause no take-off: command it first.

    Attributes:
        kind: the kind of the present target.
    """

    def __init__(self) -> None:
        self.kind = GuidedKind.HOLD
        self._position: Array = np.full(3, np.nan)
        self._velocity: Array = np.zeros(3)
        self._acceleration: Array = np.zeros(3)
        self._attitude: Array = np.array([1.0, 0.0, 0.0, 0.0])
        self._rates: Array = np.full(3, np.nan)
        self._climb_m_s = 0.0
        self._hover_down_m = math.nan
        self._yaw_rad = math.nan
        self._yaw_rate_rad_s = math.nan
        self._turn: Turn | None = None
        self._age_s = 0.0
        self._hold = HoldTask()
        self._goto: GotoTask | None = None
        self._goto_started = False
        self._motion: SmoothMotion | None = None
        self._ramp: TakeoffRamp | None = None

    def set_hold(self, ctx: FlightContext) -> None:
        """Stop and hold (after an unusable target)."""
        self.kind = GuidedKind.HOLD
        self._hold = HoldTask()
        self._hold.activate(ctx)

    def set_position(
        self,
        ctx: FlightContext,
        position_ned_m: AnyVector,
        *,
        yaw_rad: float = math.nan,
        yaw_rate_rad_s: float = math.nan,
        speed_m_s: float | None = None,
    ) -> None:
        """Fly to a position and stay; NaN components: keep the present ones. A yaw rate expires."""
        _note_commanded_yaw(ctx, yaw_rad, yaw_rate_rad_s)
        target = np.array(position_ned_m, dtype=np.float64)
        if self.kind is GuidedKind.POSITION and self._goto is not None and self._goto_started:
            # a repeated target is not a new leg
            if speed_m_s is not None or not np.array_equal(target, self._position, equal_nan=True):
                self._goto.set_target(ctx, target, speed_m_s=speed_m_s)
        else:
            self._goto = GotoTask(target, speed_m_s=speed_m_s)
            self._goto_started = False
        self._goto.set_yaw(yaw_rad, yaw_rate_rad_s)
        self._position[:] = target
        self.kind = GuidedKind.POSITION

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Set another speed on the way to a position (DO_CHANGE_SPEED); streamed targets contain their own
        speed.
        """
        if self.kind is GuidedKind.POSITION and self._goto is not None:
            self._goto.change_speed(ctx, kind, speed_m_s)

    def set_velocity(
        self,
        ctx: FlightContext,
        velocity_ned_m_s: AnyVector,
        *,
        acceleration_ned_m_s2: AnyVector = NAN3,
        yaw_rad: float = math.nan,
        yaw_rate_rad_s: float = math.nan,
    ) -> None:
        """Fly at a velocity until the timeout; NaN components are zero."""
        if self.kind is not GuidedKind.VELOCITY or self._motion is None:
            self._motion = SmoothMotion(ctx, speed_m_s=ctx.multicopter.max_speed_m_s)
        self._velocity[:] = np.nan_to_num(np.array(velocity_ned_m_s, dtype=np.float64), nan=0.0)
        self._acceleration[:] = acceleration_ned_m_s2
        _note_commanded_yaw(ctx, yaw_rad, yaw_rate_rad_s)
        self._set_streamed(GuidedKind.VELOCITY, yaw_rad, yaw_rate_rad_s)

    def set_acceleration(
        self,
        ctx: FlightContext,
        acceleration_ned_m_s2: AnyVector,
        *,
        yaw_rad: float = math.nan,
        yaw_rate_rad_s: float = math.nan,
    ) -> None:
        """Accelerate until the timeout; NaN components are zero."""
        if self.kind is not GuidedKind.ACCELERATION or self._motion is None:
            self._motion = SmoothMotion(ctx)
        self._acceleration[:] = np.nan_to_num(np.array(acceleration_ned_m_s2, dtype=np.float64), nan=0.0)
        _note_commanded_yaw(ctx, yaw_rad, yaw_rate_rad_s)
        self._set_streamed(GuidedKind.ACCELERATION, yaw_rad, yaw_rate_rad_s)

    def set_trajectory(
        self,
        ctx: FlightContext,
        position_ned_m: AnyVector,
        velocity_ned_m_s: AnyVector,
        *,
        acceleration_ned_m_s2: AnyVector = NAN3,
        yaw_rad: float = math.nan,
        yaw_rate_rad_s: float = math.nan,
    ) -> None:
        """Track a streamed position with its velocity and acceleration, until the timeout."""
        self._position[:] = position_ned_m
        self._velocity[:] = velocity_ned_m_s
        self._acceleration[:] = acceleration_ned_m_s2
        if self.kind is not GuidedKind.TRAJECTORY or self._motion is None:
            self._motion = SmoothMotion(ctx)
        _note_commanded_yaw(ctx, yaw_rad, yaw_rate_rad_s)
        self._set_streamed(GuidedKind.TRAJECTORY, yaw_rad, yaw_rate_rad_s)

    def set_attitude(
        self,
        ctx: FlightContext,
        q_ned_from_frd: Array | tuple[float, float, float, float],
        climb: float,
        rates_frd_rad_s: AnyVector = NAN3,
        *,
        yaw_rate_rad_s: float = math.nan,
    ) -> None:
        """Fly an attitude until the timeout; `climb` 0..1 is a climb rate, 0.5: no climb."""
        p = ctx.multicopter
        share = 2.0 * (min(1.0, max(0.0, climb)) - 0.5)
        self._climb_m_s = share * (p.climb_speed_m_s if share > 0.0 else p.descend_speed_m_s)
        self._attitude[:] = q_ned_from_frd
        self._rates[:] = rates_frd_rad_s
        if self.kind is not GuidedKind.ATTITUDE:
            self._hover_down_m = math.nan
        self._set_streamed(GuidedKind.ATTITUDE, math.nan, yaw_rate_rad_s)

    def _set_streamed(self, kind: GuidedKind, yaw_rad: float, yaw_rate_rad_s: float) -> None:
        self.kind = kind
        self._yaw_rad = yaw_rad
        self._yaw_rate_rad_s = yaw_rate_rad_s
        self._turn = None
        self._age_s = 0.0

    def set_turn(self, turn: Turn) -> None:
        """Turn as commanded while the target is kept (CONDITION_YAW)."""
        self._turn = turn
        self._yaw_rad = self._yaw_rate_rad_s = math.nan

    def activate(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.CRUISE
        self._ramp = TakeoffRamp(ctx)
        if self.kind is GuidedKind.HOLD:
            self._hold.activate(ctx)

    def update(self, ctx: FlightContext) -> TaskStatus:
        if self._ramp is None:
            self.activate(ctx)
            return self.update(ctx)
        if not self._ramp.update(ctx, False, 0.0):
            return TaskStatus.RUNNING
        kind = self.kind
        if kind is GuidedKind.POSITION and self._goto is not None:
            if not self._goto_started:
                self._goto.activate(ctx)
                self._goto_started = True
            self._goto.update(ctx)
            return TaskStatus.RUNNING
        if kind is GuidedKind.HOLD:
            self._hold.update(ctx)
            return TaskStatus.RUNNING
        self._age_s += ctx.dt_s
        if self._age_s > ctx.multicopter.guided_timeout_s:
            self.set_hold(ctx)
            self._hold.update(ctx)
        elif kind is GuidedKind.ATTITUDE:
            self._fly_attitude(ctx)
        elif self._motion is not None:
            self._fly_motion(ctx, self._motion)
        return TaskStatus.RUNNING

    def _fly_attitude(self, ctx: FlightContext) -> None:
        setpoint = ctx.setpoint
        clear_setpoint(setpoint, sp.ATTITUDE)
        setpoint[sp.Q_NED_FROM_FRD] = self._attitude
        setpoint[sp.RATES_FRD_RAD_S] = self._rates
        setpoint[sp.YAW_RATE_RAD_S] = self._yaw_rate_rad_s
        # thrust stays NaN: the vertical loop flies this climb rate
        down = float(ctx.nav[nav_layout.POS_NED_M][2])
        if math.isnan(self._hover_down_m):
            self._hover_down_m = down
        self._hover_down_m -= self._climb_m_s * ctx.dt_s
        self._hover_down_m = min(down + 1.0, max(down - 1.0, self._hover_down_m))
        setpoint[sp.POS + 2] = self._hover_down_m
        setpoint[sp.VEL + 2] = -self._climb_m_s

    def _fly_motion(self, ctx: FlightContext, motion: SmoothMotion) -> None:
        motion.synchronise(ctx)
        trajectory = motion.trajectory
        if self.kind is GuidedKind.VELOCITY:
            north, east, down = (float(v) for v in self._velocity)
            if ctx.multicopter.avoidance.guided:
                heading = float(ctx.nav[nav_layout.EULER_RAD][2])
                north, east = limited_velocity(ctx, north, east, heading)
            trajectory.track_velocity(north, east, down, ctx.dt_s)
        elif self.kind is GuidedKind.ACCELERATION:
            self._integrate_acceleration(ctx, motion)
        else:
            place, velocity = self._position, self._velocity
            trajectory.position_ned_m[:] = np.where(
                np.isfinite(place), place + velocity * min(self._age_s, 0.5), trajectory.position_ned_m
            )
            trajectory.velocity_ned_m_s[:] = np.nan_to_num(velocity, nan=0.0)
            trajectory.acceleration_ned_m_s2[:] = np.nan_to_num(self._acceleration, nan=0.0)
        if math.isfinite(self._yaw_rate_rad_s):
            motion.heading.turn(self._yaw_rate_rad_s, ctx.multicopter, ctx.dt_s)
        else:
            ahead = trajectory.position_ned_m + 4.0 * trajectory.velocity_ned_m_s
            motion.steer(ctx, self._yaw_rad, ahead, turn=self._turn)
        motion.write(ctx)

    def _integrate_acceleration(self, ctx: FlightContext, motion: SmoothMotion) -> None:
        p = ctx.multicopter
        velocity = motion.trajectory.velocity_ned_m_s + self._acceleration * 0.5
        size = math.hypot(float(velocity[0]), float(velocity[1]))
        if size > p.max_speed_m_s:
            velocity[0:2] *= p.max_speed_m_s / size
        down = min(p.descend_speed_m_s, max(-p.climb_speed_m_s, float(velocity[2])))
        motion.trajectory.track_velocity(float(velocity[0]), float(velocity[1]), down, ctx.dt_s)


def _note_commanded_yaw(ctx: FlightContext, *values: float) -> None:
    """A target with a yaw or a yaw rate ends the region of interest."""
    if ctx.nose_on_roi and any(math.isfinite(value) for value in values):
        ctx.look_at(None)
