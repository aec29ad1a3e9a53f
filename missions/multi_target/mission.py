"""The mission `multi-target`: find an unknown number of targets (Yousuf, Lendek and Busoniu)."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from estimators.scene_items import Item
from missions.base.flight import MissionFlight
from missions.base.mission import Mission, WorldDefaults
from missions.base.report import Debriefing, Report
from missions.multi_target.figures import search_figures, search_verdict
from missions.multi_target.for_vehicle import check_vehicle, for_vehicle
from missions.multi_target.options import MultiTargetOptions
from missions.multi_target.picture import draw_search
from missions.multi_target.team import TargetSearchTeam
from missions.vehicle.limits import Limits
from missions.vehicle.sensors import TARGET_SENSOR, Sensor
from missions.vehicle.vehicle import Vehicle


class MultiTargetMission(Mission[MultiTargetOptions]):
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

    def sensors(self, options: MultiTargetOptions) -> Sequence[Sensor]:
        return (TARGET_SENSOR.silent_after(options.sensor_limit_s),)

    def flight(
        self, vehicles: Sequence[Vehicle], options: Sequence[MultiTargetOptions]
    ) -> "MultiTargetFlight":
        return MultiTargetFlight(vehicles, options)


class MultiTargetFlight(MissionFlight[MultiTargetOptions]):
    """A search for targets.

    Attributes:
        team: the vehicles and what they share.
    """

    together = True

    def __init__(self, vehicles: Sequence[Vehicle], options: Sequence[MultiTargetOptions]) -> None:
        super().__init__(vehicles, options)
        self.team = TargetSearchTeam(vehicles, options)

    async def fly(self) -> None:
        await self.team.fly()

    def shown(self) -> Mapping[str, Item]:
        area, search = self.options[0].area, self.team.search
        return {"area": area.shown, **search.belief.shown(), **search.shown_goals()}

    def report(self, debriefing: Debriefing) -> Report:
        team = self.team
        figures = search_figures(team, debriefing)

        def draw(path: Path, title: str) -> None:

            draw_search(path, title, team, debriefing)

        return Report.of(
            debriefing,
            verdict=lambda: search_verdict(team, debriefing),
            figures=figures,
            lines=lambda: _lines(figures),
            title=_title(self.options[0]),
            draw=draw if team.search.states else None,
        )


def _title(options: MultiTargetOptions) -> str:
    area = options.area
    return (
        f"{MultiTargetMission.name}, {options.planner} planner over {area.width_m:g} m x {area.height_m:g} m"
    )


def _lines(figures: Mapping[str, Any]) -> Sequence[str]:
    """Lines for the terminal."""
    if "targets_found" not in figures:
        return ()
    found, end = figures["targets_found"], figures["search_end"]
    line = f"{found} targets found in {figures['search_s']:.0f} s and {figures['steps']} steps ({end})"
    if figures["targets_true"] is None:
        return (line,)
    right, true = figures["targets_found_right"], figures["targets_true"]
    return (
        f"{line}: {right} of {true} within {figures['match_m']:g} m of a true target, {found - right} false",
    )
