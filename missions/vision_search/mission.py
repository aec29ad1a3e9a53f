"""The mission `vision-search`: find a tagged target and localize it (Tisdale et al. 2008)."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from estimators.scene_items import Gaussian, Item, Role, Value
from missions.base.flight import MissionFlight
from missions.base.mission import Mission, WorldDefaults
from missions.base.report import Debriefing, Report
from missions.vehicle.limits import Limits
from missions.vehicle.sensors import TAG_CAMERA, Sensor
from missions.vehicle.vehicle import Vehicle
from missions.vision_search.figures import search_figures, search_verdict
from missions.vision_search.for_vehicle import check_vehicle, for_vehicle
from missions.vision_search.options import VisionSearchOptions
from missions.vision_search.team import VisionSearchTeam


class VisionSearchMission(Mission[VisionSearchOptions]):
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

    def sensors(self, options: VisionSearchOptions) -> Sequence[Sensor]:
        return (TAG_CAMERA.silent_after(options.sensor_limit_s),)

    def flight(
        self, vehicles: Sequence[Vehicle], options: Sequence[VisionSearchOptions]
    ) -> "VisionSearchFlight":
        return VisionSearchFlight(vehicles, options)


class VisionSearchFlight(MissionFlight[VisionSearchOptions]):
    """A search for a tag.

    Attributes:
        team: the vehicles and what they share.
    """

    together = True

    def __init__(self, vehicles: Sequence[Vehicle], options: Sequence[VisionSearchOptions]) -> None:
        super().__init__(vehicles, options)
        self.team = VisionSearchTeam(vehicles, options)

    async def fly(self) -> None:
        await self.team.fly()

    def shown(self) -> Mapping[str, Item]:
        found: dict[str, Item] = {"area": self.options[0].area.shown}
        for vehicle, estimator in zip(self.vehicles, self.team.watch.estimators, strict=True):
            of = f"vehicle_{vehicle.system_id}"
            found |= {f"{of}/{name}": item for name, item in estimator.shown().items()}
            for estimate in estimator.estimates:
                covariance = np.array(
                    [
                        [estimate.north_variance_m2, estimate.north_east_covariance_m2],
                        [estimate.north_east_covariance_m2, estimate.east_variance_m2],
                    ]
                )
                place = estimate.north_m, estimate.east_m, 0.0
                label = f"target by vehicle {vehicle.system_id}"
                found[f"{of}/target"] = Gaussian(mean_ned_m=place, covariance_m2=covariance, label=label)
                detected = Value(value=estimate.probability_of_detection, role=Role.BELIEF)
                found[f"{of}/probability_of_detection"] = detected
        return found

    def report(self, debriefing: Debriefing) -> Report:
        team = self.team
        figures = search_figures(team, debriefing)

        def draw(path: Path, title: str) -> None:
            from missions.vision_search.picture import draw_search

            draw_search(path, title, team, debriefing)

        return Report.of(
            debriefing,
            verdict=lambda: search_verdict(team, debriefing),
            figures=figures,
            lines=lambda: _lines(figures),
            title=_title(self.options[0]),
            draw=draw if team.search.moments else None,
        )


def _title(options: VisionSearchOptions) -> str:
    area = options.area
    return f"{VisionSearchMission.name}, {options.planner} over {area.width_m:g} m x {area.height_m:g} m"


def _lines(figures: Mapping[str, Any]) -> Sequence[str]:
    """Lines for the terminal."""
    if "localized" not in figures:
        return ()
    if not figures["localized"]:
        pod = figures["beliefs"][0]["probability_of_detection"] if figures["beliefs"] else 0.0
        return (
            f"not found in {figures['search_s']:.0f} s ({figures['search_end']}); "
            f"a target in the area would have been detected with {pod:.0%}",
        )
    line = (
        f"localized after {figures['localized_s']:.0f} s; after {figures['passes']} passes at "
        f"{figures['north_m']:.2f} m north, {figures['east_m']:.2f} m east, "
        f"sigma {figures['sigma_m']:.2f} m"
    )
    if figures["error_m"] is None:
        return (line,)
    where = "inside" if figures["inside_ellipse"] else "outside"
    return (line, f"{figures['error_m']:.2f} m from its true place, {where} the 95 % ellipse")
