"""The mission `vision-search`: find a tagged target and localize it (Tisdale et al. 2008)."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missions.base.mission import Debriefing, WorldDefaults
from missions.base.team_mission import TeamMission
from missions.vehicle.limits import Limits
from missions.vision_search.for_vehicle import check_vehicle, for_vehicle
from missions.vision_search.options import VisionSearchOptions
from missions.vision_search.team import VisionSearchTeam

if TYPE_CHECKING:
    from missions.vehicle.sensors import Sensor
    from missions.vehicle.vehicle import Vehicle


class VisionSearchMission(TeamMission[VisionSearchOptions, VisionSearchTeam]):
    """A team searches an area with cameras for one tag, and localizes it."""

    name = "vision-search"
    lands_without_sensors = True
    world_defaults = WorldDefaults(model="iris")

    def adapted(self, options: VisionSearchOptions, limits: Limits) -> VisionSearchOptions:
        return for_vehicle(options, limits)

    def check(self, options: VisionSearchOptions, limits: Limits) -> None:
        self.refuse_arguments(options)
        check_vehicle(options, limits)

    def estimator_settings(self, options: VisionSearchOptions) -> Mapping[str, float | str]:
        parameters = options.estimator
        settings = {field.name: getattr(parameters, field.name) for field in fields(parameters)}
        return {**settings, "centre_vehicle": 1 if options.vehicles > 1 else 0}

    def sensors(self, options: VisionSearchOptions) -> "Sequence[Sensor]":
        from missions.vehicle.sensors import TAG_CAMERA

        return (TAG_CAMERA.silent_after(options.sensor_limit_s),)

    async def fly_team(self, vehicles: "Sequence[Vehicle]", options: Sequence[VisionSearchOptions]) -> None:
        await self.flying(vehicles, VisionSearchTeam(vehicles, options)).fly()

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        from missions.vision_search.figures import search_verdict

        team = self.team_of(debriefing)
        return "" if team is None else search_verdict(team, debriefing)

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        from missions.vision_search.figures import search_figures

        team = self.team_of(debriefing)
        return {} if team is None else search_figures(team, debriefing)

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
        team = self.team_of(debriefing)
        if team is None or not team.search.moments:
            super().draw(path, title, debriefing)
            return
        from missions.vision_search.picture import draw_search

        draw_search(path, title, team, debriefing)
