"""Flies a pattern with a fixed wing, by setpoints along the path or as an uploaded mission."""

from functools import partial
from typing import Final

import numpy as np

from flightsim.foundation.geodesy import LocalFrame
from missions.base.options import FlightOptions, Via
from missions.errors import PlanError
from missions.pattern_search.wings.flight import PatternFlight, with_leads
from missions.pattern_search.wings.setpoints import fly_setpoints
from missions.pattern_search.wings.waypoints import fly_waypoints
from missions.patterns.curve import Curve
from missions.planning.flyable import flyable_path
from missions.planning.turns import check_turns, roll_in_m
from missions.vehicle.limits import FixedWingLimits
from missions.vehicle.vehicle import Vehicle

_REACH_SAMPLES: Final = 1000


def check_wings(curve: Curve, options: FlightOptions, limits: FixedWingLimits) -> float:
    """Refuse a pattern that an aircraft can't fly; returns the turn radius that it was checked for.

    Raises:
        PlanError: names the reason and the option to change.
    """
    if options.period_s is not None:
        raise PlanError(
            "`period_s` is for vehicles that can fly slowly in bends; choose `speed_m_s` for an aircraft"
        )
    limits.check_airspeed(options.speed_m_s)
    limits.check_separation(options.separation_m, options.vehicles)
    limits.check_altitude(options.own_altitude_m)
    coarse = curve.points(np.linspace(0.0, curve.end, _REACH_SAMPLES))
    limits.check_reach(float(np.hypot(*coarse.T).max()))
    check = partial(
        check_turns,
        curve,
        options.speed_m_s,
        limits,
        size_m=(options.width_m, options.height_m),
        spacing_m=options.spacing_m,
    )
    try:
        return check(radius_m=limits.path_radius_m(options.speed_m_s))
    except PlanError:
        if options.via is Via.WAYPOINTS:  # the autopilot's own guidance follows it
            raise
    return check(radius_m=limits.turn_radius_m(options.speed_m_s))


async def fly_pattern_with_wings(
    vehicle: Vehicle, options: FlightOptions, curve: Curve, limits: FixedWingLimits
) -> None:
    """Fly the pattern, including takeoff and landing; see `missions.pattern_search.flight.fly_pattern`."""
    flight = pattern_flight_of(vehicle, options, curve, limits)
    vehicle.wing.note_runway()
    if options.via is Via.SETPOINTS:
        await fly_setpoints(vehicle, flight)
    else:
        await fly_waypoints(vehicle, flight)


def pattern_flight_of(
    vehicle: Vehicle, options: FlightOptions, curve: Curve, limits: FixedWingLimits
) -> PatternFlight:
    """The pattern in the form that the aircraft can fly.

    Raises:
        PlanError: the aircraft can't fly it.
    """
    radius_m = check_wings(curve, options, limits)
    path = flyable_path(curve, radius_m, roll_in_m(options.speed_m_s, limits))
    if options.search_time_s is not None:
        path = path.until(options.search_time_s * options.speed_m_s)
    if options.centre is not None:
        c = options.centre
        north, east, _ = LocalFrame(vehicle.home).ned_from_geodetic(c.lat_deg, c.lon_deg, c.alt_m)
        path = path.moved(north, east)
    return PatternFlight(
        options=options,
        limits=limits,
        path=path,
        route=with_leads(path, limits.true_airspeed_m_s(options.speed_m_s) + limits.wind_m_s),
        turn_radius_m=radius_m,
    )
