"""What a class of vehicle flies: the flight task of every mode and request, as one object.

The commander, its task runner and its guidance are the same for every vehicle. They know flight tasks only
through this protocol; `MulticopterTasks` and `FixedWingTasks` implement it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.commander.events import Event
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.flight.context import FlightContext, LandedState
from autopilot_bridge.flight.task import FlightTask, SpeedKind
from autopilot_bridge.flight.yaw import Turn
from autopilot_bridge.mission_plan import MissionItem


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A place to fly to, and how.

    Attributes:
        ned_m: local NED, (3,); NaN components: as it is.
        yaw_rad: heading there; NaN: free. Aircraft don't take it.
        yaw_rate_rad_s: how the nose turns there; NaN: not given. Aircraft don't take it.
        speed_m_s: ground speed of a multicopter, equivalent airspeed of an aircraft; None: the parameter's.
        radius_m: of an aircraft's circle there, positive clockwise seen from above; None: the parameter's.
    """

    ned_m: NDArray[np.float64]
    yaw_rad: float = math.nan
    yaw_rate_rad_s: float = math.nan
    speed_m_s: float | None = None
    radius_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Circle:
    """A circle to fly.

    Attributes:
        centre_ned_m: local NED, (3,); NaN components: as it is.
        radius_m: None: the parameter's.
        speed_m_s: None: the parameter's.
        clockwise: direction seen from above.
        yaw_behaviour: ORBIT_YAW_BEHAVIOUR; aircraft don't take it.
    """

    centre_ned_m: NDArray[np.float64]
    radius_m: float | None = None
    speed_m_s: float | None = None
    clockwise: bool = True
    yaw_behaviour: int = 0


class CircleFlown(NamedTuple):
    """The circle the vehicle is on; a negative radius is counter-clockwise."""

    radius_m: float
    north_m: float
    east_m: float
    down_m: float


@runtime_checkable
class GoAroundTask(Protocol):
    """A flight task whose landing can be broken off."""

    def go_around(self, ctx: FlightContext, height_m: float = math.nan) -> bool:
        """Climb to a height over home (NaN: the parameter's) and come back to the approach.

        False when there is nothing to break off.
        """
        ...


class LandDetector(Protocol):
    """Judges whether the vehicle is on the ground."""

    def update(self, ctx: FlightContext, thrust: float) -> LandedState:
        """Judge, and write `landed_state`, `ground_contact` and `maybe_landed` of the context."""
        ...


class VehicleTasks(Protocol):
    """Makes the flight tasks of one vehicle.

    Attributes:
        offboard: the task that flies streamed setpoints as they come (PX4).
        guided: the task that flies targets smoothly (ArduPilot).
    """

    offboard: Any
    guided: Any

    @property
    def asks_attitude(self) -> bool:
        """The offboard stream asks for positions, velocities or attitudes (PX4 shows it in base_mode)."""
        ...

    @property
    def follows_thrust(self) -> bool:
        """Guided flying follows attitudes (ArduPilot shows it in base_mode)."""
        ...

    def of_mode(self, mode: FlightMode, *, mission_started: bool) -> FlightTask:
        """The task a mode starts with.

        Args:
            mode: the mode entered.
            mission_started: a client started the mission (where the policy waits for that on the ground).
        """
        ...

    def hold(self) -> FlightTask:
        """Stay here."""
        ...

    def takeoff(self, height_m: float | None, yaw_rad: float | None, place: Place) -> FlightTask:
        """Take off.

        Args:
            height_m: over home; None: the parameter.
            yaw_rad: heading of a multicopter's climb; None: the present one.
            place: where an aircraft circles when it is up; NaN: where the climb ends.
        """
        ...

    def hold_after_takeoff(self, task: FlightTask | None) -> FlightTask:
        """What is flown when a take-off is done: the height asked for, not the one reached."""
        ...

    def reposition(self, place: Place) -> FlightTask:
        """Fly to a place and stay there."""
        ...

    def guide_to(self, context: FlightContext, place: Place) -> None:
        """Give the guided task a place to fly to."""
        ...

    def orbit(self, circle: Circle) -> FlightTask:
        """Circle around a place."""
        ...

    def turn(self, context: FlightContext, active: FlightTask | None, turn: Turn) -> FlightTask | None:
        """CONDITION_YAW: point the nose somewhere; the task for it, or None when the active one does it."""
        ...

    def ends_on_ground(self, task: FlightTask | None) -> bool:
        """The task lands by itself, and a landing ends the flight."""
        ...

    def wants_up(self, context: FlightContext) -> bool:
        """On the ground, what is flown would lift off: the automatic disarming waits."""
        ...

    def watch(self, task: FlightTask | None, context: FlightContext) -> Sequence[Event]:
        """What the active task has come to since the last call, as far as pilots are told."""
        ...

    def distance_to(self, item: MissionItem, context: FlightContext) -> float:
        """How far off an item an aircraft passed it, m; NaN where nobody is told."""
        ...

    def circle_of(self, task: FlightTask | None) -> CircleFlown | None:
        """The circle being flown, as ORBIT_EXECUTION_STATUS tells it; None while there is none."""
        ...

    def speed_kind(self, kind: int) -> SpeedKind:
        """The speed that SPEED_TYPE `kind` of DO_CHANGE_SPEED sets on this vehicle."""
        ...

    def with_speeds(self, parameters: Any, speeds_m_s: Mapping[SpeedKind, float]) -> Any:
        """Flight parameters with commanded speeds in place of theirs."""
        ...
