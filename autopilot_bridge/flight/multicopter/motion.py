"""Smooth motion for most tasks: trajectory generator, heading, and flight without a position."""

import math
from typing import Final

import numpy as np

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext
from autopilot_bridge.flight.heading import Turn
from autopilot_bridge.flight.multicopter.trajectory import (
    SPEED,
    SPEED_DOWN,
    SPEED_TURN,
    SPEED_UP,
    TrajectoryGenerator,
)
from autopilot_bridge.flight.multicopter.yaw import YawSteering
from autopilot_bridge.flight.parameters import YawBehaviour
from autopilot_bridge.flight.region_of_interest import roi_heading
from autopilot_bridge.flight.task import SpeedKind
from autopilot_bridge.navigation import layout as nav_layout

_CONTINUE_WITHIN_M: Final = 2.0  # a running trajectory this close to the vehicle is taken over as it is
_CONTINUE_WITHIN_M_S: Final = 2.0
_TURN_DISTANCE_M: Final = 2.0  # the nose turns only to targets farther than this
_MIN_COURSE_SPEED_M_S: Final = 0.7
_SLOWEST_TURN_M_S: Final = 0.5
_SHORTEST_LEG_M: Final = 0.1
_SLOWEST_LEG_M_S: Final = 0.05


class SmoothMotion:
    """Moves the setpoint smoothly and writes it, degrading to velocity or level flight without a position.

    Attributes:
        trajectory: the moving point.
        heading: the moving heading.
    """

    def __init__(self, ctx: FlightContext, *, speed_m_s: float | None = None) -> None:
        self.trajectory = TrajectoryGenerator(ctx.multicopter, speed_m_s=speed_m_s)
        self.heading = YawSteering()
        self._leg_start: Array = np.zeros(3)
        self._position_resets = 0
        self._height_resets = 0
        self._yaw_resets = 0
        self._synchronised = False
        self.restart(ctx)

    def restart(self, ctx: FlightContext) -> None:
        """Continue from the trajectory flown until now, or from the vehicle's own state."""
        setpoint, nav = ctx.setpoint, ctx.nav
        position, velocity = nav[nav_layout.POS_NED_M], nav[nav_layout.VEL_NED_M_S]
        old = [setpoint[part].copy() for part in (sp.POS_NED_M, sp.VEL_NED_M_S, sp.ACC_NED_M_S2)]
        if (
            setpoint[sp.LEVEL] == sp.TRAJECTORY
            and math.isfinite(float(setpoint[sp.MOTION].sum()))
            and float(np.abs(old[0] - position).max()) < _CONTINUE_WITHIN_M
            and float(np.abs(old[1] - velocity).max()) < _CONTINUE_WITHIN_M_S
        ):
            self.trajectory.reset(*old)
        else:
            self.trajectory.reset(position, velocity)
        if setpoint[sp.LEVEL] == sp.TRAJECTORY and math.isfinite(float(setpoint[sp.YAW_RAD])):
            rate = float(setpoint[sp.YAW_RATE_RAD_S])
            self.heading.reset(float(setpoint[sp.YAW_RAD]), rate if math.isfinite(rate) else 0.0)
        else:
            self.heading.reset(float(nav[nav_layout.YAW]), float(nav[nav_layout.RATES_FRD_RAD_S][2]))
        self.begin_leg()
        self._synchronised = ctx.position_valid
        if ctx.health is not None:
            self._position_resets = ctx.health.position_resets
            self._height_resets = ctx.health.height_resets
            self._yaw_resets = ctx.health.yaw_resets

    def synchronise(self, ctx: FlightContext) -> None:
        """Follow jumps of the filter's estimate, and restart when the position is available again."""
        health = ctx.health
        if health is None:
            return
        moved = self.trajectory.position_ned_m
        if health.position_resets != self._position_resets:
            self._position_resets = health.position_resets
            moved[0] += health.position_reset_ne_m[0]
            moved[1] += health.position_reset_ne_m[1]
        if health.height_resets != self._height_resets:
            self._height_resets = health.height_resets
            moved[2] += health.height_reset_down_m
        if health.yaw_resets != self._yaw_resets:
            self._yaw_resets = health.yaw_resets
            self.heading.reset(self.heading.yaw_rad + health.yaw_reset_rad, self.heading.rate_rad_s)
        if ctx.position_valid and not self._synchronised:
            self.trajectory.position_ned_m[0:2] = ctx.nav[nav_layout.POS_NED_M][0:2]
            self.trajectory.velocity_ned_m_s[0:2] = ctx.nav[nav_layout.VEL_NED_M_S][0:2]
            self.trajectory.acceleration_ned_m_s2[0:2] = 0.0
        self._synchronised = ctx.position_valid

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Set another speed on the present leg; None: the parameters'. A corner in progress is not
        changed.
        """
        p, limits = ctx.multicopter, self.trajectory.limits
        if kind is SpeedKind.CLIMB:
            limits[SPEED_UP] = p.climb_speed_m_s if speed_m_s is None else speed_m_s
        elif kind is SpeedKind.DESCENT:
            limits[SPEED_DOWN] = p.descend_speed_m_s if speed_m_s is None else speed_m_s
        else:
            speed = p.cruise_speed_m_s if speed_m_s is None else speed_m_s
            limits[SPEED] = min(max(speed, _SLOWEST_LEG_M_S), p.max_speed_m_s)

    def begin_leg(self) -> None:
        """Begin the next leg at the moving point."""
        self._leg_start[:] = self.trajectory.position_ned_m
        self.trajectory.limits[SPEED_TURN] = math.inf

    def fly_to(
        self, ctx: FlightContext, end_ned_m: Array, end_speed_m_s: float = 0.0, turn_in_m: float = 0.0
    ) -> None:
        """One tick along the leg to `end_ned_m`, slowed down to the end speed `turn_in_m` before it."""
        self.trajectory.wait_for(ctx.nav[nav_layout.POS_NED_M], ctx.multicopter.trajectory_error_max_m)
        self.trajectory.follow_leg(self._leg_start, end_ned_m, end_speed_m_s, ctx.dt_s, turn_in_m=turn_in_m)

    def turn_into_leg(self, start_ned_m: Array) -> None:
        """Begin a leg at a corner (the waypoint before), which is rounded at the present speed."""
        self._leg_start[:] = start_ned_m
        north, east = (float(v) for v in self.trajectory.velocity_ned_m_s[0:2])
        self.trajectory.limits[SPEED_TURN] = max(_SLOWEST_TURN_M_S, math.hypot(north, east))

    def ahead_m(self, end_ned_m: Array) -> float:
        """Remaining distance along the leg; negative beyond its end."""
        end_n, end_e, _ = end_ned_m.tolist()
        start_n, start_e, _ = self._leg_start.tolist()
        point_n, point_e, _ = self.trajectory.position_ned_m.tolist()
        leg_n, leg_e = end_n - start_n, end_e - start_e
        north, east = end_n - point_n, end_e - point_e
        length = math.hypot(leg_n, leg_e)
        if length < _SHORTEST_LEG_M:
            return math.hypot(north, east)
        return (north * leg_n + east * leg_e) / length

    def brake(self, ctx: FlightContext) -> None:
        """One tick of braking to a stop."""
        self.trajectory.stretch = 1.0
        self.trajectory.track_velocity(0.0, 0.0, 0.0, ctx.dt_s)

    @property
    def stopped(self) -> bool:
        """The moving point stands still."""
        return bool(
            np.abs(self.trajectory.velocity_ned_m_s).max() < 0.05
            and np.abs(self.trajectory.acceleration_ned_m_s2).max() < 0.1
        )

    def steer(
        self,
        ctx: FlightContext,
        yaw_rad: float,
        target_ned_m: Array | None = None,
        yaw_rate_rad_s: float = 0.0,
        turn: Turn | None = None,
    ) -> None:
        """One tick of the heading: to `yaw_rad`; if that is NaN, by a commanded turn, or else by the
        vehicle's yaw behaviour. A region of interest takes precedence if the nose points to it.

        `yaw_rate_rad_s` is the rate of the wanted heading.
        """
        if turn is not None and math.isnan(yaw_rad) and not ctx.nose_on_roi:
            self.heading.follow(turn, ctx.multicopter, ctx.dt_s)
            return
        wanted = yaw_rad
        if ctx.nose_on_roi:
            looked_at = roi_heading(ctx)
            wanted = self.heading.yaw_rad if math.isnan(looked_at) else looked_at
            yaw_rate_rad_s = 0.0
        elif math.isnan(wanted):
            wanted = self.heading.yaw_rad
            behaviour = ctx.multicopter.yaw_behaviour
            if behaviour == YawBehaviour.TOWARDS_TARGET and target_ned_m is not None:
                north = float(target_ned_m[0] - self.trajectory.position_ned_m[0])
                east = float(target_ned_m[1] - self.trajectory.position_ned_m[1])
                if math.hypot(north, east) > _TURN_DISTANCE_M:
                    wanted = math.atan2(east, north)
            elif behaviour == YawBehaviour.ALONG_TRACK:
                north, east = (float(v) for v in self.trajectory.velocity_ned_m_s[0:2])
                if math.hypot(north, east) > _MIN_COURSE_SPEED_M_S:
                    wanted = math.atan2(east, north)
        self.heading.turn_to(wanted, ctx.multicopter, ctx.dt_s, target_rate_rad_s=yaw_rate_rad_s)

    def write(self, ctx: FlightContext) -> None:
        """Write the control setpoint, without the quantities that the filter does not know."""
        setpoint = ctx.setpoint
        self.trajectory.write(setpoint)
        setpoint[sp.YAW_RAD] = self.heading.yaw_rad
        setpoint[sp.YAW_RATE_RAD_S] = self.heading.rate_rad_s
        if not ctx.position_valid:
            setpoint[sp.POS_HORIZONTAL] = math.nan
            setpoint[sp.VEL_HORIZONTAL] = 0.0 if ctx.velocity_valid else math.nan
            setpoint[sp.ACC_HORIZONTAL] = 0.0
        if not ctx.altitude_valid:
            setpoint[sp.POS + 2] = math.nan
