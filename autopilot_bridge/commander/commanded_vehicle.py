"""What the commander's parts use of it: its mode and state, its vehicle, and the changes that it makes."""

from typing import Protocol

from autopilot_bridge.commander.events import Event
from autopilot_bridge.commander.fence_watch import FenceWatch
from autopilot_bridge.commander.home import Home
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.policy import CommanderPolicy
from autopilot_bridge.commander.tasks import TaskRunner
from autopilot_bridge.commander.vehicle_tasks import VehicleTasks
from autopilot_bridge.commander.verdict import Verdict
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.mission_plan import MissionStore


class CommandedVehicle(Protocol):
    """The commander, as `Guidance` and `TaskFollower` know it; attributes as in `Commander`."""

    context: FlightContext
    policy: CommanderPolicy
    parameters: CommanderParameters
    missions: MissionStore
    vehicle: VehicleTasks
    mode: FlightMode
    commanded_mode: FlightMode
    armed: bool
    home: Home
    tasks: TaskRunner
    fence: FenceWatch

    @property
    def time_us(self) -> int:
        """Vehicle time."""

    @property
    def landed(self) -> bool:
        """The vehicle stands on the ground."""

    @property
    def airborne(self) -> bool:
        """The vehicle is armed and in the air."""

    def set_mode(self, mode: FlightMode) -> Verdict:
        """A client or pilot requests a mode."""

    def change_mode(self, mode: FlightMode) -> None:
        """Fly a mode without a request."""

    def end_mission(self, mode: FlightMode | None = None) -> None:
        """The mission is over."""

    def emit(self, event: Event) -> None:
        """Report an event."""
