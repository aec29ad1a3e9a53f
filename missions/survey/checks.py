"""What an aircraft can't survey, refused before anything is flown."""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from estimators.errors import EstimatorError
from estimators.survey.processing import check_grid
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import PlanError
from missions.survey.flight import airspeed_m_s, planned_lines
from missions.survey.inputs import compensation_of, map_frame, survey_map_of, terrain_of
from missions.survey.manoeuvres import box_side_m
from missions.survey.options import SurveyOptions
from missions.survey.plan import check_lines
from missions.vehicle.limits import FixedWingLimits, Limits

__all__ = ["check_reach", "check_survey", "for_vehicle"]

_HIGHEST_M: Final = 3000.0


def for_vehicle(options: SurveyOptions, limits: Limits) -> SurveyOptions:
    """The same options, with the aircraft's own airspeed unless one was specified."""
    if options.speed_m_s is not None or not isinstance(limits, FixedWingLimits):
        return options
    return replace(options, speed_m_s=limits.airspeed_trim_m_s)


def check_altitude(options: SurveyOptions, limits: FixedWingLimits) -> None:
    """Refuse an impossible altitude. Surveys may be higher than `limits` has it, with an authorization.

    Raises:
        PlanError: the altitude is not possible.
    """
    if not limits.altitude_min_m <= options.altitude_m <= _HIGHEST_M:
        raise PlanError(
            f"`altitude_m` {options.altitude_m:g} m is not in {limits.altitude_min_m:g}..{_HIGHEST_M:g} m"
        )


def check_survey(options: SurveyOptions, limits: Limits) -> None:
    """Refuse what can't be flown with these limits, or a map and terrain that don't cover the lines.

    Raises:
        PlanError: names the option to change.
    """
    if not isinstance(limits, FixedWingLimits):
        raise PlanError("a survey is flown by an aircraft with wings; choose a fixed wing as `model`")
    if options.vehicles > 1:
        raise PlanError(f"a survey is flown by one aircraft; `vehicles` {options.vehicles} is not accepted")
    limits.check_airspeed(airspeed_m_s(options, limits))
    check_altitude(options, limits)
    compensation_of(options)  # a file that can't be read is refused before the flight
    survey_map = survey_map_of(options)
    terrain = terrain_of(options)
    if options.calibrate:
        return
    plan = planned_lines(options, limits)
    check_lines(plan)
    try:
        check_grid(plan, options.processing_parameters)
    except EstimatorError as error:
        raise PlanError(str(error)) from None
    ends = np.array([end for line in plan.lines for end in (line.start_ne_m, line.end_ne_m)])
    along = np.linspace(0.0, 1.0, 200)[:, None]
    places = np.concatenate(
        [np.array(line.start_ne_m) * (1.0 - along) + np.array(line.end_ne_m) * along for line in plan.lines]
    )
    reach = (
        f"the lines reach from north {ends[:, 0].min():.0f} to {ends[:, 0].max():.0f} m and east "
        f"{ends[:, 1].min():.0f} to {ends[:, 1].max():.0f} m"
    )
    if survey_map is not None:
        values = survey_map.totals_nt(places[:, 0], places[:, 1], np.full(len(places), survey_map.height_m))
        missing = int(np.count_nonzero(~np.isfinite(values)))
        if missing:
            raise PlanError(
                f"{reach}: the magnetic map has no data at {100.0 * missing / len(values):.0f} % of them; it "
                f"reaches from north {survey_map.north_m[0]:.0f} to {survey_map.north_m[-1]:.0f} m, east "
                f"{survey_map.east_m[0]:.0f} to {survey_map.east_m[-1]:.0f} m. Change `area_ne_m`, or give a "
                "smaller `width_m, height_m` or another `map_file`"
            )
    if terrain is not None and not terrain.covers(places[:, 0], places[:, 1]):
        raise PlanError(
            f"{reach}: the terrain reaches only from north {terrain.north_m[0]:.0f} to "
            f"{terrain.north_m[-1]:.0f} m, east {terrain.east_m[0]:.0f} to {terrain.east_m[-1]:.0f} m. Give "
            "a smaller `width_m, height_m` or another `terrain_file`"
        )


def check_reach(options: SurveyOptions, limits: Limits, home: GeodeticPosition) -> None:
    """Refuse lines that are too far from the vehicle's home, and ground that is higher than the flight to it.

    Raises:
        PlanError: names the distance and what to change.
    """
    assert isinstance(limits, FixedWingLimits)
    if options.calibrate:
        reach_m, what = 1.5 * box_side_m(airspeed_m_s(options, limits)), "the manoeuvres reach"
    else:
        frame = map_frame(options, home)
        north_m, east_m, _ = frame.ned_from_geodetic(home.lat_deg, home.lon_deg, home.alt_m)
        lines = planned_lines(options, limits).lines
        reach_m = max(
            math.dist((north_m, east_m), end) for line in lines for end in (line.start_ne_m, line.end_ne_m)
        )
        what = "the lines reach"
        check_ground(options, frame, home)
    if not reach_m <= limits.reach_m:
        raise PlanError(
            f"{what} {reach_m:.0f} m from the vehicle's home; accepted: up to {limits.reach_m:g} m. Choose "
            "`area_ne_m` nearer to it, a smaller `width_m, height_m`, or the map of this place"
        )


def check_ground(options: SurveyOptions, frame: LocalFrame, home: GeodeticPosition) -> None:
    """Refuse a takeoff height that is below the ground of the terrain at home's place."""
    terrain = terrain_of(options)
    if terrain is None:
        return
    north_m, east_m, down_m = frame.ned_from_geodetic(home.lat_deg, home.lon_deg, home.alt_m)
    ground_m = float(terrain.at(np.array([north_m]), np.array([east_m]))[0])
    if ground_m > -down_m + options.own_altitude_m:
        raise PlanError(
            f"`altitude_m` {options.own_altitude_m:g} m above home is below the terrain there, which is "
            f"{ground_m + down_m:.0f} m above it; is `terrain_file` of this place, with heights above the "
            "map's home?"
        )
