"""The flight task being flown: which one a mode starts with, and running it."""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.setpoints import SetpointStream
from autopilot_bridge.control import setpoint as sp
from autopilot_bridge.flight.context import FlightContext, FlightPhase
from autopilot_bridge.flight.hold import BrakeTask, HoldTask, IdleTask
from autopilot_bridge.flight.land import LandTask
from autopilot_bridge.flight.loiter import LoiterTask
from autopilot_bridge.flight.manual import ManualMode, ManualTask
from autopilot_bridge.flight.mission import MissionTask
from autopilot_bridge.flight.orbit import OrbitTask, circle_ahead
from autopilot_bridge.flight.return_home import ReturnTask
from autopilot_bridge.flight.takeoff import TakeoffTask
from autopilot_bridge.flight.task import FlightTask, clear_setpoint
from autopilot_bridge.mission_plan import MissionStore

_MANUAL: Final = {
    FlightMode.MANUAL: ManualMode.STABILIZED,
    FlightMode.STABILIZED: ManualMode.STABILIZED,
    FlightMode.ACRO: ManualMode.ACRO,
    FlightMode.ALTITUDE: ManualMode.ALTITUDE,
    FlightMode.POSITION: ManualMode.POSITION,
    FlightMode.POSITION_SLOW: ManualMode.POSITION,
    FlightMode.POSHOLD: ManualMode.POSITION,
}

TaskSource = Callable[[], FlightTask]


class TaskRunner:
    """Starts and runs flight tasks.

    Args:
        context: shared with the tasks.
        missions: the plan the mission task flies.
        setpoints: the stream that offboard and guided flying follow.
        mission_waits: on the ground a mission is held until `mission_started` is set.
        first_item: the first item to fly.
        hold_by_sticks: a pilot's sticks move the vehicle in HOLD (ArduPilot's LOITER).

    Attributes:
        task: the active task; None while disarmed.
        mission_started: a client started the mission.
        paused: the task was put aside for a pause.
    """

    def __init__(
        self,
        context: FlightContext,
        missions: MissionStore,
        setpoints: SetpointStream,
        *,
        mission_waits: bool,
        first_item: int,
        hold_by_sticks: bool,
    ) -> None:
        self._context = context
        self._missions = missions
        self._setpoints = setpoints
        self._mission_waits = mission_waits
        self._first_item = first_item
        self._hold_by_sticks = hold_by_sticks
        self._prepared: tuple[FlightMode, TaskSource] | None = None
        self.task: FlightTask | None = None
        self.mission_started = False
        self.paused: FlightTask | None = None

    @property
    def lifting_off(self) -> bool:
        """On the ground, and the task wants up: the automatic disarming waits."""
        flying = bool(self._context.setpoint[sp.LEVEL] > sp.IDLE)
        return self._context.on_ground and (flying or self._context.phase is FlightPhase.TAKEOFF)

    @property
    def ends_on_ground(self) -> bool:
        """The task lands by itself, and a landing ends the flight."""
        return isinstance(self.task, LandTask | ReturnTask | MissionTask)

    @property
    def orbit(self) -> tuple[float, float, float, float] | None:
        """(radius m, negative counter-clockwise; centre north, east, down m) while circling, else None."""
        task = self.task
        if not isinstance(task, OrbitTask) or not task.circling:
            return None
        north_m, east_m, down_m = (float(value) for value in task.centre_ned_m)
        return math.copysign(task.radius_m, task.velocity_m_s), north_m, east_m, down_m

    def prepare(self, mode: FlightMode, source: TaskSource) -> None:
        """The next entry of `mode` flies this task instead of its usual one."""
        self._prepared = (mode, source)

    def enter(self, mode: FlightMode) -> None:
        """Fly what a mode starts with; nothing while disarmed."""
        if self._prepared is not None and self._prepared[0] is not mode:
            self._prepared = None
        if mode is not FlightMode.MISSION:
            self.mission_started = False
        self.paused = None
        if not self._context.armed:
            return
        source, self._prepared = self._prepared, None
        self.start(self._usual(mode) if source is None else source[1]())

    def start(self, task: FlightTask) -> None:
        """Make a task the active one."""
        self.task = task
        task.activate(self._context)

    def stop(self) -> None:
        """Disarmed: no task, motors off."""
        self.task = None
        self.paused = None
        self.mission_started = False
        self._context.phase = FlightPhase.CRUISE
        clear_setpoint(self._context.setpoint, sp.OFF)

    def update(self) -> None:
        """Write the setpoint for the next period."""
        context = self._context
        if not context.armed or self.task is None:
            clear_setpoint(context.setpoint, sp.OFF)
            return
        self.task.update(context)

    def _usual(self, mode: FlightMode) -> FlightTask:
        manual = _MANUAL.get(mode)
        if manual is not None:
            return ManualTask(manual)
        match mode:
            case FlightMode.TAKEOFF:
                return TakeoffTask()
            case FlightMode.MISSION:
                if self._mission_waits and self._context.on_ground and not self.mission_started:
                    return IdleTask()
                return MissionTask(self._missions, first_item=self._first_item)
            case FlightMode.OFFBOARD:
                return self._setpoints.offboard
            case FlightMode.GUIDED | FlightMode.GUIDED_NOGPS:
                self._setpoints.guided.set_hold(self._context)
                return self._setpoints.guided
            case FlightMode.RETURN | FlightMode.SMART_RETURN | FlightMode.AUTO_RETURN:
                return ReturnTask()
            case FlightMode.LAND | FlightMode.PRECISION_LAND | FlightMode.DESCEND:
                return LandTask()
            case FlightMode.ORBIT:
                return OrbitTask(np.full(3, math.nan))
            case FlightMode.CIRCLE:
                return OrbitTask(circle_ahead(self._context, self._context.parameters.orbit_radius_m))
            case FlightMode.BRAKE:
                return BrakeTask()
            case FlightMode.TERMINATION:
                return IdleTask()
            case FlightMode.HOLD if self._hold_by_sticks:
                return LoiterTask()
        return HoldTask()
