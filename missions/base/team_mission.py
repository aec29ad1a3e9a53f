"""Base of missions that a team object flies, which know the team of their newest flight at its debriefing."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from missions.base.mission import AnyOptions, Debriefing, Mission
from missions.errors import PlanError

if TYPE_CHECKING:
    from missions.base.options import MissionOptions
    from missions.vehicle.notes import FlightNotes
    from missions.vehicle.vehicle import Vehicle

__all__ = ["FlownTeam", "TeamMission"]

Team = TypeVar("Team")


@dataclass(frozen=True, slots=True, kw_only=True)
class FlownTeam(Generic[Team]):
    """The newest flight, for its debriefing.

    Attributes:
        first_notes: notes of the first vehicle; they identify the flight.
        team: the team at the end of the flight.
    """

    first_notes: "FlightNotes"
    team: Team


class TeamMission(Mission[AnyOptions], Generic[AnyOptions, Team]):
    """A mission whose `fly_team` makes a team and notes it with `flying`."""

    flies_as_team = True

    def __init__(self) -> None:
        self._flown: FlownTeam[Team] | None = None

    def flying(self, vehicles: "Sequence[Vehicle]", team: Team) -> Team:
        """Note the team of a flight that begins."""
        self._flown = FlownTeam(first_notes=vehicles[0].notes, team=team)
        return team

    def team_of(self, debriefing: Debriefing) -> Team | None:
        """The team of a flight; None: this mission's newest flight is another one."""
        flown = self._flown
        if flown is None or not debriefing.flights or debriefing.flights[0][0] is not flown.first_notes:
            return None
        return flown.team

    def refuse_arguments(self, options: "MissionOptions") -> None:
        """Refuse arguments, which are for missions of users."""
        for name in options.arguments:
            raise PlanError(f"`arguments` {name}: {self.name} takes none; they are for missions of your own")
