"""Tasks that fly smoothly in the air and stay idle on the ground: hold a position, brake."""

import math
from abc import ABC, abstractmethod

import numpy as np

from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase, TaskFinished
from autopilot_bridge.flight.multicopter.ground import TakeoffRamp
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.task import TaskStatus


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
