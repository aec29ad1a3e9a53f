"""Flies a mission file: uploads it unchanged and monitors it to its end."""

import math
from typing import Final

import numpy as np

from missions.errors import PlanError, VehicleTimeout
from missions.kind import VehicleKind
from missions.plan_files.document import NAV_WAYPOINT, MissionDocument
from missions.plan_files.options import FileOptions, Then
from missions.plan_files.progress import MissionWatch
from missions.plan_files.route import Route, Stop, path_ned_m, placed, route_of, scored_stops
from missions.vehicle.notes import CommandedPath, CutShort
from missions.vehicle.vehicle import Vehicle

FARTHEST_M: Final = 10_000.0
"""Largest distance from home to the nearest place of a mission; a file beyond it belongs to another place."""

_SLOW: Final = 0.5  # share of the planned speed, for deadlines
_LANDING_S: Final = 600.0


def check_distance(route: Route, path: object, home: object) -> None:
    """Raise PlanError if a mission is far away from its vehicle."""
    if not route.stops:
        return
    nearest_m = min(math.hypot(*stop.position_ned_m[:2]) for stop in route.stops)
    if nearest_m > FARTHEST_M:
        raise PlanError(
            f"{path} is flown {nearest_m * 1e-3:.0f} km from where the vehicle stands ({home}); accepted: at "
            f"most {FARTHEST_M * 1e-3:g} km"
        )


def own_speed_m_s(document: MissionDocument, kind: VehicleKind) -> float:
    """Speed that the plan assumes for a class of vehicle."""
    if kind is VehicleKind.FIXED_WING:
        return document.cruise_speed_m_s or 15.0
    return document.hover_speed_m_s or 5.0


async def fly_document(vehicle: Vehicle, options: FileOptions, document: MissionDocument) -> None:
    """Upload the document and fly it, including takeoff and landing.

    Raises:
        PlanError: an item is below home.
        MissionError: the vehicle refused the mission, or the flight failed.
    """
    notes, clock, home = vehicle.notes, vehicle.clock, vehicle.home
    wings = vehicle.kind is VehicleKind.FIXED_WING
    route = route_of(document, home)
    if document.firmware not in (None, vehicle.autopilot):
        notes.warn(
            f"{document.path} was planned for {document.firmware}, and is flown by {vehicle.autopilot}"
        )
    stops = scored_stops(route, with_takeoff=not wings)
    acceptance_m = await _acceptance_m(vehicle, document, stops)
    if stops:
        notes.commanded = CommandedPath(
            origin=home,
            points_ned_m=path_ned_m(stops),
            waypoints_ned_m=np.array([stop.position_ned_m for stop in stops]),
            acceptance_m=acceptance_m,
        )
    notes.begin("upload", clock.stamp_us)
    if wings:
        vehicle.wing.note_runway()
    items = placed(document.items, home, vehicle.firmware.unset)
    first = await vehicle.plans.upload_mission(items, fence=document.fence, rally=document.rally)
    notes.begin("takeoff", clock.stamp_us)
    watch = MissionWatch(vehicle, document, stops, first, acceptance_m)
    expected_s = route.duration_s(own_speed_m_s(document, vehicle.kind))
    tallest_m = max((-stop.position_ned_m[2] for stop in route.stops), default=0.0)
    limit_s = options.time_limit_s or 180.0 + 3.0 * max(0.0, tallest_m) + expected_s / _SLOW
    await vehicle.start_mission()
    ended = True
    try:
        await watch.until_the_end(limit_s)
    except VehicleTimeout:
        if options.time_limit_s is None:
            raise
        ended, notes.cut_short = False, CutShort.TIME
    if notes.current != "return":
        notes.begin("return", clock.stamp_us)
    over = ended and watch.lands
    if over and document.returns and options.then is Then.LAND:
        over = not await vehicle.return_end.stays_because()
    if not over and options.then is Then.LAND:
        await (vehicle.wing.land_along(wait=False) if wings else vehicle.land(wait=False))
    elif not over:
        await vehicle.return_to_launch(wait=False)
    await vehicle.return_end.wait(_LANDING_S + 2.0 * expected_s)
    notes.end(clock.stamp_us)


async def _acceptance_m(vehicle: Vehicle, document: MissionDocument, stops: tuple[Stop, ...]) -> float:
    """The largest radius within which places of the mission count as reached."""
    altitudes = {
        document.items[stop.index].param2
        for stop in stops
        if document.items[stop.index].command == NAV_WAYPOINT
    }
    radii = [
        await vehicle.adapter.acceptance_m(a if a > 0.0 else await vehicle.adapter.own_acceptance_m())
        for a in sorted(altitudes or {0.0}, key=lambda a: (math.isnan(a), a))
    ]
    return max(radii)
