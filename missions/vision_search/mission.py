"""The mission `vision-search`: find a tagged target and localize it (Tisdale et al. 2008)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missions.errors import PlanError
from missions.mission import Debriefing, Mission, WorldDefaults
from missions.planning.limits import Limits
from missions.vision_search.options import VisionSearchOptions, check_vehicle
from missions.vision_search.team import VisionSearchTeam

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
    team: VisionSearchTeam


class VisionSearchMission(Mission[VisionSearchOptions]):
    """A team searches an area with cameras for one tag, and localizes it."""

    name = "vision-search"
    world_defaults = WorldDefaults(model="iris")
    flies_as_team = True

    def __init__(self) -> None:
        self._flown: _Flown | None = None

    def check(self, options: VisionSearchOptions, limits: Limits) -> None:
        for name in options.arguments:
            raise PlanError(f"`arguments` {name}: {self.name} takes none; they are for missions of your own")
        check_vehicle(options, limits)

    def estimator_settings(self, options: VisionSearchOptions) -> Mapping[str, float | str]:
        parameters = options.estimator_parameters
        settings = {field.name: getattr(parameters, field.name) for field in fields(parameters)}
        return {**settings, "centre_vehicle": 1 if options.vehicles > 1 else 0}

    async def fly_team(self, vehicles: "Sequence[Vehicle]", options: Sequence[VisionSearchOptions]) -> None:
        team = VisionSearchTeam(vehicles, options)
        self._flown = _Flown(first_notes=vehicles[0].notes, team=team)
        await team.fly()

    def _flight_of(self, debriefing: Debriefing) -> _Flown | None:
        flown = self._flown
        if flown is None or not debriefing.flights or debriefing.flights[0][0] is not flown.first_notes:
            return None
        return flown

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        from missions.vision_search.figures import search_verdict

        flown = self._flight_of(debriefing)
        return "" if flown is None else search_verdict(flown.team, debriefing)

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        from missions.vision_search.figures import search_figures

        flown = self._flight_of(debriefing)
        return {} if flown is None else search_figures(flown.team, debriefing)

    def report_lines(self, summary: Mapping[str, Any]) -> Sequence[str]:
        if "localized" not in summary:
            return ()
        if not summary["localized"]:
            pod = summary["beliefs"][0]["probability_of_detection"] if summary["beliefs"] else 0.0
            return (
                f"not found in {summary['search_s']:.0f} s ({summary['search_end']}); "
                f"a target in the area would have been detected with {pod:.0%}",
            )
        line = (
            f"localized after {summary['localized_s']:.0f} s; after {summary['passes']} passes at "
            f"{summary['north_m']:.2f} m north, {summary['east_m']:.2f} m east, "
            f"sigma {summary['sigma_m']:.2f} m"
        )
        if summary["error_m"] is None:
            return (line,)
        where = "inside" if summary["inside_ellipse"] else "outside"
        return (line, f"{summary['error_m']:.2f} m from its true place, {where} the 95 % ellipse")

    def title(self, options: VisionSearchOptions) -> str:
        area = options.area
        return f"{self.name}, {options.planner} over {area.width_m:g} m x {area.height_m:g} m"

    def draw(self, path: Path, title: str, debriefing: Debriefing) -> None:
        flown = self._flight_of(debriefing)
        if flown is None or not flown.team.search.moments:
            super().draw(path, title, debriefing)
            return
        from missions.vision_search.picture import draw_search

        draw_search(path, title, flown.team, debriefing)
