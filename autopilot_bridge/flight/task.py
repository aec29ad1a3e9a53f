"""What a flight task is: one kind of flying, updated at 50 Hz, that writes the control setpoint."""

import math
from enum import IntEnum
from typing import Protocol

from autopilot_bridge.control import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext


class TaskStatus(IntEnum):
    """Whether a task has still something to do. A task that is DONE goes on holding when updated again."""

    RUNNING = 0
    DONE = 1


class FlightTask(Protocol):
    """One kind of flying.

    `activate` is called once, when the commander makes the task the active one; `update` every 20 ms while
    it is. A task that can't do its work (no position) degrades to what can be held and never writes
    nonsense.
    """

    def activate(self, ctx: FlightContext) -> None:
        """Take over from whatever flew before, from the present state."""
        ...

    def update(self, ctx: FlightContext) -> TaskStatus:
        """Write `ctx.setpoint` for the next period."""
        ...


def clear_setpoint(setpoint: Array, level: float) -> None:
    """Blank every field (NaN: not controlled) and set the level."""
    setpoint[:] = math.nan
    setpoint[sp.LEVEL] = level
