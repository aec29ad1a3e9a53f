"""Options of the flight of a mission file."""

from dataclasses import dataclass
from enum import StrEnum

from flightsim.foundation.options import option
from missions.base.options import MAX_SEARCH_TIME_S, MissionOptions
from missions.errors import PlanError


class Then(StrEnum):
    """Action after a mission that does not land by itself."""

    RETURN = "return"
    LAND = "land"


@dataclass(frozen=True, slots=True, kw_only=True)
class FileOptions(MissionOptions):
    """Options with which a mission file is flown."""

    then: Then | None = option(
        None,
        varies="return; required for aircraft",
        help="Action after a mission that doesn't land, or whose return stays in the air.",
    )
    time_limit_s: float | None = option(
        None,
        above=0.0,
        most=MAX_SEARCH_TIME_S,
        varies="twice the planned time",
        help="Time after which the mission is ended with `then`.",
    )

    def check_together(self) -> None:
        if self.vehicles > 1:
            raise PlanError("a mission file is flown by one vehicle; start the command once for each")
