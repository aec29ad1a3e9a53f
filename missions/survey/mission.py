"""The mission `survey`: an aircraft measures the magnetic field along lines (Lum et al. 2005, section II)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flightsim.foundation.geodesy import GeodeticPosition
from missions.base.mission import Debriefing, Mission, WorldDefaults
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.survey.options import SurveyOptions
from missions.vehicle.limits import FixedWingLimits, Limits

if TYPE_CHECKING:
    from autopilot_bridge.mission_plan import MissionItem
    from estimators.survey.lines import LinePlan
    from missions.planning.outline import Outline
    from missions.survey.outcome import Outcome
    from missions.vehicle.notes import FlightNotes
    from missions.vehicle.sensors import Sensor
    from missions.vehicle.vehicle import Vehicle


@dataclass(slots=True, kw_only=True)
class _Flown:
    """The newest flight.

    Attributes:
        notes: its notes; they identify it.
        plan: lines that were commanded; None: a calibration.
        home: the vehicle's home.
        outcome: what its readings make; None: not processed yet.
    """

    notes: "FlightNotes"
    plan: "LinePlan | None"
    home: GeodeticPosition
    outcome: "Outcome | None" = None


class SurveyMission(Mission[SurveyOptions]):
    """An aircraft flies survey lines, or the manoeuvres of a compensation."""

    name = "survey"
    kinds = (VehicleKind.FIXED_WING,)
    world_defaults = WorldDefaults(model="aerosonde", wind="5@270", turbulence="light")

    def __init__(self) -> None:
        self._flown: _Flown | None = None

    def adapted(self, options: SurveyOptions, limits: Limits) -> SurveyOptions:
        from missions.survey.checks import for_vehicle

        return for_vehicle(options, limits)

    def check(self, options: SurveyOptions, limits: Limits) -> None:
        from missions.survey.checks import check_survey

        for name in options.arguments:
            raise PlanError(f"`arguments` {name}: {self.name} takes none; they are for missions of your own")
        check_survey(options, limits)

    def check_place(self, options: SurveyOptions, limits: Limits, home: GeodeticPosition) -> None:
        from missions.survey.checks import check_reach

        check_reach(options, limits, home)

    def with_map(self, options: SurveyOptions, published: Path) -> SurveyOptions:
        return options if options.map_file is not None else replace(options, map_file=str(published))

    def estimator_settings(self, options: SurveyOptions) -> Mapping[str, float | str]:
        of = options.processing
        known = {
            "line_spacing_m": options.spacing_m,
            "map_error_nt": of.map_error_nt,
            "grid_m": of.grid_m,
            "level": "true" if of.level else "false",
            "map_file": options.map_file,
            "compensation_file": options.compensation_file,
        }
        return {name: value for name, value in known.items() if value is not None}

    def estimator_files(self, options: SurveyOptions) -> Mapping[str, tuple[str, bytes]]:
        from estimators.survey.export import LINES
        from missions.survey.plan import line_plan

        if options.calibrate:
            return {}
        # the turns of the aircraft change the order of the lines, not their places
        return {"lines_file": (LINES, line_plan(options, turn_radius_m=0.0).to_csv().encode())}

    def sensors(self, options: SurveyOptions) -> "Sequence[Sensor]":
        from missions.vehicle.sensors import SURVEY_MAGNETOMETER

        return (SURVEY_MAGNETOMETER,)

    async def outline(self, vehicle: "Vehicle", options: SurveyOptions) -> "Outline | None":
        from missions.survey.flight import outline_of, planned_survey

        limits = await vehicle.limits(options.own_altitude_m)
        if options.calibrate or not isinstance(limits, FixedWingLimits):
            return None
        return outline_of(planned_survey(options, limits, vehicle.home))

    async def plan_items(self, vehicle: "Vehicle", options: SurveyOptions) -> "Sequence[MissionItem]":
        from missions.survey.flight import mission_items, planned_survey

        if options.calibrate:
            raise PlanError("`calibrate` is flown by attitude setpoints; there is no mission file of it")
        limits = await vehicle.limits(options.own_altitude_m)
        assert isinstance(limits, FixedWingLimits)
        return mission_items(vehicle, options, planned_survey(options, limits, vehicle.home), limits)

    async def fly(self, vehicle: "Vehicle", options: SurveyOptions) -> None:
        from missions.survey.checks import check_reach, check_survey
        from missions.survey.flight import fly_lines, fly_manoeuvres, planned_survey

        limits = await vehicle.limits(options.own_altitude_m)
        check_survey(options, limits)
        check_reach(options, limits, vehicle.home)
        assert isinstance(limits, FixedWingLimits)
        flown = self._flown = _Flown(notes=vehicle.notes, plan=None, home=vehicle.home)
        if options.calibrate:
            await fly_manoeuvres(vehicle, options, limits)
            return
        survey = planned_survey(options, limits, vehicle.home)
        flown.plan = survey.path.plan
        await fly_lines(vehicle, options, survey, limits)

    def _outcome(self, debriefing: Debriefing) -> "Outcome":
        """What the flight's readings make; it is computed once for a flight."""
        from missions.survey.outcome import Outcome, outcome_of

        flown = self._flown
        if flown is None or not debriefing.flights or debriefing.flights[0][0] is not flown.notes:
            return Outcome()
        if flown.outcome is None:
            flown.outcome = outcome_of(debriefing, flown.plan, flown.home)
        return flown.outcome

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        return self._outcome(debriefing).verdict(max_error_m)

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        return self._outcome(debriefing).figures

    def files(self, debriefing: Debriefing) -> Mapping[str, bytes]:
        return self._outcome(debriefing).files

    def report_lines(self, summary: Mapping[str, Any]) -> Sequence[str]:
        from missions.survey.outcome import report_lines

        return report_lines(summary)

    def title(self, options: SurveyOptions) -> str:
        if options.calibrate:
            return f"{self.name}, compensation of the aircraft"
        size = f"{options.width_m:g} m x {options.height_m:g} m"
        return f"{self.name}, {size}, lines {options.spacing_m:g} m apart"

    def draw(self, path: Path, title: str, debriefing: Debriefing) -> None:
        outcome = self._outcome(debriefing)
        if not outcome.drawable:
            super().draw(path, title, debriefing)
            return
        from missions.survey.picture import draw_calibration, draw_survey

        if outcome.calibration is not None:
            draw_calibration(path, title, outcome.calibration)
        elif outcome.survey is not None:
            draw_survey(path, title, outcome.survey, debriefing.targets_ne_m or ())
