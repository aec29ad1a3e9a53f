"""The mission `multi-target`: find an unknown number of targets (Yousuf, Lendek and Busoniu)."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missions.base.mission import Debriefing, WorldDefaults
from missions.base.team_mission import TeamMission
from missions.multi_target.for_vehicle import check_vehicle, for_vehicle
from missions.multi_target.options import MultiTargetOptions
from missions.multi_target.team import TargetSearchTeam
from missions.vehicle.limits import Limits

if TYPE_CHECKING:
    from missions.vehicle.sensors import Sensor
    from missions.vehicle.vehicle import Vehicle


class MultiTargetMission(TeamMission[MultiTargetOptions, TargetSearchTeam]):
    """A team searches an area with target sensors, and plans each step by what it knows."""

    name = "multi-target"
    lands_without_sensors = True
    world_defaults = WorldDefaults(model="iris")

    def adapted(self, options: MultiTargetOptions, limits: Limits) -> MultiTargetOptions:
        return for_vehicle(options, limits)

    def check(self, options: MultiTargetOptions, limits: Limits) -> None:
        self.refuse_arguments(options)
        check_vehicle(options, limits)

    def estimator_settings(self, options: MultiTargetOptions) -> Mapping[str, float | str]:
        parameters = options.estimator
        settings = {field.name: getattr(parameters, field.name) for field in fields(parameters)}
        return {**settings, "centre_vehicle": 1 if options.vehicles > 1 else 0}

    def sensors(self, options: MultiTargetOptions) -> "Sequence[Sensor]":
        from missions.vehicle.sensors import TARGET_SENSOR

        return (TARGET_SENSOR.silent_after(options.sensor_limit_s),)

    async def fly_team(self, vehicles: "Sequence[Vehicle]", options: Sequence[MultiTargetOptions]) -> None:
        await self.flying(vehicles, TargetSearchTeam(vehicles, options)).fly()

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        from missions.multi_target.figures import search_verdict

        team = self.team_of(debriefing)
        return "" if team is None else search_verdict(team, debriefing)

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        from missions.multi_target.figures import search_figures

        team = self.team_of(debriefing)
        return {} if team is None else search_figures(team, debriefing)

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
        team = self.team_of(debriefing)
        if team is None or not team.search.states:
            super().draw(path, title, debriefing)
            return
        from missions.multi_target.picture import draw_search

        draw_search(path, title, team, debriefing)
