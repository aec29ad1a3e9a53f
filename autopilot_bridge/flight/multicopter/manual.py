"""Flight by the sticks: rates, attitude, height, position."""

import math
from enum import IntEnum

import numpy as np

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import FlightContext, FlightPhase
from autopilot_bridge.flight.multicopter.avoidance import limited_velocity
from autopilot_bridge.flight.multicopter.hold import HoldTask
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.multicopter.takeoff import TakeoffRamp
from autopilot_bridge.flight.parameters import FlightParameters
from autopilot_bridge.flight.task import FlightTask, TaskStatus, clear_setpoint
from autopilot_bridge.navigation import layout as nav_layout
from flightsim.foundation.rotations import quaternion_from_euler

_STICK_UP = 0.15  # throttle above the middle that means "take off"
_STICK_DOWN = -0.9


class ManualMode(IntEnum):
    """The meaning of the sticks."""

    ACRO = 0  # body rates and thrust
    STABILIZED = 1  # tilt, yaw rate and thrust
    ALTITUDE = 2  # tilt, yaw rate and climb rate
    POSITION = 3  # velocity, yaw rate and climb rate


def stick(value: float, parameters: FlightParameters) -> float:
    """Stick with dead zone and cubic expo (PX4 MPC_HOLD_DZ, MPC_XY_MAN_EXPO), -1..1."""
    dead = parameters.manual_deadzone
    if abs(value) <= dead:
        return 0.0
    live = math.copysign((abs(value) - dead) / (1.0 - dead), value)
    expo = parameters.manual_expo
    return (1.0 - expo) * live + expo * live**3


def throttle_thrust(throttle: float, hover_thrust: float, minimum: float) -> float:
    """Thrust of a throttle stick -1..1 whose middle is hover (PX4 MPC_THR_CURVE 0), piecewise linear."""
    if throttle < 0.0:
        return minimum + (hover_thrust - minimum) * (throttle + 1.0)
    return hover_thrust + (1.0 - hover_thrust) * throttle


