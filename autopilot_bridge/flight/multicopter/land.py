"""Landing: descend, slow down near the ground, detect touchdown, idle."""

import math

import numpy as np

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase, TouchedDown
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.parameters import FlightParameters
from autopilot_bridge.flight.task import TaskStatus, clear_setpoint
from autopilot_bridge.navigation import layout as nav_layout

_OVER_PLACE_M = 1.0  # distance from a given position at which the descent starts
_THRUST_GONE_M_S2 = 20.0  # downwards, more than gravity: thrust to its minimum
_RELIEF_M_S3 = 4.0  # how fast thrust is taken away on ground contact
_NAV_HEIGHT = nav_layout.HEIGHT_ABOVE_GROUND_M


def descent_speed(height_m: float, parameters: FlightParameters) -> float:
    """Speed of descent at a height above ground: fast high up, slow near the ground, linear between (PX4)."""
    p = parameters
    if not math.isfinite(height_m) or height_m <= p.land_slow_altitude_m:
        return p.land_speed_m_s
    if height_m >= p.land_fast_altitude_m:
        return p.land_descend_speed_m_s
    part = (height_m - p.land_slow_altitude_m) / (p.land_fast_altitude_m - p.land_slow_altitude_m)
    return p.land_speed_m_s + part * (p.land_descend_speed_m_s - p.land_speed_m_s)


class LandTask:
    """Land here, or at a given position. DONE on the ground, with motors at idle and a `TouchedDown` event.

    The vehicle holds the position; without a position it holds the velocity; without both it descends level.
    Ground contact levels the vehicle and reduces the thrust gradually, until the landing is detected; from
    then on the motors idle, whatever the land detector reports later.

    Args:
        position_ned_m: position to land at, (3,) (down is ignored); None: where the vehicle comes to rest.
        yaw_rad: heading; None: the present one.
    """

    def __init__(self, position_ned_m: Array | None = None, yaw_rad: float | None = None) -> None:
        self._target = None if position_ned_m is None else np.array(position_ned_m, dtype=np.float64)
        self._yaw_rad = math.nan if yaw_rad is None else yaw_rad
        self._motion: SmoothMotion | None = None
        self._down = self._target is None
        self._landed = False
        self._contact_s = 0.0

    def activate(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.LANDING
        self._motion = SmoothMotion(ctx)
        self._down = self._target is None
        self._landed = False
        self._contact_s = 0.0
        if self._target is not None:
            self._target[2] = self._motion.trajectory.position_ned_m[2]

    def update(self, ctx: FlightContext) -> TaskStatus:
        motion = self._motion
        if motion is None:
            self.activate(ctx)
            return self.update(ctx)
        if not ctx.armed or ctx.on_ground or self._landed:
            clear_setpoint(ctx.setpoint, sp.IDLE if ctx.armed else sp.OFF)
            if not self._landed:
                self._landed = True
                ctx.phase = FlightPhase.CRUISE
                ctx.events.append(TouchedDown())
            return TaskStatus.DONE
        motion.synchronise(ctx)
        trajectory = motion.trajectory
        target = self._target
        if target is not None and ctx.position_valid and not self._down:
            motion.fly_to(ctx, target)
            north = float(target[0] - trajectory.position_ned_m[0])
            east = float(target[1] - trajectory.position_ned_m[1])
            self._down = math.hypot(north, east) < _OVER_PLACE_M
        else:
            self._down = True
            height = float(ctx.nav[_NAV_HEIGHT])
            if math.isnan(height):
                height = ctx.height_above_home_m
            self._sink(ctx, motion, descent_speed(height, ctx.multicopter))
        motion.steer(ctx, motion.heading.yaw_rad if math.isnan(self._yaw_rad) else self._yaw_rad)
        motion.write(ctx)
        if self._down:
            ctx.setpoint[sp.POS + 2] = math.nan  # by speed alone: the height of the ground is not known
            ctx.setpoint[sp.ACC + 2] = 0.0
            self._contact_s = self._contact_s + ctx.dt_s if ctx.ground_contact else 0.0
            if ctx.ground_contact:
                ctx.setpoint[sp.POS_HORIZONTAL] = math.nan
                ctx.setpoint[sp.VEL_HORIZONTAL] = math.nan
                ctx.setpoint[sp.ACC_HORIZONTAL] = 0.0
                ctx.setpoint[sp.ACC + 2] = min(_THRUST_GONE_M_S2, _RELIEF_M_S3 * self._contact_s)
            if ctx.maybe_landed:
                ctx.setpoint[sp.VEL + 2] = math.nan
                ctx.setpoint[sp.ACC + 2] = _THRUST_GONE_M_S2
        return TaskStatus.RUNNING

    def _sink(self, ctx: FlightContext, motion: SmoothMotion, speed_m_s: float) -> None:
        target = self._target
        north, east = 0.0, 0.0
        if target is not None:
            # the last metre to the position is flown during the descent
            gain = 0.5 * ctx.multicopter.trajectory_p_1_s
            north = gain * float(target[0] - motion.trajectory.position_ned_m[0])
            east = gain * float(target[1] - motion.trajectory.position_ned_m[1])
        motion.trajectory.stretch = 1.0
        motion.trajectory.track_velocity(north, east, speed_m_s, ctx.dt_s)
