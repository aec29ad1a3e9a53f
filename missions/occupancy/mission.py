"""The mission `occupancy`: a team searches a magnetic map for a target (Lum et al. 2005, section IV)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import PlanError
from missions.mission import Debriefing, Mission, WorldDefaults
from missions.occupancy.options import OccupancyOptions, check_map, check_reach, check_vehicle, read_map
from missions.occupancy.team import SearchTeam
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
    team: SearchTeam


class OccupancyMission(Mission[OccupancyOptions]):
    """A team shares an occupancy map and flies headings from cell to cell until the target is found."""

    name = "occupancy"
    world_defaults = WorldDefaults(model="aerosonde", wind="5@270", turbulence="light")
    flies_as_team = True

    def __init__(self) -> None:
        self._flown: _Flown | None = None

    def check(self, options: OccupancyOptions, limits: Limits) -> None:
        for name in options.arguments:
            raise PlanError(f"`arguments` {name}: {self.name} takes none; they are for missions of your own")
        check_vehicle(options, limits)
        if options.map_file is not None:
            check_map(options, read_map(options.map_file))

    def check_place(self, options: OccupancyOptions, limits: Limits, home: GeodeticPosition) -> None:
        if options.map_file is not None:  # a generated map is centred on home
            check_reach(options, limits, read_map(options.map_file).frame(), home)

    def with_map(self, options: OccupancyOptions, published: Path) -> OccupancyOptions:
        return options if options.map_file is not None else replace(options, map_file=str(published))

    def estimator_settings(self, options: OccupancyOptions) -> Mapping[str, float | str]:
        known: dict[str, float | str] = {
            "threshold_nt": options.threshold_nt,
            "noise_nt": options.noise_nt,
            "targets": ",".join(options.targets),
            "false_anomalies": ",".join(options.false_anomalies),
        }
        if options.map_error_nt is not None:
            known["map_error_nt"] = options.map_error_nt
        if options.map_file is not None:
            known["map_file"] = options.map_file
        return known

    async def fly_team(self, vehicles: "Sequence[Vehicle]", options: Sequence[OccupancyOptions]) -> None:
        map_file = options[0].map_file
        if map_file is None:
            raise PlanError(
                "a search needs the published magnetic map of its place: give it with `map_file` FILE"
            )
        team = SearchTeam(vehicles, options, read_map(map_file))
        self._flown = _Flown(first_notes=vehicles[0].notes, team=team)
        await team.fly()

    def _flight_of(self, debriefing: Debriefing) -> _Flown | None:
        flown = self._flown
        if flown is None or not debriefing.flights or debriefing.flights[0][0] is not flown.first_notes:
            return None
        return flown

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        from missions.occupancy.figures import search_verdict

        flown = self._flight_of(debriefing)
        return "" if flown is None else search_verdict(flown.team, debriefing)

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        from missions.occupancy.figures import search_figures

        flown = self._flight_of(debriefing)
        if flown is None:
            return {"target_found": False, "time_to_find_s": None}
        return search_figures(flown.team, debriefing)

    def report_lines(self, summary: Mapping[str, Any]) -> Sequence[str]:
        broken = tuple(
            f"vehicle {searcher['system_id']}: {searcher['readings_implausible']} readings are stuck or no "
            "field of the Earth, and were not used; check its magnetometer"
            for searcher in summary.get("searchers", ())
            if searcher["readings_implausible"]
        )
        detected = f"probability of detection {summary.get('probability_of_detection', 0.0):.2f}"
        if not summary["target_found"]:
            return (f"target not found, {detected}", *broken)
        error_m = summary["target_error_m"]
        off = "" if error_m is None else f", {error_m:.0f} m off"
        return (f"target found after {summary['time_to_find_s']:.0f} s{off}, {detected}", *broken)

    def title(self, options: OccupancyOptions) -> str:
        return f"{self.name}, {options.vehicles} vehicles over {options.width_m:g} m x {options.height_m:g} m"

    def draw(self, path: Path, title: str, debriefing: Debriefing) -> None:
        flown = self._flight_of(debriefing)
        if flown is None or flown.team.began_us < 0:
            super().draw(path, title, debriefing)
            return
        from missions.occupancy.picture import draw_search

        draw_search(path, title, flown.team, debriefing)
