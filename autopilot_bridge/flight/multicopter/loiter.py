"""ArduPilot's LOITER: the sticks move the vehicle, and it holds the position when they are centred."""

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.multicopter.hold import HoldTask
from autopilot_bridge.flight.multicopter.manual import ManualMode, ManualTask
from autopilot_bridge.flight.task import FlightTask, TaskStatus


class LoiterTask:
    """Flies by the sticks of a pilot, and holds without a pilot.

    A simulated radio with untouched sticks does not count as a pilot: its throttle is down, and the vehicle
    would descend to the ground.
    """

    __slots__ = ("_hold", "_pilot", "_task")

    def __init__(self) -> None:
        self._hold: FlightTask = HoldTask()
        self._pilot: FlightTask = ManualTask(ManualMode.POSITION)
        self._task: FlightTask = self._hold

    def activate(self, ctx: FlightContext) -> None:
        self._task = self._wanted(ctx)
        self._task.activate(ctx)

    def update(self, ctx: FlightContext) -> TaskStatus:
        wanted = self._wanted(ctx)
        if wanted is not self._task:
            self._task = wanted
            wanted.activate(ctx)
        self._task.update(ctx)
        return TaskStatus.RUNNING

    def _wanted(self, ctx: FlightContext) -> FlightTask:
        return self._pilot if ctx.sticks.valid and not ctx.sticks.simulated else self._hold
