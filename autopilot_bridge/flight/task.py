"""What a flight task is: one kind of flying, updated at 50 Hz, that writes the control setpoint."""

import math
from enum import IntEnum
from typing import Protocol, runtime_checkable

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


class SpeedKind(IntEnum):
    """Which speed a DO_CHANGE_SPEED is about; AIRSPEED and GROUND_SPEED are one on a multicopter."""

    AIRSPEED = 0
    GROUND_SPEED = 1
    CLIMB = 2
    DESCENT = 3


@runtime_checkable
class SpeedTask(Protocol):
    """A flight task that takes a new speed on the leg it is flying (DO_CHANGE_SPEED)."""

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Fly on at this speed; None: at the one of the context's parameters."""
        ...


def clear_setpoint(setpoint: Array, level: float) -> None:
    """Blank every field (NaN: not controlled) and set the level."""
    setpoint[:] = math.nan
    setpoint[sp.LEVEL] = level
