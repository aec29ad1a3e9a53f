"""External setpoints, flown directly: PX4's Offboard."""

import math
from typing import Final

import numpy as np

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase
from autopilot_bridge.flight.multicopter.hold import HoldTask
from autopilot_bridge.flight.multicopter.takeoff import TakeoffRamp
from autopilot_bridge.flight.task import NAN3, AnyVector, OffboardKind, TaskStatus, clear_setpoint
from autopilot_bridge.navigation import layout as nav_layout

_WANTS_UP_M: Final = 0.2
_WANTS_UP_M_S: Final = 0.1


class OffboardTask:
    """Flies the latest setpoint without smoothing. Before the first one it holds.

    The caller (commander) detects lost setpoints; here the last one stays active.

    Attributes:
        kind: the quantity that the latest setpoint controls.
    """

    def __init__(self) -> None:
        self.kind = OffboardKind.NONE
        self._latest: Array = np.full(sp.SETPOINT_SIZE, np.nan)
        self._hold = HoldTask()
        self._ramp: TakeoffRamp | None = None
        self._active = False

    def set_trajectory(
        self,
        position_ned_m: AnyVector = NAN3,
        velocity_ned_m_s: AnyVector = NAN3,
        acceleration_ned_m_s2: AnyVector = NAN3,
        yaw_rad: float = math.nan,
        yaw_rate_rad_s: float = math.nan,
    ) -> None:
        """Set a new trajectory setpoint; NaN components are not controlled."""
        clear_setpoint(self._latest, sp.TRAJECTORY)
        self._latest[sp.POS_NED_M] = position_ned_m
        self._latest[sp.VEL_NED_M_S] = velocity_ned_m_s
        self._latest[sp.ACC_NED_M_S2] = acceleration_ned_m_s2
        self._latest[sp.YAW_RAD] = yaw_rad
        self._latest[sp.YAW_RATE_RAD_S] = yaw_rate_rad_s
        self.kind = OffboardKind.TRAJECTORY

    def set_attitude(
        self,
        q_ned_from_frd: Array | tuple[float, float, float, float],
        thrust: float,
        rates_frd_rad_s: AnyVector = NAN3,
    ) -> None:
        """Set a new attitude setpoint with collective thrust 0..1; finite rates are added as feed-forward."""
        clear_setpoint(self._latest, sp.ATTITUDE)
        self._latest[sp.Q_NED_FROM_FRD] = q_ned_from_frd
        self._latest[sp.RATES_FRD_RAD_S] = rates_frd_rad_s
        self._latest[sp.THRUST] = thrust
        self.kind = OffboardKind.ATTITUDE

    def set_rates(self, rates_frd_rad_s: AnyVector, thrust: float) -> None:
        """Set a new body-rate setpoint with collective thrust 0..1."""
        clear_setpoint(self._latest, sp.RATES)
        self._latest[sp.RATES_FRD_RAD_S] = rates_frd_rad_s
        self._latest[sp.THRUST] = thrust
        self.kind = OffboardKind.RATES

    def activate(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.CRUISE
        self._active = True
        self._ramp = TakeoffRamp(ctx)
        self._hold.activate(ctx)

    def _wants_up(self, ctx: FlightContext) -> bool:
        latest = self._latest
        if self.kind is not OffboardKind.TRAJECTORY:
            return bool(latest[sp.THRUST] > 0.1)
        down = float(ctx.nav[nav_layout.POS_NED_M][2])
        return bool(
            latest[2] < down - _WANTS_UP_M
            or latest[5] < -_WANTS_UP_M_S
            or (math.isnan(latest[2]) and math.isnan(latest[5]) and latest[8] < 0.0)
        )

    def update(self, ctx: FlightContext) -> TaskStatus:
        if self._ramp is None:
            self.activate(ctx)
            return self.update(ctx)
        if self.kind is OffboardKind.NONE:
            return self._hold.update(ctx)
        if self.kind is not OffboardKind.TRAJECTORY:
            # the thrust comes from the sender: no ramp, but no thrust while disarmed
            if not ctx.armed:
                clear_setpoint(ctx.setpoint, sp.OFF)
            elif ctx.on_ground and not self._wants_up(ctx):
                clear_setpoint(ctx.setpoint, sp.IDLE)
            else:
                ctx.setpoint[:] = self._latest
            return TaskStatus.RUNNING
        if self._ramp.update(ctx, self._wants_up(ctx), ctx.multicopter.takeoff_speed_m_s):
            ctx.setpoint[:] = self._latest
        return TaskStatus.RUNNING
