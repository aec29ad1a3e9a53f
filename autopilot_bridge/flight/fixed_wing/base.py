"""What all fixed-wing tasks share: reading the state, resting while disarmed or on the ground."""

import math
from abc import ABC, abstractmethod
from typing import ClassVar, Protocol, runtime_checkable

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import FlightContext, FlightPhase
from autopilot_bridge.flight.fixed_wing.path_guidance import PathGuidance
from autopilot_bridge.flight.fixed_wing.state import AircraftState, FlightCommand
from autopilot_bridge.flight.task import TaskStatus, clear_setpoint


class AircraftTask(ABC):
    """A fixed-wing flight task. Disarmed it writes OFF; on the ground IDLE, unless it works there too.

    A task that rested on the ground begins afresh when the aircraft is in the air.
    """

    works_on_ground: ClassVar[bool] = False

    def __init__(self) -> None:
        self._state = AircraftState()
        self._command = FlightCommand()
        self._active = False
        self._rested = False

    def activate(self, ctx: FlightContext) -> None:
        """Take over from the present state."""
        ctx.phase = FlightPhase.CRUISE
        self._active = True
        self._rested = False
        self._state.read(ctx)
        self._begin(ctx)

    def update(self, ctx: FlightContext) -> TaskStatus:
        """Write `ctx.setpoint` for the next period."""
        if not self._active:
            self.activate(ctx)
        if not ctx.armed:
            clear_setpoint(ctx.setpoint, sp.OFF)
            return self._rest(ctx)
        if ctx.on_ground and not self.works_on_ground:
            clear_setpoint(ctx.setpoint, sp.IDLE)
            return self._rest(ctx)
        if self._rested and not self.works_on_ground:
            self.activate(ctx)
        self._state.read(ctx)
        self._command.clear()
        return self._fly(ctx)

    def _rest(self, ctx: FlightContext) -> TaskStatus:
        """On the ground, or disarmed: the setpoint is written already."""
        self._rested = True
        return TaskStatus.RUNNING

    @abstractmethod
    def _begin(self, ctx: FlightContext) -> None:
        """Set out from `self._state`."""

    @abstractmethod
    def _fly(self, ctx: FlightContext) -> TaskStatus:
        """Fill `self._command` (which is clear) from `self._state`, and write it."""


@runtime_checkable
class LandingTask(Protocol):
    """A task that may be landing."""

    def go_around(self, ctx: FlightContext, height_m: float = math.nan) -> bool:
        """Break the landing off; False when none is flown."""
        ...


class GuidedPath:
    """Path guidance for one task, made when it first flies (the parameters are the context's)."""

    def __init__(self) -> None:
        self._guidance: PathGuidance | None = None
        self._parameters: object = None

    def of(self, ctx: FlightContext) -> PathGuidance:
        """The guidance, by the newest parameters."""
        parameters = ctx.fixed_wing
        guidance = self._guidance
        if guidance is None:
            guidance = self._guidance = PathGuidance(parameters)
        elif parameters is not self._parameters:
            guidance.set_parameters(parameters)
        self._parameters = parameters
        return guidance
