"""The mission `handoff`: one aircraft takes a target over from another, without GPS (Tolman et al. 2021)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from missions.base.flight import MissionFlight
from missions.base.mission import Mission, WorldDefaults
from missions.base.report import Debriefing, Report
from missions.handoff.checks import check_vehicle
from missions.handoff.figures import handoff_figures, handoff_verdict
from missions.handoff.options import HandoffOptions
from missions.handoff.picture import camera_pictures, draw_handoff
from missions.handoff.team import HandoffTeam
from missions.kind import VehicleKind
from missions.vehicle.limits import Limits
from missions.vehicle.sensors import GIMBAL, MOVING_POINTS, RANGE_RADIO, Sensor
from missions.vehicle.vehicle import Vehicle


class HandoffMission(Mission[HandoffOptions]):
    """Two aircraft: the second orbits a target, the first arrives without GPS and takes it over."""

    name = "handoff"
    kinds = (VehicleKind.FIXED_WING,)
    world_defaults = WorldDefaults(model="aerosonde", wind="3", turbulence="light")

    def check(self, options: HandoffOptions, limits: Limits) -> None:
        self.refuse_arguments(options)
        check_vehicle(options, limits)

    def estimator_settings(self, options: HandoffOptions) -> Mapping[str, float | str]:
        north_m, east_m = options.target_ne_m
        return {"target_north_m": north_m, "target_east_m": east_m}

    def sensors(self, options: HandoffOptions) -> Sequence[Sensor]:
        return MOVING_POINTS, GIMBAL, RANGE_RADIO

    def flight(self, vehicles: Sequence[Vehicle], options: Sequence[HandoffOptions]) -> "HandoffFlight":
        return HandoffFlight(vehicles, options)


class HandoffFlight(MissionFlight[HandoffOptions]):
    """A handoff.

    Attributes:
        team: the vehicles and what they share.
    """

    together = True

    def __init__(self, vehicles: Sequence[Vehicle], options: Sequence[HandoffOptions]) -> None:
        super().__init__(vehicles, options)
        self.team = HandoffTeam(vehicles, options)

    async def fly(self) -> None:
        await self.team.fly()

    def report(self, debriefing: Debriefing) -> Report:
        team = self.team
        figures = handoff_figures(team, debriefing)

        def draw(path: Path, title: str) -> None:

            draw_handoff(path, title, team, debriefing)

        def pictures() -> Mapping[str, bytes]:

            ids = [notes.system_id for notes, _ in debriefing.flights]
            return camera_pictures(team, ids, debriefing.pictures_of)

        return Report.of(
            debriefing,
            verdict=lambda: handoff_verdict(team, debriefing),
            figures=figures,
            lines=lambda: _lines(figures),
            title=_title(self.options[0]),
            draw=draw if team.watch.moments else None,
            pictures=pictures,
        )


def _title(options: HandoffOptions) -> str:
    return f"GPS-denied handoff, orbits of {options.radius_m:.0f} and {options.tracker_radius_m:.0f} m"


def _lines(figures: Mapping[str, Any]) -> Sequence[str]:
    """Lines for the terminal."""
    if not figures["decided"]:
        return (f"no track was decided for within {figures['timeout_s']:g} s",)
    line = (
        f"decided {figures['decided_after_s']:.0f} s after GPS was lost, probability "
        f"{figures['probability']:.4f}"
    )
    if figures["handed_over_after_s"] is not None:
        line += f"; the tracker has received it after {figures['handed_over_after_s']:.0f} s"
    if figures["correct"] is None:
        return (line,)
    return (line, "it is the tracker's target" if figures["correct"] else "it is another target")
