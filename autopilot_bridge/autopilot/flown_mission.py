"""The mission being flown, as the mission protocol sees it."""

from autopilot_bridge.commander.commander import Commander
from autopilot_bridge.commander.events import Event, MissionFinished, ModeChanged
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.mission_plan import MissionType
from autopilot_bridge.services.microservice import Microservice
from flightsim.foundation.geodesy import GeodeticPosition


class FlownMission(Microservice):
    """The state of the mission task.

    Attributes:
        complete: the last item was finished, and the mission mode was not left since.
    """

    def __init__(self, commander: Commander) -> None:
        self._commander = commander
        self.complete = False

    @property
    def active(self) -> bool:
        """The mission mode is selected."""
        return self._commander.mode is FlightMode.MISSION

    def home(self) -> GeodeticPosition | None:
        """The home position; None while it is not set."""
        return self._commander.home.position

    def landed(self) -> bool:
        """The vehicle stands on the ground."""
        return self._commander.landed

    def plan_changed(self, mission_type: MissionType) -> None:
        """A plan was replaced or cleared."""
        if mission_type is MissionType.MISSION:
            self.complete = False

    def follow(self, event: Event) -> None:
        """A finished mission is complete until its mode is left."""
        match event:
            case MissionFinished():
                self.complete = True
            case ModeChanged(mode=mode) if mode is not FlightMode.MISSION:
                self.complete = False
