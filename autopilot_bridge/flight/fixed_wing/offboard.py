"""Setpoints from outside, flown as PX4's Offboard flies them on a fixed wing."""

import math
from typing import ClassVar, Final

import numpy as np

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext
from autopilot_bridge.flight.fixed_wing.base import AircraftTask, GuidedPath
from autopilot_bridge.flight.fixed_wing.circle import Circle
from autopilot_bridge.flight.fixed_wing.loiter import LoiterTask
from autopilot_bridge.flight.task import NAN3, AnyVector, OffboardKind, TaskStatus, clear_setpoint
from flightsim.foundation.rotations import euler_from_quaternion

_STILL_M_S: Final = 0.5  # a slower velocity has no direction
_POWER_ON: Final = 0.05


class OffboardTask(AircraftTask):
    """Flies the latest setpoint. Before the first one it circles where it is.

    Of a trajectory setpoint: a position alone is flown to and circled; position and velocity are a point of
    a path and its tangent (with an acceleration, its curvature too); a velocity alone is a course and a climb
    rate. An acceleration alone can't be flown and keeps course and height. The yaw isn't used.

    The caller (commander) watches for lost setpoints; here the last one stays in force.

    Attributes:
        kind: what the latest setpoint controls.
    """

    works_on_ground: ClassVar[bool] = True

    def __init__(self) -> None:
        super().__init__()
        self.kind = OffboardKind.NONE
        self._position = self._velocity = self._acceleration = NAN3
        self._rates = NAN3
        self._attitude: Array = np.array([1.0, 0.0, 0.0, 0.0])
        self._throttle = 0.0
        self._hold = LoiterTask()
        self._path = GuidedPath()
        self._circle: Circle | None = None
        self._kept: tuple[float, float] | None = None  # course, down

    def set_trajectory(
        self,
        position_ned_m: AnyVector = NAN3,
        velocity_ned_m_s: AnyVector = NAN3,
        acceleration_ned_m_s2: AnyVector = NAN3,
        yaw_rad: float = math.nan,
        yaw_rate_rad_s: float = math.nan,
    ) -> None:
        """New trajectory setpoint; NaN components aren't controlled."""
        self._position = _triple(position_ned_m)
        self._velocity = _triple(velocity_ned_m_s)
        self._acceleration = _triple(acceleration_ned_m_s2)
        self.kind = OffboardKind.TRAJECTORY

    def set_attitude(
        self,
        q_ned_from_frd: Array | tuple[float, float, float, float],
        thrust: float,
        rates_frd_rad_s: AnyVector = NAN3,
    ) -> None:
        """New attitude setpoint with throttle 0..1. The aircraft flies its roll and pitch; rates and yaw
        follow from them."""
        self._attitude[:] = q_ned_from_frd
        self._throttle = min(1.0, max(0.0, thrust))
        self.kind = OffboardKind.ATTITUDE

    def set_rates(self, rates_frd_rad_s: AnyVector, thrust: float) -> None:
        """New body-rate setpoint with throttle 0..1."""
        self._rates = _triple(rates_frd_rad_s)
        self._throttle = min(1.0, max(0.0, thrust))
        self.kind = OffboardKind.RATES

    def _begin(self, ctx: FlightContext) -> None:
        self._hold.activate(ctx)
        self._circle = None
        self._kept = None

    def _fly(self, ctx: FlightContext) -> TaskStatus:
        powered = self.kind in (OffboardKind.ATTITUDE, OffboardKind.RATES) and self._throttle > _POWER_ON
        if ctx.on_ground and not powered:
            clear_setpoint(ctx.setpoint, sp.IDLE)
            self._rested = True
        elif self._rested:
            self.activate(ctx)
            self._rested = False
            return self._fly(ctx)
        elif self.kind is OffboardKind.ATTITUDE:
            self._fly_attitude(ctx)
        elif self.kind is OffboardKind.RATES:
            clear_setpoint(ctx.setpoint, sp.RATES)
            ctx.setpoint[sp.RATES_FRD_RAD_S] = [0.0 if r != r else r for r in self._rates]
            ctx.setpoint[sp.THROTTLE] = self._throttle
        elif self.kind is OffboardKind.TRAJECTORY and ctx.position_valid:
            self._fly_trajectory(ctx)
        else:
            self._hold.update(ctx)
        return TaskStatus.RUNNING

    def _fly_attitude(self, ctx: FlightContext) -> None:
        p, command = ctx.fixed_wing, self._command
        euler = np.zeros(3)
        euler_from_quaternion(self._attitude, euler)
        roll, pitch = float(euler[0]), float(euler[1])
        command.roll_rad = min(p.manual_bank_max_rad, max(-p.manual_bank_max_rad, roll))
        command.pitch_rad = min(p.pitch_max_rad, max(p.pitch_min_rad, pitch))
        command.throttle = self._throttle
        command.write(ctx)

    def _fly_trajectory(self, ctx: FlightContext) -> None:
        north, east, down = self._position
        has_place = north == north and east == east
        vel_north, vel_east, vel_down = self._velocity
        speed = math.hypot(vel_north, vel_east)
        if speed > _STILL_M_S:
            self._circle = self._kept = None
            self._fly_path(ctx, has_place, vel_north / speed, vel_east / speed, speed)
        elif has_place:
            self._kept = None
            self._fly_place(ctx, north, east)
        else:
            self._circle = None
            self._keep(ctx)
        command = self._command
        if down == down:
            command.down_m = down
        if vel_down == vel_down and (down != down or speed > _STILL_M_S):
            command.height_rate_m_s = -vel_down
        if command.down_m != command.down_m and command.height_rate_m_s != command.height_rate_m_s:
            self._keep_height()
        command.write(ctx)

    def _fly_path(
        self, ctx: FlightContext, has_place: bool, tangent_north: float, tangent_east: float, speed: float
    ) -> None:
        """Along a tangent through a place, or just in its direction."""
        command, state = self._command, self._state
        if not has_place:
            command.course_rad = math.atan2(tangent_east, tangent_north)
            return
        acc_north, acc_east, _ = self._acceleration
        curvature = 0.0
        if acc_north == acc_north and acc_east == acc_east:
            curvature = (tangent_north * acc_east - tangent_east * acc_north) / (speed * speed)
        guidance = self._path.of(ctx)
        north, east, _ = self._position
        # the path's point beside the aircraft, on the circle of this curvature or the straight line
        if abs(curvature) > 1e-4:
            radius, side = 1.0 / abs(curvature), math.copysign(1.0, curvature)
            guidance.follow_circle(
                state,
                north - side * radius * tangent_east,
                east + side * radius * tangent_north,
                radius,
                side,
            )
        else:
            guidance.follow_line(state, north, east, tangent_north, tangent_east)
        command.course_rad = guidance.course_rad
        command.lateral_acceleration_m_s2 = guidance.lateral_acceleration_m_s2

    def _fly_place(self, ctx: FlightContext, north: float, east: float) -> None:
        """To a place, and around it; a place that moves with the stream takes the circle along."""
        circle, command = self._circle, self._command
        if circle is None or (circle.north_m, circle.east_m) != (north, east):
            circle = self._circle = Circle(north, east, ctx.fixed_wing.loiter_radius_m)
            circle.begin(self._state)
        guidance = self._path.of(ctx)
        circle.follow(self._state, guidance, ctx.fixed_wing.roll_time_constant_s)
        command.course_rad = guidance.course_rad
        command.lateral_acceleration_m_s2 = guidance.lateral_acceleration_m_s2

    def _keep(self, ctx: FlightContext) -> None:
        """Straight on."""
        if self._kept is None:
            self._kept = (self._state.course_rad, self._state.down_m)
        self._command.course_rad = self._kept[0]

    def _keep_height(self) -> None:
        if self._kept is None:
            self._kept = (self._state.course_rad, self._state.down_m)
        self._command.down_m = self._kept[1]


def _triple(vector: AnyVector) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