class ManualTask:
    """Flies by the pilot's sticks; without a pilot they count as centred.

    POSITION degrades to ALTITUDE without a horizontal velocity.

    Args:
        kind: the meaning of the sticks.
    """

    def __init__(self, kind: ManualMode) -> None:
        self.kind = kind
        self._motion: SmoothMotion | None = None
        self._ramp: TakeoffRamp | None = None
        self._yaw_rad = 0.0
        self._hold_down_m = math.nan

    def activate(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.CRUISE
        self._motion = SmoothMotion(ctx)
        self._ramp = TakeoffRamp(ctx)
        self._yaw_rad = float(ctx.nav[nav_layout.YAW])
        self._hold_down_m = math.nan

    def update(self, ctx: FlightContext) -> TaskStatus:
        motion, ramp = self._motion, self._ramp
        if motion is None or ramp is None:
            self.activate(ctx)
            return self.update(ctx)
        sticks = ctx.sticks
        throttle = sticks.throttle if sticks.valid else 0.0
        roll = stick(sticks.roll, ctx.multicopter) if sticks.valid else 0.0
        pitch = stick(sticks.pitch, ctx.multicopter) if sticks.valid else 0.0
        yaw = stick(sticks.yaw, ctx.multicopter) if sticks.valid else 0.0
        if self.kind in (ManualMode.ACRO, ManualMode.STABILIZED):
            self._fly_thrust(ctx, roll, pitch, yaw, throttle if sticks.valid else -1.0)
            return TaskStatus.RUNNING
        if not ramp.update(ctx, sticks.valid and throttle > _STICK_UP, ctx.multicopter.takeoff_speed_m_s):
            motion.restart(ctx)
            self._yaw_rad = float(ctx.nav[nav_layout.YAW])
            self._hold_down_m = math.nan
            return TaskStatus.RUNNING
        climb = stick(throttle, ctx.multicopter)
        p = ctx.multicopter
        climb_m_s = climb * (p.manual_climb_speed_m_s if climb > 0.0 else p.manual_descend_speed_m_s)
        if self.kind is ManualMode.POSITION and ctx.velocity_valid:
            self._fly_velocity(ctx, motion, roll, pitch, yaw, climb_m_s)
        else:
            self._fly_height(ctx, motion, roll, pitch, yaw, climb_m_s)
        return TaskStatus.RUNNING

    def _turn(self, ctx: FlightContext, yaw: float) -> float:
        """Advance the heading by the yaw stick; returns the rate. The heading's lead over the vehicle is
        limited.
        """
        rate = yaw * ctx.multicopter.manual_yaw_rate_rad_s
        self._yaw_rad += rate * ctx.dt_s
        lead = math.remainder(self._yaw_rad - float(ctx.nav[nav_layout.YAW]), 2.0 * math.pi)
        if abs(lead) > 0.5 and rate != 0.0:
            self._yaw_rad = float(ctx.nav[nav_layout.YAW]) + math.copysign(0.5, lead)
        return rate

    def _write_tilt(self, ctx: FlightContext, roll: float, pitch: float, yaw: float) -> None:
        tilt = ctx.multicopter.manual_tilt_rad
        scale = min(1.0, 1.0 / max(1e-9, math.hypot(roll, pitch)))
        rate = self._turn(ctx, yaw)
        clear_setpoint(ctx.setpoint, sp.ATTITUDE)
        q = np.zeros(4)
        quaternion_from_euler(roll * scale * tilt, -pitch * scale * tilt, self._yaw_rad, q)
        ctx.setpoint[sp.Q_NED_FROM_FRD] = q
        ctx.setpoint[sp.YAW_RATE_RAD_S] = rate

    def _fly_thrust(self, ctx: FlightContext, roll: float, pitch: float, yaw: float, throttle: float) -> None:
        p = ctx.multicopter
        if not ctx.armed:
            clear_setpoint(ctx.setpoint, sp.OFF)
            return
        if ctx.on_ground and throttle < _STICK_DOWN:
            clear_setpoint(ctx.setpoint, sp.IDLE)
            self._yaw_rad = float(ctx.nav[nav_layout.YAW])
            return
        if self.kind is ManualMode.ACRO:
            clear_setpoint(ctx.setpoint, sp.RATES)
            ctx.setpoint[sp.RATES_FRD_RAD_S] = (
                roll * p.acro_rate_rad_s,
                -pitch * p.acro_rate_rad_s,
                yaw * p.acro_yaw_rate_rad_s,
            )
        else:
            self._write_tilt(ctx, roll, pitch, yaw)
        ctx.setpoint[sp.THRUST] = throttle_thrust(throttle, ctx.hover_thrust, p.manual_throttle_min)

    def _fly_height(
        self,
        ctx: FlightContext,
        motion: SmoothMotion,
        roll: float,
        pitch: float,
        yaw: float,
        climb_m_s: float,
    ) -> None:
        self._write_tilt(ctx, roll, pitch, yaw)
        down = float(ctx.nav[nav_layout.POS_NED_M][2])
        speed_down = float(ctx.nav[nav_layout.VEL_NED_M_S][2])
        if climb_m_s != 0.0:
            self._hold_down_m = math.nan
        elif math.isnan(self._hold_down_m) and abs(speed_down) < 0.3:
            self._hold_down_m = down + 0.3 * speed_down
        ctx.setpoint[sp.POS + 2] = self._hold_down_m if ctx.altitude_valid else math.nan
        ctx.setpoint[sp.VEL + 2] = -climb_m_s
        motion.trajectory.reset(ctx.nav[nav_layout.POS_NED_M], ctx.nav[nav_layout.VEL_NED_M_S])

    def _fly_velocity(
        self,
        ctx: FlightContext,
        motion: SmoothMotion,
        roll: float,
        pitch: float,
        yaw: float,
        climb_m_s: float,
    ) -> None:
        p = ctx.multicopter
        motion.synchronise(ctx)
        scale = p.manual_speed_m_s * min(1.0, 1.0 / max(1e-9, math.hypot(roll, pitch)))
        heading = float(ctx.nav[nav_layout.YAW])
        c, s = math.cos(heading), math.sin(heading)
        north = scale * (pitch * c - roll * s)
        east = scale * (pitch * s + roll * c)
        if p.avoidance.enabled:
            north, east = limited_velocity(ctx, north, east, heading)
        motion.trajectory.wait_for(ctx.nav[nav_layout.POS_NED_M], p.trajectory_error_max_m)
        dt = ctx.dt_s * motion.trajectory.stretch
        motion.trajectory.track_velocity(north, east, -climb_m_s, dt)
        rate = self._turn(ctx, yaw)
        motion.heading.reset(self._yaw_rad, rate)
        motion.write(ctx)


class LoiterTask:
    """Flies by the sticks of a pilot, and holds without a pilot.

    A simulated radio with untouched sticks does not count as a pilot: its throttle is down, and the vehicle
    would descend to the ground.
    """

    def __init__(self) -> None:
        self._hold: FlightTask = HoldTask()
        self._pilot: FlightTask = ManualTask(ManualMode.POSITION)
        self._task: FlightTask = self._hold

    def activate(self, ctx: FlightContext) -> None:
        self._task = self._wanted(ctx)
        self._task.activate(ctx)

    def update(self, ctx: FlightContext) -> TaskStatus:
        wanted = self._wanted(ctx)
        if wanted is not self._task:
            self._task = wanted
            wanted.activate(ctx)
        self._task.update(ctx)
        return TaskStatus.RUNNING

    def _wanted(self, ctx: FlightContext) -> FlightTask:
        return self._pilot if ctx.sticks.valid and not ctx.sticks.simulated else self._hold
