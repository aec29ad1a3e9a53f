"""What suits a vehicle in a magnetic search, where options were not specified, and what it can't fly."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Final

from estimators.errors import EstimatorError
from estimators.occupancy.detection import MapError
from estimators.occupancy.survey_map import SurveyMap, load_survey_map, map_error_of
from estimators.tracking.grid import GridLayout
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import PlanError
from missions.occupancy.options import MULTICOPTER_PENALTY, WINGS_PENALTY, OccupancyOptions
from missions.vehicle.limits import FixedWingLimits, Limits

_MULTICOPTER_M_S: Final = 10.0
_SHARE_OF_SPEED: Final = 0.9


def layout_of(options: OccupancyOptions) -> GridLayout:
    """The cells."""
    return GridLayout.over(
        width_m=options.width_m,
        height_m=options.height_m,
        cell_m=options.cell_m,
        centre_ne_m=options.area_ne_m,
    )


def stated_map_error(options: OccupancyOptions, survey_map: SurveyMap) -> MapError:
    """Error of a published map: specified by the user, else stated by the map, else that of a careful
    survey.
    """
    return map_error_of(survey_map, options.identification.map_error_nt)


def for_vehicle(options: OccupancyOptions, limits: Limits) -> OccupancyOptions:
    """The same options; those that were not specified get the decision parameters and the speed of the
    kind of vehicle.
    """
    if isinstance(limits, FixedWingLimits):
        penalty, speed_m_s = WINGS_PENALTY, limits.airspeed_trim_m_s
    else:
        penalty = MULTICOPTER_PENALTY
        speed_m_s = min(_MULTICOPTER_M_S, _SHARE_OF_SPEED * limits.speed_m_s)
    return replace(
        options,
        heading_penalty=penalty if options.heading_penalty is None else options.heading_penalty,
        speed_m_s=speed_m_s if options.speed_m_s is None else options.speed_m_s,
    )


def read_map(path: str) -> SurveyMap:
    """The published map in a file.

    Raises:
        PlanError: the file does not exist or is not a map, or the map has no data.
    """
    try:
        return load_survey_map(Path(path))
    except EstimatorError as error:
        raise PlanError(str(error)) from None


def check_map(options: OccupancyOptions, survey_map: SurveyMap) -> None:
    """Refuse a searched area that the map doesn't cover completely.

    Raises:
        PlanError: names the area that the map covers.
    """
    layout = layout_of(options)
    try:
        survey_map.require_data(
            south_m=layout.south_m,
            north_m=layout.north_m,
            west_m=layout.west_m,
            east_m=layout.east_m,
            what=f"the searched area (`width_m, height_m` {options.width_m:g}x{options.height_m:g})",
        )
    except EstimatorError as error:
        raise PlanError(str(error)) from None


def check_vehicle(options: OccupancyOptions, limits: Limits) -> None:
    """Refuse what one vehicle of the team can't fly.

    Args:
        options: options adapted to the vehicle.
        limits: limits of the vehicle, with the wind to plan for.

    Raises:
        PlanError: names the option to change.
    """
    limits.check_separation(options.separation_m, options.vehicles)
    limits.check_altitude(options.own_altitude_m)
    north_m, east_m = options.area_ne_m
    reach_m = math.hypot(abs(north_m) + 0.5 * options.height_m, abs(east_m) + 0.5 * options.width_m)
    if not reach_m <= limits.reach_m:
        raise PlanError(
            f"the searched area reaches {reach_m:.0f} m from the map's home, more than {limits.reach_m:g} m; "
            "ask for a smaller `width_m, height_m`, or an `area_ne_m` nearer to it"
        )
    speed_m_s = options.speed_m_s
    if speed_m_s is None:
        raise PlanError("the options are not those of a vehicle yet: call for_vehicle")
    if not isinstance(limits, FixedWingLimits):
        limits.check_speed(speed_m_s)
        return
    limits.check_airspeed(speed_m_s)
    radius_m = limits.turn_radius_m(speed_m_s)
    if options.decision.neighbourhood * options.cell_m < radius_m:
        larger_m = 10.0 * math.ceil(0.1 * radius_m / options.decision.neighbourhood)
        raise PlanError(
            f"`cell_m` {options.cell_m:g} m is too small for an aircraft whose turns have a radius of "
            f"{radius_m:.0f} m at {speed_m_s:g} m/s in {limits.wind_m_s:.3g} m/s of wind: the cells "
            f"beside it are out of reach; ask for `cell_m` {larger_m:g} or more, a larger `neighbourhood`, "
            "or less `speed_m_s`"
        )


def check_reach(options: OccupancyOptions, limits: Limits, frame: LocalFrame, home: GeodeticPosition) -> None:
    """Refuse an area that is too far from the vehicle's home.

    Args:
        options: options of the vehicle.
        limits: limits of the vehicle.
        frame: local frame of the map.
        home: home of the vehicle.

    Raises:
        PlanError: names the distance and what to change.
    """
    north_m, east_m, _ = frame.ned_from_geodetic(home.lat_deg, home.lon_deg, home.alt_m)
    layout = layout_of(options)
    farthest_m = max(
        math.hypot(edge_n_m - north_m, edge_e_m - east_m)
        for edge_n_m in (layout.south_m, layout.north_m)
        for edge_e_m in (layout.west_m, layout.east_m)
    )
    if not farthest_m <= limits.reach_m:
        raise PlanError(
            f"the searched area reaches {farthest_m:.0f} m from the vehicle's home, which is at north "
            f"{north_m:.0f} m, east {east_m:.0f} m of the map's home; accepted: up to {limits.reach_m:g} m. "
            "Choose `area_ne_m`, a smaller `width_m, height_m`, or the map of this place"
        )
