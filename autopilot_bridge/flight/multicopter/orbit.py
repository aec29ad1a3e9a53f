"""Circles around a point: DO_ORBIT, NAV_LOITER_TURNS, ArduPilot's CIRCLE."""

import math
from enum import IntEnum

import numpy as np

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext, TaskFinished
from autopilot_bridge.flight.multicopter.hold import CruiseTask
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.task import TaskStatus
from autopilot_bridge.navigation import layout as nav_layout

_ON_CIRCLE_M = 0.5
_SPEED_UP_SHARE = 0.3  # of the acceleration limit, along the circle


class OrbitYaw(IntEnum):
    """ORBIT_YAW_BEHAVIOUR."""

    FRONT_TO_CENTRE = 0
    HOLD_INITIAL = 1
    UNCONTROLLED = 2
    FRONT_TANGENT = 3
    RC_CONTROLLED = 4
    UNCHANGED = 5


def circle_ahead(ctx: FlightContext, radius_m: float) -> Array:
    """Centre of the circle that starts at the vehicle and lies ahead (ArduPilot CIRCLE), local NED (3,)."""
    position = ctx.nav[nav_layout.POS_NED_M]
    yaw = float(ctx.nav[nav_layout.YAW])
    return np.array(
        [
            float(position[0]) + radius_m * math.cos(yaw),
            float(position[1]) + radius_m * math.sin(yaw),
            float(position[2]),
        ]
    )


