"""The mission `occupancy`: a team searches a magnetic map for a target (Lum et al. 2005, section IV)."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from estimators.scene_items import Item
from flightsim.foundation.geodesy import GeodeticPosition
from missions.base.flight import MissionFlight
from missions.base.mission import Mission, WorldDefaults
from missions.base.report import Debriefing, Report
from missions.errors import PlanError
from missions.occupancy.checks import check_map, check_reach, check_vehicle, for_vehicle, read_map
from missions.occupancy.figures import search_figures, search_verdict
from missions.occupancy.options import OccupancyOptions
from missions.occupancy.team import SearchTeam
from missions.vehicle.limits import Limits
from missions.vehicle.sensors import SURVEY_MAGNETOMETER, Sensor
from missions.vehicle.vehicle import Vehicle


class OccupancyMission(Mission[OccupancyOptions]):
    """A team shares an occupancy map and flies headings from cell to cell until the target is found."""

    name = "occupancy"
    lands_without_sensors = True
    unflown: Mapping[str, Any] = MappingProxyType({"target_found": False, "time_to_find_s": None})
    world_defaults = WorldDefaults(model="aerosonde", wind="5@270", turbulence="light")

    def adapted(self, options: OccupancyOptions, limits: Limits) -> OccupancyOptions:
        return for_vehicle(options, limits)

    def check(self, options: OccupancyOptions, limits: Limits) -> None:
        self.refuse_arguments(options)
        check_vehicle(options, limits)
        if options.map_file is not None:
            check_map(options, read_map(options.map_file))

    def check_place(self, options: OccupancyOptions, limits: Limits, home: GeodeticPosition) -> None:
        if options.map_file is not None:  # a generated map is centred on home
            check_reach(options, limits, read_map(options.map_file).frame(), home)

    def with_map(self, options: OccupancyOptions, published: Path) -> OccupancyOptions:
        return options if options.map_file is not None else replace(options, map_file=str(published))

    def estimator_settings(self, options: OccupancyOptions) -> Mapping[str, float | str]:
        known: dict[str, float | str]
        names = ("threshold_nt", "noise_nt", "particles", "map_error_nt")
        of = options.identification
        known = {name: value for name in names if (value := getattr(of, name)) is not None}
        known |= {"targets": ",".join(of.targets), "false_anomalies": ",".join(of.false_anomalies)}
        if options.map_file is not None:
            known["map_file"] = options.map_file
        return known

    def sensors(self, options: OccupancyOptions) -> Sequence[Sensor]:
        return (SURVEY_MAGNETOMETER,)

    def flight(self, vehicles: Sequence[Vehicle], options: Sequence[OccupancyOptions]) -> "OccupancyFlight":
        return OccupancyFlight(vehicles, options)


class OccupancyFlight(MissionFlight[OccupancyOptions]):
    """A search with an occupancy map.

    Attributes:
        team: the vehicles and what they share.
    """

    together = True

    def __init__(self, vehicles: Sequence[Vehicle], options: Sequence[OccupancyOptions]) -> None:
        super().__init__(vehicles, options)
        map_file = options[0].map_file
        if map_file is None:
            raise PlanError(
                "a search needs the published magnetic map of its place: give it with `map_file` FILE"
            )
        self.team = SearchTeam(vehicles, options, read_map(map_file))

    async def fly(self) -> None:
        await self.team.fly()

    def shown(self) -> Mapping[str, Item]:
        return self.team.search.shown()

    def report(self, debriefing: Debriefing) -> Report:
        team = self.team
        figures = search_figures(team, debriefing)

        def draw(path: Path, title: str) -> None:
            from missions.occupancy.picture import draw_search

            draw_search(path, title, team, debriefing)

        return Report.of(
            debriefing,
            verdict=lambda: search_verdict(team, debriefing),
            figures=figures,
            lines=lambda: _lines(figures),
            title=_title(self.options[0]),
            draw=draw if team.began_us >= 0 else None,
        )


def _title(options: OccupancyOptions) -> str:
    team = "1 vehicle" if options.vehicles == 1 else f"{options.vehicles} vehicles"
    return f"{OccupancyMission.name}, {team} over {options.width_m:g} m x {options.height_m:g} m"


def _lines(figures: Mapping[str, Any]) -> Sequence[str]:
    """Lines for the terminal."""
    broken = tuple(
        f"vehicle {searcher['system_id']}: {searcher['readings_implausible']} readings are stuck or no "
        "field of the Earth, and were not used; check its magnetometer"
        for searcher in figures["searchers"]
        if searcher["readings_implausible"]
    )
    detected = f"probability of detection {figures['probability_of_detection']:.2f}"
    if not figures["target_found"]:
        none = f"probability {figures['no_target_probability']:.2f} that there is none"
        return (f"nothing found, {detected}, {none}", *broken)
    error_m = figures["target_error_m"]
    off = "" if error_m is None else f", {error_m:.0f} m off"
    return (f"target found after {figures['time_to_find_s']:.0f} s{off}, {detected}", *broken)
