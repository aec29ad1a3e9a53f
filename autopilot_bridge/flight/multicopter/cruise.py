"""The common part of tasks that fly smoothly in the air, and stay idle on the ground."""

from abc import ABC, abstractmethod

from autopilot_bridge.flight.context import FlightContext, FlightPhase
from autopilot_bridge.flight.multicopter.ground import TakeoffRamp
from autopilot_bridge.flight.multicopter.motion import SmoothMotion
from autopilot_bridge.flight.task import TaskStatus


class CruiseTask(ABC):
    """A flight task that never takes off by itself: on the ground it keeps the motors at idle."""

    __slots__ = ("_motion", "_ramp")

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
