"""Options of the flight of a mission file."""

from dataclasses import dataclass
from enum import StrEnum

from missions.base.options import MAX_SEARCH_TIME_S, MissionOptions, check_positive
from missions.errors import PlanError


class Then(StrEnum):
    """Action after a mission that does not land by itself."""

    RETURN = "return"
    LAND = "land"


@dataclass(frozen=True, slots=True, kw_only=True)
class FileOptions(MissionOptions):
    """Options with which a mission file is flown.

    Attributes:
        then: action after a mission that doesn't land, or whose return stays in the air; None: a multicopter
            returns, and the mission of a fixed wing that neither lands nor returns is refused.
        time_limit_s: a longer mission is ended with `then`; None: a mission that takes more than twice the
            planned time has failed.
    """

    then: Then | None = None
    time_limit_s: float | None = None

    def __post_init__(self) -> None:
        super(FileOptions, self).__post_init__()
        check_positive(time_limit_s=self.time_limit_s)
        if self.time_limit_s is not None and self.time_limit_s > MAX_SEARCH_TIME_S:
            raise PlanError(f"`time_limit_s` {self.time_limit_s:g} s is more than {MAX_SEARCH_TIME_S:g} s")
        if self.vehicles > 1:
            raise PlanError("a mission file is flown by one vehicle; start the command once for each")
