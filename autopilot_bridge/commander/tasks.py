"""The flight task being flown: the initial task of each mode, and its execution."""

from collections.abc import Callable

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.vehicle_tasks import CircleFlown, VehicleTasks
from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import FlightContext, FlightPhase
from autopilot_bridge.flight.task import FlightTask, clear_setpoint

TaskSource = Callable[[], FlightTask]


class TaskRunner:
    """Starts and runs flight tasks.

    Args:
        context: shared with the tasks.
        vehicle: makes the tasks.

    Attributes:
        task: the active task; None while disarmed.
        mission_started: a client has started the mission.
        paused: the task that is paused.
    """

    def __init__(self, context: FlightContext, vehicle: VehicleTasks) -> None:
        self._context = context
        self._vehicle = vehicle
        self._prepared: tuple[FlightMode, TaskSource] | None = None
        self.task: FlightTask | None = None
        self.mission_started = False
        self.paused: FlightTask | None = None

    @property
    def lifting_off(self) -> bool:
        """On the ground, and the task would take off: the automatic disarming waits."""
        return self._context.on_ground and self._vehicle.wants_up(self._context)

    @property
    def ends_on_ground(self) -> bool:
        """The task lands automatically, and a landing ends the flight."""
        return self._vehicle.ends_on_ground(self.task)

    @property
    def orbit(self) -> CircleFlown | None:
        """The circle being flown; None: no circle."""
        return self._vehicle.circle_of(self.task)

    def prepare(self, mode: FlightMode, source: TaskSource) -> None:
        """The next entry of `mode` starts this task instead of its usual one."""
        self._prepared = (mode, source)

    def enter(self, mode: FlightMode) -> None:
        """Start the initial task of a mode; no task while disarmed."""
        if self._prepared is not None and self._prepared[0] is not mode:
            self._prepared = None
        if mode is not FlightMode.MISSION:
            self.mission_started = False
        self.paused = None
        if not self._context.armed:
            return
        source, self._prepared = self._prepared, None
        if source is None:
            self.start(self._vehicle.of_mode(mode, mission_started=self.mission_started))
        else:
            self.start(source[1]())

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
