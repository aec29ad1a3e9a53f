"""The mission `handoff`: one aircraft takes a target over from another, without GPS (Tolman et al. 2021)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missions.base.mission import Debriefing, WorldDefaults
from missions.base.team_mission import TeamMission
from missions.flown.camera_picture import PicturesOf
from missions.handoff.checks import check_vehicle
from missions.handoff.options import HandoffOptions
from missions.handoff.team import HandoffTeam
from missions.kind import VehicleKind
from missions.vehicle.limits import Limits

if TYPE_CHECKING:
    from missions.vehicle.sensors import Sensor
    from missions.vehicle.vehicle import Vehicle


class HandoffMission(TeamMission[HandoffOptions, HandoffTeam]):
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

    def sensors(self, options: HandoffOptions) -> "Sequence[Sensor]":
        from missions.vehicle.sensors import GIMBAL, MOVING_POINTS, RANGE_RADIO

        return MOVING_POINTS, GIMBAL, RANGE_RADIO

    async def fly_team(self, vehicles: "Sequence[Vehicle]", options: Sequence[HandoffOptions]) -> None:
        await self.flying(vehicles, HandoffTeam(vehicles, options)).fly()

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        from missions.handoff.figures import handoff_verdict

        team = self.team_of(debriefing)
        return "" if team is None else handoff_verdict(team, debriefing)

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        from missions.handoff.figures import handoff_figures

        team = self.team_of(debriefing)
        return {} if team is None else handoff_figures(team, debriefing)

    def report_lines(self, summary: Mapping[str, Any]) -> Sequence[str]:
        if "decided" not in summary:
            return ()
        if not summary["decided"]:
            return (f"no track was decided for within {self._limit(summary)}",)
        line = (
            f"decided {summary['decided_after_s']:.0f} s after GPS was lost, probability "
            f"{summary['probability']:.4f}"
        )
        if summary["handed_over_after_s"] is not None:
            line += f"; the tracker has received it after {summary['handed_over_after_s']:.0f} s"
        if summary["correct"] is None:
            return (line,)
        return (line, "it is the tracker's target" if summary["correct"] else "it is another target")

    @staticmethod
    def _limit(summary: Mapping[str, Any]) -> str:
        return f"{summary['timeout_s']:g} s"

    def title(self, options: HandoffOptions) -> str:
        return f"GPS-denied handoff, orbits of {options.radius_m:.0f} and {options.tracker_radius_m:.0f} m"

    def pictures(self, debriefing: Debriefing, pictures_of: PicturesOf) -> Mapping[str, bytes]:
        team = self.team_of(debriefing)
        if team is None:
            return {}
        from missions.handoff.picture import camera_pictures

        return camera_pictures(team, [flight[0].system_id for flight in debriefing.flights], pictures_of)

    def draw(self, path: Path, title: str, debriefing: Debriefing) -> None:
        team = self.team_of(debriefing)
        if team is None or not team.watch.moments:
            super().draw(path, title, debriefing)
            return
        from missions.handoff.picture import draw_handoff

        draw_handoff(path, title, team, debriefing)