class OrbitTask(CruiseTask):
    """Fly to the nearest point of a circle, then around it at constant speed; DONE after `turns`, if given.

    Args:
        centre_ned_m: centre and height, (3,); NaN components: those of the start position; None: one
            radius ahead, so that the circle starts at the vehicle (ArduPilot CIRCLE).
        radius_m: None: the parameter. Its sign is ignored.
        velocity_m_s: ground speed, positive clockwise seen from above; None: the parameter. Limited by the
            centripetal acceleration.
        yaw_behaviour: where the nose points.
        turns: number of turns; None: unlimited.

    Attributes:
        centre_ned_m, radius_m, velocity_m_s: the circle flown.
        turns_done: turns flown so far.
    """

    def __init__(
        self,
        centre_ned_m: Array | None = None,
        radius_m: float | None = None,
        velocity_m_s: float | None = None,
        *,
        yaw_behaviour: OrbitYaw = OrbitYaw.FRONT_TO_CENTRE,
        turns: float | None = None,
    ) -> None:
        super().__init__()
        self._ahead = centre_ned_m is None
        self.centre_ned_m: Array = np.full(3, np.nan)
        if centre_ned_m is not None:
            self.centre_ned_m[:] = centre_ned_m
        self.radius_m = math.nan if radius_m is None else abs(radius_m)
        self.velocity_m_s = math.nan if velocity_m_s is None else velocity_m_s
        self._yaw_behaviour = yaw_behaviour
        self._turns = turns
        self.circling = False
        self.turns_done = 0.0
        self._phase_rad = 0.0
        self._speed_m_s = 0.0
        self._initial_yaw = 0.0
        self._finished = False

    def _begin(self, ctx: FlightContext, motion: SmoothMotion) -> None:
        p = ctx.multicopter
        position = motion.trajectory.position_ned_m
        if not (math.isfinite(self.radius_m) and self.radius_m > 0.0):
            self.radius_m = p.orbit_radius_m
        self.radius_m = max(1.0, self.radius_m)
        if self._ahead:
            self._ahead = False
            self.centre_ned_m[:] = circle_ahead(ctx, self.radius_m)
        self.centre_ned_m[:] = np.where(np.isfinite(self.centre_ned_m), self.centre_ned_m, position)
        if not math.isfinite(self.velocity_m_s):
            self.velocity_m_s = p.orbit_speed_m_s
        limit = min(p.max_speed_m_s, math.sqrt(p.orbit_acceleration_max_m_s2 * self.radius_m))
        self.velocity_m_s = min(limit, max(-limit, self.velocity_m_s))
        self.circling = False
        self.turns_done = 0.0
        self._speed_m_s = 0.0
        self._finished = False
        self._initial_yaw = motion.heading.yaw_rad
        north = float(position[0] - self.centre_ned_m[0])
        east = float(position[1] - self.centre_ned_m[1])
        self._phase_rad = (
            math.atan2(east, north) if math.hypot(north, east) > 0.1 else self._initial_yaw + math.pi
        )

    def _entry(self) -> Array:
        return self.centre_ned_m + self.radius_m * np.array(
            [math.cos(self._phase_rad), math.sin(self._phase_rad), 0.0]
        )

    def _fly(self, ctx: FlightContext, motion: SmoothMotion) -> TaskStatus:
        trajectory = motion.trajectory
        if not ctx.position_valid:
            self.circling = False
            motion.brake(ctx)
        elif not self.circling:
            entry = self._entry()
            motion.fly_to(ctx, entry)
            away = math.dist(trajectory.position_ned_m, entry)
            self.circling = away < _ON_CIRCLE_M and motion.stopped
        else:
            self._circle(ctx, motion)
        turns = self.circling and self._yaw_behaviour in (OrbitYaw.FRONT_TO_CENTRE, OrbitYaw.FRONT_TANGENT)
        rate = self._speed_m_s / self.radius_m if turns else 0.0
        motion.steer(ctx, self._yaw(ctx, motion), yaw_rate_rad_s=rate)
        motion.write(ctx)
        if self._yaw_behaviour is OrbitYaw.UNCONTROLLED:
            ctx.setpoint[sp.YAW_RAD] = math.nan
            ctx.setpoint[sp.YAW_RATE_RAD_S] = 0.0
        done = self._turns is not None and self.turns_done >= self._turns
        if done and not self._finished:
            self._finished = True
            ctx.events.append(TaskFinished("orbit"))
        return TaskStatus.DONE if done else TaskStatus.RUNNING

    def _circle(self, ctx: FlightContext, motion: SmoothMotion) -> None:
        trajectory = motion.trajectory
        trajectory.wait_for(ctx.nav[nav_layout.POS_NED_M], ctx.multicopter.trajectory_error_max_m)
        dt = ctx.dt_s * trajectory.stretch
        acc = _SPEED_UP_SHARE * ctx.multicopter.orbit_acceleration_max_m_s2
        change = min(acc * dt, max(-acc * dt, self.velocity_m_s - self._speed_m_s))
        self._speed_m_s += change
        along = change / dt if dt > 1e-6 else 0.0
        step = self._speed_m_s / self.radius_m * dt
        self._phase_rad += step
        self.turns_done += abs(step) / (2.0 * math.pi)
        c, s = math.cos(self._phase_rad), math.sin(self._phase_rad)
        v, r = self._speed_m_s, self.radius_m
        position, velocity = trajectory.position_ned_m, trajectory.velocity_ned_m_s
        acceleration = trajectory.acceleration_ned_m_s2
        # the remaining distance from the circle decays smoothly
        fade = math.exp(-dt)
        before = self._phase_rad - step
        north, east, down = (float(x) for x in self.centre_ned_m)
        left_north = (float(position[0]) - north - r * math.cos(before)) * fade
        left_east = (float(position[1]) - east - r * math.sin(before)) * fade
        position[:] = (
            north + r * c + left_north,
            east + r * s + left_east,
            down + (float(position[2]) - down) * fade,
        )
        velocity[:] = (-v * s, v * c, 0.0)
        acceleration[:] = (-along * s - v * v / r * c, along * c - v * v / r * s, 0.0)

    def _yaw(self, ctx: FlightContext, motion: SmoothMotion) -> float:
        behaviour = self._yaw_behaviour
        position = motion.trajectory.position_ned_m
        if behaviour is OrbitYaw.FRONT_TO_CENTRE:
            return math.atan2(
                float(self.centre_ned_m[1] - position[1]), float(self.centre_ned_m[0] - position[0])
            )
        if behaviour is OrbitYaw.FRONT_TANGENT and self.circling:
            return self._phase_rad + math.copysign(0.5 * math.pi, self.velocity_m_s)
        if behaviour is OrbitYaw.RC_CONTROLLED and ctx.sticks.valid:
            return motion.heading.yaw_rad + ctx.sticks.yaw * ctx.multicopter.yaw_rate_max_rad_s
        if behaviour is OrbitYaw.HOLD_INITIAL:
            return self._initial_yaw
        return motion.heading.yaw_rad
