"""The interface of a flight task: one kind of manoeuvre, updated at 50 Hz, that writes the control setpoint.

The idle task is the one that all classes of vehicle share.

What a stream of setpoints can contain, for both classes of vehicle.
"""

import math
from enum import IntEnum
from typing import Final, Protocol, runtime_checkable

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import Array, FlightContext, FlightPhase


class TaskStatus(IntEnum):
    """Whether a task is finished. A task that is DONE keeps holding when it is updated again."""

    RUNNING = 0
    DONE = 1


class FlightTask(Protocol):
    """One kind of manoeuvre.

    `activate` is called once, when the commander makes the task the active one; `update` every 20 ms while it
    is active. A task that can't be flown (no position) degrades to a state that can be held, and never writes
    invalid values.
    """

    def activate(self, ctx: FlightContext) -> None:
        """Continue from the present state of the vehicle."""
        ...

    def update(self, ctx: FlightContext) -> TaskStatus:
        """Write `ctx.setpoint` for the next period."""
        ...


class SpeedKind(IntEnum):
    """The kind of speed in a DO_CHANGE_SPEED; AIRSPEED and GROUND_SPEED are the same on a multicopter."""

    AIRSPEED = 0
    GROUND_SPEED = 1
    CLIMB = 2
    DESCENT = 3


@runtime_checkable
class SpeedTask(Protocol):
    """A flight task that accepts a new speed on the present leg (DO_CHANGE_SPEED)."""

    def change_speed(self, ctx: FlightContext, kind: SpeedKind, speed_m_s: float | None) -> None:
        """Fly at this speed; None: at the speed of the context's parameters."""
        ...


def clear_setpoint(setpoint: Array, level: float) -> None:
    """Clear every field (NaN: not controlled) and set the level."""
    setpoint.fill(math.nan)
    setpoint[sp.LEVEL] = level


class IdleTask:
    """Motors off while disarmed, at idle while armed."""

    def activate(self, ctx: FlightContext) -> None:
        ctx.phase = FlightPhase.CRUISE

    def update(self, ctx: FlightContext) -> TaskStatus:
        clear_setpoint(ctx.setpoint, sp.IDLE if ctx.armed else sp.OFF)
        return TaskStatus.RUNNING


NAN3: Final = (math.nan, math.nan, math.nan)

AnyVector = Array | tuple[float, float, float]
"""Three components, local NED or body FRD."""


class OffboardKind(IntEnum):
    """The quantity that the latest setpoint controls."""

    NONE = 0
    TRAJECTORY = 1
    ATTITUDE = 2
    RATES = 3


class GuidedKind(IntEnum):
    """The kind of the present target."""

    HOLD = 0
    POSITION = 1
    VELOCITY = 2
    ACCELERATION = 3
    TRAJECTORY = 4  # position and velocity together, streamed
    ATTITUDE = 5
    HEADING = 6  # of a fixed wing: a constant direction
