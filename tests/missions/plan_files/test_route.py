"""Where a mission file leads."""

import math
from itertools import pairwise
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition
from missions.plan_files.document import MissionDocument
from missions.plan_files.route import has_curves, path_ned_m, placed, route_of, scored_stops, straight
from tests.missions.plan_files.plans import ALT, LAT, LON

HOME = GeodeticPosition(lat_deg=LAT, lon_deg=LON, alt_m=ALT)
NAN = math.nan


def document(*items: MissionItem) -> MissionDocument:
    return MissionDocument(path=Path("a.plan"), items=items, home=HOME)


def at(
    north: float, height_m: float = 10.0, command: int = mavlink.MAV_CMD_NAV_WAYPOINT, **more: float
) -> MissionItem:
    return MissionItem(command=command, x=LAT + north, y=LON, z=height_m, **more)


def test_jumps_are_followed_as_often_as_they_say() -> None:
    jump = MissionItem(command=mavlink.MAV_CMD_DO_JUMP, frame=2, param1=1.0, param2=2.0)
    route = route_of(
        document(at(0.0, command=mavlink.MAV_CMD_NAV_TAKEOFF), at(1e-4), at(2e-4), jump, at(3e-4)), HOME
    )
    assert [stop.index for stop in route.stops] == [0, 1, 2, 1, 2, 1, 2, 4]
    assert not route.endless


@pytest.mark.parametrize("repeats", [-1, 30000])
def test_a_jump_for_ever_has_no_end(repeats: int) -> None:
    jump = MissionItem(command=mavlink.MAV_CMD_DO_JUMP, frame=2, param1=0.0, param2=float(repeats))
    assert route_of(document(at(1e-4), jump), HOME).endless


def test_heights_count_from_home_in_every_frame() -> None:
    items = (at(1e-4, ALT + 30.0, frame=5), at(1e-4, 30.0, frame=6), at(1e-4, 30.0, frame=11))
    downs = [stop.position_ned_m[2] for stop in route_of(document(*items), HOME).stops]
    assert downs == [pytest.approx(-30.0)] * 3


def test_speed_and_stays_make_the_duration() -> None:
    speed = MissionItem(command=mavlink.MAV_CMD_DO_CHANGE_SPEED, frame=2, param1=1.0, param2=10.0)
    route = route_of(document(at(0.0), speed, at(9e-4, param1=7.0)), HOME)
    north_m = route.stops[1].position_ned_m[0]
    assert north_m == pytest.approx(100.0, rel=0.01)
    assert route.length_m == pytest.approx(north_m)
    assert route.duration_s(5.0) == pytest.approx(north_m / 10.0 + 7.0)


def test_here_is_where_the_vehicle_was_before() -> None:
    items = (
        MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, z=10.0),
        at(1e-4),
        MissionItem(command=mavlink.MAV_CMD_NAV_LAND, x=NAN, y=NAN, param4=NAN),
    )
    takeoff, _, land = placed(items, HOME, 0.0)
    assert (takeoff.x, takeoff.y) == (LAT, LON)
    assert (land.x, land.y, land.param4) == (LAT + 1e-4, LON, 0.0)
    assert math.isnan(placed(items, HOME, NAN)[2].param4)


def test_a_route_ends_with_its_landing_or_return() -> None:
    landing = route_of(document(at(1e-4), at(0.0, 0.0, 21), at(9e-4)), HOME)
    assert [stop.index for stop in landing.stops] == [0, 1]
    back = route_of(
        document(at(1e-4), MissionItem(command=mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, frame=2), at(9e-4)), HOME
    )
    assert [stop.index for stop in back.stops] == [0]


def test_what_is_scored() -> None:
    route = route_of(
        document(
            at(0.0, command=mavlink.MAV_CMD_NAV_TAKEOFF),
            at(1e-4),
            at(2e-4, command=mavlink.MAV_CMD_NAV_LOITER_TIME),
            at(0.0, 0.0, 21),
        ),
        HOME,
    )
    assert [s.command for s in scored_stops(route, with_takeoff=True)] == [22, 16, 19]
    wings = scored_stops(route, with_takeoff=False)
    assert [s.command for s in wings] == [16, 19]
    assert not has_curves(wings)  # the circle is the last of it
    assert has_curves(route.stops)


def test_splines_are_no_lines() -> None:
    line, spline, after = route_of(
        document(at(0.0), at(1e-4, command=mavlink.MAV_CMD_NAV_SPLINE_WAYPOINT), at(2e-4)), HOME
    ).stops
    assert not straight(line, spline)
    assert straight(spline, after)
    assert has_curves((line, spline, after))
    assert not has_curves((spline, after))  # nothing leads to the first place


def test_the_path_is_straight_between_places() -> None:
    stops = route_of(document(at(0.0), at(1e-4, 20.0)), HOME).stops
    path = path_ned_m(stops)
    assert path[0].tolist() == pytest.approx([0.0, 0.0, -10.0])
    assert path[-1].tolist() == list(stops[1].position_ned_m)
    steps = [math.dist(a, b) for a, b in pairwise(path)]
    assert max(steps) <= 1.0
    assert sum(steps) == pytest.approx(math.dist(path[0], path[-1]))
