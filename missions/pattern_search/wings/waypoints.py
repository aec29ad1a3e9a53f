"""Flies a pattern as an uploaded mission: takeoff, an entry circle, its waypoints, the landing."""

from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mission_plan import MissionItem
from missions.base.options import FlightOptions
from missions.errors import VehicleTimeout
from missions.pattern_search.wings.flight import PatternFlight
from missions.pattern_search.wings.place import PlaceOnPath
from missions.planning.flyable import FlyablePath
from missions.planning.way_in import Entry, way_in_items, waypoint_item
from missions.vehicle.limits import FixedWingLimits
from missions.vehicle.notes import PATTERN, CutShort
from missions.vehicle.vehicle import Vehicle

_DEVIATION_M: Final = 1.0
_SPACING_MIN_S: Final = 1.6
_SPACING_MAX_M: Final = 300.0
_TURN_IN_MAX_M: Final = 250.0  # ArduPlane accepts at most 255 as a waypoint's radius


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternItems:
    """A plan to upload, and the items of the pattern in it.

    Attributes:
        items: the plan.
        waypoints: waypoints of the pattern, north and east of home.
        first, last: indices of the pattern's first and last waypoint.
    """

    items: list[MissionItem]
    waypoints: list[tuple[float, float]]
    first: int
    last: int


def mission_items(vehicle: Vehicle, flight: PatternFlight) -> PatternItems:
    """All items from the takeoff to the landing."""
    options = flight.options
    waypoints = waypoints_of(flight.path, options)
    radius_m = turn_in_m(options, flight.limits)
    items = _way_in(vehicle, flight)
    first = len(items)
    items += [_waypoint(vehicle, options, radius_m, north, east) for north, east in waypoints]
    last = len(items) - 1
    out, _, _ = flight.route.at(flight.route.length_m)
    items.append(_waypoint(vehicle, options, radius_m, *out))
    items += flight.approach(vehicle).items()
    return PatternItems(items=items, waypoints=list(waypoints), first=first, last=last)


async def fly_waypoints(vehicle: Vehicle, flight: PatternFlight) -> None:
    """Fly the pattern, including takeoff and landing."""
    notes, clock, options = vehicle.notes, vehicle.clock, flight.options
    acceptance_m = await vehicle.adapter.acceptance_m(options.acceptance_m)
    plan = mission_items(vehicle, flight)
    first, last = plan.first, plan.last
    notes.commanded = flight.commanded(vehicle, plan.waypoints, acceptance_m)
    notes.begin("upload", clock.stamp_us)
    start = await vehicle.plans.upload_mission(plan.items)
    notes.begin("takeoff", clock.stamp_us)
    await vehicle.start_mission()
    place = PlaceOnPath(vehicle, flight.route, -options.speed_m_s)
    await vehicle.plans.wait_item_reached(
        start + first - 1, 180.0 + 2.0 * options.own_altitude_m + flight.away_s
    )
    notes.begin("transit", clock.stamp_us)
    lead_s = -float(flight.route.arc_m[0]) / flight.slow_m_s
    await vehicle.plans.wait_item_reached(start + first, 60.0 + lead_s)
    await _passed(vehicle, place, 0.0)
    notes.begin(PATTERN, clock.stamp_us)

    def progress(done: int) -> None:
        place.update()
        notes.progress = min(1.0, max(0.0, (done - start - first) / max(1, last - first)))

    limit_s = 60.0 + flight.path.length_m / flight.slow_m_s
    try:
        await vehicle.plans.wait_item_reached(
            start + last, min(limit_s, options.search_time_s or limit_s), progress
        )
        place.arc_m = max(place.arc_m, flight.path.length_m - 4.0 * acceptance_m)
        await _passed(vehicle, place, flight.path.length_m)
    except VehicleTimeout:
        if options.search_time_s is None:
            raise
        notes.cut_short = CutShort.TIME
        await vehicle.wing.land_along(flight.approach(vehicle), wait=False)  # the search time has ended
    notes.begin("return", clock.stamp_us)
    await vehicle.link.wait_disarmed(600.0 + 2.0 * flight.away_s)
    notes.end(clock.stamp_us)


def waypoints_of(path: FlyablePath, options: FlightOptions) -> list[tuple[float, float]]:
    """Waypoints (north, east) of a path: close together where it bends."""
    return path.waypoints(
        deviation_m=_DEVIATION_M,
        spacing_min_m=_SPACING_MIN_S * options.speed_m_s,
        spacing_max_m=_SPACING_MAX_M,
    )


def turn_in_m(options: FlightOptions, limits: FixedWingLimits) -> float:
    """Distance before a waypoint at which the aircraft turns to the next leg.

    Between short legs the followed course is that of the middle of a leg: half a leg is added to the distance
    flown in the time that the guidance needs.

    Args:
        options: options; an acceptance radius that the user specified is kept.
        limits: limits of the aircraft.
    """
    if options.chosen("acceptance_m") or limits.waypoint_lead_s == 0.0:
        return options.acceptance_m
    leg_m = _SPACING_MIN_S * options.speed_m_s
    lead_m = limits.true_airspeed_m_s(options.speed_m_s) * limits.waypoint_lead_s
    return min(_TURN_IN_MAX_M, max(options.acceptance_m, lead_m + 0.5 * leg_m))


def _way_in(vehicle: Vehicle, flight: PatternFlight) -> list[MissionItem]:
    """Takeoff, airspeed, and a circle at the pattern's height that is left along the first leg."""
    options = flight.options
    return way_in_items(
        vehicle,
        Entry.to(flight.route, flight.turn_radius_m),
        airspeed_m_s=options.speed_m_s,
        takeoff_m=options.own_altitude_m,
        height_m=options.own_altitude_m,
    )


def _waypoint(
    vehicle: Vehicle, options: FlightOptions, radius_m: float, north_m: float, east_m: float
) -> MissionItem:
    return waypoint_item(vehicle, radius_m, north_m, east_m, options.own_altitude_m)


async def _passed(vehicle: Vehicle, place: PlaceOnPath, arc_m: float) -> None:
    """Wait until the aircraft has passed a place; waypoints count as reached before they are passed."""

    def there() -> bool:
        place.update()
        return place.arc_m >= arc_m

    await vehicle.link.wait_until(
        there, what="the waypoint abeam", on=("GLOBAL_POSITION_INT",), timeout_s=60.0
    )
