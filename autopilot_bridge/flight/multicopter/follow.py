"""Follow a target that reports its position: PX4's Follow Target, ArduCopter's FOLLOW."""

import math
from typing import Final

from autopilot_bridge.flight.context import Array, FlightContext
from autopilot_bridge.flight.multicopter.hold import CruiseTask
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.surroundings_parameters import FollowHeight, FollowParameters, FollowYaw
from autopilot_bridge.flight.task import TaskStatus
from autopilot_bridge.navigation import layout as nav_layout

_BRAKE_SHARE: Final = 0.5  # of the acceleration limit, when approaching the position
_TURN_AT_M: Final = 1.0  # the nose does not point to a target nearer than this
_NAV_HEIGHT: Final = nav_layout.HEIGHT_ABOVE_GROUND_M


class FollowTask(CruiseTask):
    """Hold a position relative to the target; stop and hold while no messages are received. Never DONE.

    Attributes:
        following: the vehicle is following the target.
    """

    def __init__(self) -> None:
        super().__init__()
        self._direction_rad = math.nan
        self.following = False

    def _begin(self, ctx: FlightContext, motion: SmoothMotion) -> None:
        self._direction_rad = math.nan
        self.following = False

    def _fly(self, ctx: FlightContext, motion: SmoothMotion) -> TaskStatus:
        p, leader = ctx.multicopter.follow, ctx.surroundings.leader
        motion_of_target = leader.at(ctx.time_us) if leader.age_s(ctx.time_us) <= p.timeout_s else None
        self.following = motion_of_target is not None and ctx.position_valid
        if motion_of_target is not None and ctx.position_valid:
            position, velocity = motion_of_target
            away = math.dist(position.tolist(), ctx.nav[nav_layout.POS_NED_M].tolist())
            self.following = away <= p.max_distance_m
            if self.following:
                self._chase(ctx, motion, position, velocity)
                motion.write(ctx)
                return TaskStatus.RUNNING
        motion.brake(ctx)
        motion.steer(ctx, motion.heading.yaw_rad)
        motion.write(ctx)
        return TaskStatus.RUNNING

    def _chase(self, ctx: FlightContext, motion: SmoothMotion, target: Array, velocity: Array) -> None:
        limits, p, trajectory = ctx.multicopter, ctx.multicopter.follow, motion.trajectory
        offset_north, offset_east = self._offset(ctx, p)
        here = trajectory.position_ned_m
        north = float(target[0] - here[0]) + offset_north
        east = float(target[1] - here[1]) + offset_east
        away = math.hypot(north, east)
        closing = min(
            p.gain_1_s * away,
            math.sqrt(2.0 * _BRAKE_SHARE * limits.acceleration_m_s2 * away),
            limits.max_speed_m_s,
        )
        scale = closing / away if away > 1e-6 else 0.0
        speed_north, speed_east = float(velocity[0]) + scale * north, float(velocity[1]) + scale * east
        speed = math.hypot(speed_north, speed_east)
        if speed > limits.max_speed_m_s:
            speed_north *= limits.max_speed_m_s / speed
            speed_east *= limits.max_speed_m_s / speed
        down, climb_with = self._height(ctx, p, float(target[2]), float(velocity[2]))
        sink = climb_with + p.gain_1_s * (down - float(here[2]))
        sink = min(limits.descend_speed_m_s, max(-limits.climb_speed_m_s, sink))
        trajectory.wait_for(ctx.nav[nav_layout.POS_NED_M], limits.trajectory_error_max_m)
        trajectory.track_velocity(speed_north, speed_east, sink, ctx.dt_s * trajectory.stretch)
        motion.steer(ctx, self._yaw(ctx, p, motion, target))

    def _offset(self, ctx: FlightContext, p: FollowParameters) -> tuple[float, float]:
        """(north, east) from the target; it turns with the target's course, at a limited speed."""
        forward, right, _ = p.offset_m
        if not p.along_course:
            return forward, right
        course = ctx.surroundings.leader.course_rad
        if math.isnan(self._direction_rad):
            # until it moves: on the vehicle's side
            here = ctx.nav[nav_layout.POS_NED_M]
            known = ctx.surroundings.leader.at(ctx.time_us)
            if math.isfinite(course):
                self._direction_rad = course
            elif known is not None:
                side = math.atan2(float(here[1] - known[0][1]), float(here[0] - known[0][0]))
                self._direction_rad = side - math.atan2(right, forward)
        elif math.isfinite(course):
            radius = max(1.0, math.hypot(forward, right))
            fastest = p.swing_speed_m_s / radius * ctx.dt_s
            turn = math.remainder(course - self._direction_rad, math.tau)
            turn *= ctx.dt_s / (p.smoothing_s + ctx.dt_s)
            self._direction_rad += min(fastest, max(-fastest, turn))
        c, s = math.cos(self._direction_rad), math.sin(self._direction_rad)
        return c * forward - s * right, s * forward + c * right

    def _height(
        self, ctx: FlightContext, p: FollowParameters, target_down: float, target_sink: float
    ) -> tuple[float, float]:
        """(wanted down coordinate, its rate)."""
        offset = p.offset_m[2]
        if p.height is FollowHeight.TARGET:
            return target_down + offset, target_sink
        clearance = float(ctx.nav[_NAV_HEIGHT])
        if p.height is FollowHeight.GROUND and math.isfinite(clearance):
            return float(ctx.nav[nav_layout.POS_NED_M][2]) + clearance + offset, 0.0
        home_down = float(ctx.home_ned_m[2])
        return (0.0 if math.isnan(home_down) else home_down) + offset, 0.0

    def _yaw(self, ctx: FlightContext, p: FollowParameters, motion: SmoothMotion, target: Array) -> float:
        here = ctx.nav[nav_layout.POS_NED_M]
        north, east = float(target[0] - here[0]), float(target[1] - here[1])
        if p.yaw is FollowYaw.FACE_TARGET and math.hypot(north, east) > _TURN_AT_M:
            return math.atan2(east, north)
        course = ctx.surroundings.leader.course_rad
        if p.yaw is FollowYaw.AS_TARGET and math.isfinite(course):
            return course
        speed_north, speed_east = (float(v) for v in motion.trajectory.velocity_ned_m_s[0:2])
        if p.yaw is FollowYaw.ALONG_TRACK and math.hypot(speed_north, speed_east) > _TURN_AT_M:
            return math.atan2(speed_east, speed_north)
        return motion.heading.yaw_rad
