"""The mission `multi-target`: find an unknown number of targets (Yousuf, Lendek and Busoniu)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missions.errors import PlanError
from missions.mission import Debriefing, Mission, WorldDefaults
from missions.multi_target.options import MultiTargetOptions, check_vehicle
from missions.multi_target.team import TargetSearchTeam
from missions.planning.limits import Limits

if TYPE_CHECKING:
    from missions.notes import FlightNotes
    from missions.vehicle.vehicle import Vehicle


@dataclass(frozen=True, slots=True, kw_only=True)
class _Flown:
    """The newest flight, for its debriefing.

    Attributes:
        first_notes: notes of the first vehicle; they identify the flight.
        team: the team at the end of the flight.
    """

    first_notes: "FlightNotes"
    team: TargetSearchTeam


class MultiTargetMission(Mission[MultiTargetOptions]):
    """A team searches an area with target sensors, and plans each step by what it knows."""

    name = "multi-target"
    world_defaults = WorldDefaults(model="iris")
    flies_as_team = True

    def __init__(self) -> None:
        self._flown: _Flown | None = None

    def check(self, options: MultiTargetOptions, limits: Limits) -> None:
        for name in options.arguments:
            raise PlanError(f"`arguments` {name}: {self.name} takes none; they are for missions of your own")
        check_vehicle(options, limits)

    def estimator_settings(self, options: MultiTargetOptions) -> Mapping[str, float | str]:
        parameters = options.estimator_parameters
        settings = {field.name: getattr(parameters, field.name) for field in fields(parameters)}
        return {**settings, "centre_vehicle": 1 if options.vehicles > 1 else 0}

    async def fly_team(self, vehicles: "Sequence[Vehicle]", options: Sequence[MultiTargetOptions]) -> None:
        team = TargetSearchTeam(vehicles, options)
        self._flown = _Flown(first_notes=vehicles[0].notes, team=team)
        await team.fly()

    def _flight_of(self, debriefing: Debriefing) -> _Flown | None:
        flown = self._flown
        if flown is None or not debriefing.flights or debriefing.flights[0][0] is not flown.first_notes:
            return None
        return flown

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        from missions.multi_target.figures import search_verdict

        flown = self._flight_of(debriefing)
        return "" if flown is None else search_verdict(flown.team, debriefing)

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        from missions.multi_target.figures import search_figures

        flown = self._flight_of(debriefing)
        return {} if flown is None else search_figures(flown.team, debriefing)

    def report_lines(self, summary: Mapping[str, Any]) -> Sequence[str]:
        if "targets_found" not in summary:
            return ()
        found, end = summary["targets_found"], summary["search_end"]
        line = f"{found} targets found in {summary['search_s']:.0f} s and {summary['steps']} steps ({end})"
        if summary["targets_true"] is None:
            return (line,)
        right, true = summary["targets_found_right"], summary["targets_true"]
        return (
            f"{line}: {right} of {true} within {summary['match_m']:g} m of a true target, "
            f"{found - right} false",
        )

    def title(self, options: MultiTargetOptions) -> str:
        area = options.area
        return f"{self.name}, {options.planner} planner over {area.width_m:g} m x {area.height_m:g} m"

    def draw(self, path: Path, title: str, debriefing: Debriefing) -> None:
        flown = self._flight_of(debriefing)
        if flown is None or not flown.team.search.states:
            super().draw(path, title, debriefing)
            return
        from missions.multi_target.picture import draw_search

        draw_search(path, title, flown.team, debriefing)
