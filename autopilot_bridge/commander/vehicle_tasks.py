"""The flight tasks of a class of vehicle, for every mode and request, as one object.

The commander, its task runner and its guidance are the same for every vehicle. They use flight tasks only
through `VehicleTasks`; `MulticopterTasks` and `FixedWingTasks` implement it.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.commander.events import Event
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.policy import CommanderPolicy
from autopilot_bridge.flight.context import FlightContext, LandedState
from autopilot_bridge.flight.heading import Turn
from autopilot_bridge.flight.task import FlightTask, GuidedKind, OffboardKind, SpeedKind
from autopilot_bridge.mission_plan import MissionItem, MissionStore


class SetpointStream:
    """Newest streamed setpoint: the tasks that fly it, its time of arrival, its requirements.

    The stream is accepted in every mode, since PX4 enters OFFBOARD only while a stream is running.

    Args:
        vehicle: makes the vehicle's tasks.

    Attributes:
        needs_position: the newest setpoint can't be flown without a position.
    """

    def __init__(self, vehicle: VehicleTasks) -> None:
        self._vehicle = vehicle
        self.needs_position = False
        self._time_us = -1

    @property
    def offboard(self) -> Any:
        """The task that flies setpoints directly (PX4); its class depends on the vehicle."""
        return self._vehicle.offboard

    @property
    def guided(self) -> Any:
        """The task that flies smoothly to targets (ArduPilot); its class depends on the vehicle."""
        return self._vehicle.guided

    def note(self, time_us: int, *, needs_position: bool) -> None:
        """A setpoint was accepted."""
        self._time_us = time_us
        self.needs_position = needs_position

    def age_s(self, time_us: int) -> float:
        """Age of the newest setpoint; infinite when there is none."""
        return (time_us - self._time_us) * 1e-6 if self._time_us >= 0 else math.inf

    @property
    def attitude_setpoints(self) -> bool:
        """The offboard stream commands positions, velocities or attitudes (PX4 shows it in base_mode)."""
        return self._vehicle.asks_attitude

    @property
    def thrust_setpoints(self) -> bool:
        """Guided flight follows attitude setpoints (ArduPilot shows it in base_mode)."""
        return self._vehicle.follows_thrust


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetPosition:
    """A target position, with its heading, speed and radius.

    Attributes:
        ned_m: local NED, (3,); NaN components: unchanged.
        yaw_rad: heading there; NaN: free. Not used by aircraft.
        yaw_rate_rad_s: yaw rate there; NaN: not given. Not used by aircraft.
        speed_m_s: ground speed of a multicopter, equivalent airspeed of an aircraft; None: the parameter's.
        radius_m: radius of an aircraft's circle there, positive clockwise seen from above; None: the
            parameter's.
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
        centre_ned_m: local NED, (3,); NaN components: unchanged.
        radius_m: None: the parameter's.
        speed_m_s: None: the parameter's.
        clockwise: direction seen from above.
        yaw_behaviour: ORBIT_YAW_BEHAVIOUR; not used by aircraft.
    """

    centre_ned_m: NDArray[np.float64]
    radius_m: float | None = None
    speed_m_s: float | None = None
    clockwise: bool = True
    yaw_behaviour: int = 0


class CircleFlown(NamedTuple):
    """The circle being flown; a negative radius is counter-clockwise."""

    radius_m: float
    north_m: float
    east_m: float
    down_m: float


@runtime_checkable
class GoAroundTask(Protocol):
    """A flight task whose landing can be aborted."""

    def go_around(self, ctx: FlightContext, height_m: float = math.nan) -> bool:
        """Climb to a height over home (NaN: the parameter's) and fly the approach again.

        False when there is no landing to abort.
        """
        ...


class LandDetector(Protocol):
    """Detects whether the vehicle is on the ground."""

    def update(self, ctx: FlightContext, thrust: float) -> LandedState:
        """Update, and write `landed_state`, `ground_contact` and `maybe_landed` of the context."""
        ...


class VehicleTasks(ABC):
    """Makes the flight tasks of one vehicle.

    Args:
        context: shared with the tasks.
        missions: the plan the mission task flies.
        policy: the flavour's rules.

    Attributes:
        offboard: the task that flies streamed setpoints directly (PX4).
        guided: the task that flies smoothly to targets (ArduPilot).
    """

    offboard: Any
    guided: Any

    def __init__(self, context: FlightContext, missions: MissionStore, policy: CommanderPolicy) -> None:
        self._context = context
        self._missions = missions
        self._policy = policy

    @property
    def asks_attitude(self) -> bool:
        """The offboard stream commands positions, velocities or attitudes (PX4 shows it in base_mode)."""
        return self.offboard.kind in (OffboardKind.TRAJECTORY, OffboardKind.ATTITUDE)

    @property
    def follows_thrust(self) -> bool:
        """Guided flight follows attitude setpoints (ArduPilot shows it in base_mode)."""
        return bool(self.guided.kind is GuidedKind.ATTITUDE)

    @abstractmethod
    def of_mode(self, mode: FlightMode, *, mission_started: bool) -> FlightTask:
        """The initial task of a mode.

        Args:
            mode: the mode entered.
            mission_started: a client has started the mission (where the policy requires that on the ground).
        """

    @abstractmethod
    def hold(self) -> FlightTask:
        """Hold the present position."""

    @abstractmethod
    def takeoff(self, height_m: float | None, yaw_rad: float | None, place: TargetPosition) -> FlightTask:
        """Take off.

        Args:
            height_m: height over home; None: the parameter.
            yaw_rad: heading of a multicopter's climb; None: the present one.
            place: the position at which an aircraft circles after the climb; NaN: where the climb ends.
        """

    @abstractmethod
    def hold_after_takeoff(self, task: FlightTask | None) -> FlightTask:
        """The task after a take-off: it holds the commanded height, not the height that was reached."""

    @abstractmethod
    def reposition(self, place: TargetPosition) -> FlightTask:
        """Fly to a position and stay there."""

    @abstractmethod
    def guide_to(self, context: FlightContext, place: TargetPosition) -> None:
        """Set the target position of the guided task."""

    @abstractmethod
    def orbit(self, circle: Circle) -> FlightTask:
        """Circle around a position."""

    def turn(self, context: FlightContext, active: FlightTask | None, turn: Turn) -> FlightTask | None:
        """CONDITION_YAW: turn the nose. Returns the task for it; None when the active task does it, and for
        an aircraft, which can't turn on the spot."""
        return None

    @abstractmethod
    def ends_on_ground(self, task: FlightTask | None) -> bool:
        """The task lands automatically, and a landing ends the flight."""

    @abstractmethod
    def wants_up(self, context: FlightContext) -> bool:
        """On the ground, the task would take off: the automatic disarming waits."""

    def watch(self, task: FlightTask | None, context: FlightContext) -> Sequence[Event]:
        """The phase events of the active task since the last call that are reported to pilots; none of a
        multicopter, whose phases are modes."""
        return ()

    def distance_to(self, item: MissionItem, context: FlightContext) -> float:
        """The distance at which an aircraft passed an item, m; NaN where it is not reported, as of a
        multicopter, which stops at an item's position."""
        return math.nan

    @abstractmethod
    def circle_of(self, task: FlightTask | None) -> CircleFlown | None:
        """The circle being flown, as reported in ORBIT_EXECUTION_STATUS; None: no circle."""

    @abstractmethod
    def speed_kind(self, kind: int) -> SpeedKind:
        """The speed that SPEED_TYPE `kind` of DO_CHANGE_SPEED sets on this vehicle."""

    @abstractmethod
    def with_speeds(self, parameters: Any, speeds_m_s: Mapping[SpeedKind, float]) -> Any:
        """Flight parameters with the commanded speeds instead of their own."""
