"""The mission `survey`: an aircraft measures the magnetic field along lines (Lum et al. 2005, section II)."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from autopilot_bridge.mission_plan import MissionItem
from estimators.survey.export import LINES
from estimators.survey.lines import LinePlan
from flightsim.foundation.geodesy import GeodeticPosition
from missions.base.flight import MissionFlight
from missions.base.mission import Mission, WorldDefaults
from missions.base.report import Debriefing, Report
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.planning.outline import Outline
from missions.survey.checks import check_reach, check_survey, for_vehicle
from missions.survey.flight import fly_lines, fly_manoeuvres, mission_items, outline_of, planned_survey
from missions.survey.options import SurveyOptions
from missions.survey.outcome import SurveyFindings, outcome_of, report_lines
from missions.survey.picture import draw_calibration, draw_survey
from missions.survey.plan import line_plan
from missions.vehicle.limits import FixedWingLimits, Limits
from missions.vehicle.sensors import SURVEY_MAGNETOMETER, Sensor
from missions.vehicle.vehicle import Vehicle


class SurveyMission(Mission[SurveyOptions]):
    """An aircraft flies survey lines, or the manoeuvres of a compensation."""

    name = "survey"
    kinds = (VehicleKind.FIXED_WING,)
    world_defaults = WorldDefaults(model="aerosonde", wind="5@270", turbulence="light")

    def adapted(self, options: SurveyOptions, limits: Limits) -> SurveyOptions:
        return for_vehicle(options, limits)

    def check(self, options: SurveyOptions, limits: Limits) -> None:
        self.refuse_arguments(options)
        check_survey(options, limits)

    def check_place(self, options: SurveyOptions, limits: Limits, home: GeodeticPosition) -> None:
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
        if options.calibrate:
            return {}
        # the turns of the aircraft change the order of the lines, not their places
        return {"lines_file": (LINES, line_plan(options, turn_radius_m=0.0).to_csv().encode())}

    def sensors(self, options: SurveyOptions) -> Sequence[Sensor]:
        return (SURVEY_MAGNETOMETER,)

    async def outline(self, vehicle: Vehicle, options: SurveyOptions) -> Outline | None:
        limits = await vehicle.limits(options.own_altitude_m)
        if options.calibrate or not isinstance(limits, FixedWingLimits):
            return None
        return outline_of(planned_survey(options, limits, vehicle.home))

    async def plan_items(self, vehicle: Vehicle, options: SurveyOptions) -> Sequence[MissionItem]:
        if options.calibrate:
            raise PlanError("`calibrate` is flown by attitude setpoints; there is no mission file of it")
        limits = await vehicle.limits(options.own_altitude_m)
        assert isinstance(limits, FixedWingLimits)
        return mission_items(vehicle, options, planned_survey(options, limits, vehicle.home), limits)

    def flight(self, vehicles: Sequence[Vehicle], options: Sequence[SurveyOptions]) -> "SurveyFlight":
        return SurveyFlight(vehicles, options)


class SurveyFlight(MissionFlight[SurveyOptions]):
    """A survey, or a calibration, by one aircraft."""

    def __init__(self, vehicles: Sequence[Vehicle], options: Sequence[SurveyOptions]) -> None:
        super().__init__(vehicles, options)
        self._begun = False
        self._plan: LinePlan | None = None  # lines that were commanded; None: a calibration

    async def fly_one(self, index: int) -> None:
        vehicle, options = self.vehicles[index], self.options[index]
        limits = await vehicle.limits(options.own_altitude_m)
        check_survey(options, limits)
        check_reach(options, limits, vehicle.home)
        assert isinstance(limits, FixedWingLimits)
        self._begun = True
        if options.calibrate:
            await fly_manoeuvres(vehicle, options, limits)
            return
        survey = planned_survey(options, limits, vehicle.home)
        self._plan = survey.path.plan
        await fly_lines(vehicle, options, survey, limits)

    def report(self, debriefing: Debriefing) -> Report:
        options = self.options[0]
        outcome = SurveyFindings()
        if self._begun:
            outcome = outcome_of(debriefing, options, self._plan, self.vehicles[0].home)

        def draw(path: Path, title: str) -> None:

            if outcome.calibration is not None:
                draw_calibration(path, title, outcome.calibration)
            elif outcome.survey is not None:
                draw_survey(path, title, outcome.survey, debriefing.targets_ne_m or ())

        return Report.of(
            debriefing,
            verdict=outcome.verdict,
            figures=outcome.figures,
            lines=lambda: report_lines(outcome.figures),
            title=_title(options),
            draw=draw if outcome.drawable else None,
            files=outcome.files,
        )


def _title(options: SurveyOptions) -> str:
    if options.calibrate:
        return f"{SurveyMission.name}, compensation of the aircraft"
    size = f"{options.width_m:g} m x {options.height_m:g} m"
    return f"{SurveyMission.name}, {size}, lines {options.spacing_m:g} m apart"
