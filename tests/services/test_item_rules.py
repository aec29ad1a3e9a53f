"""Which values of mission items are refused, and with which MAV_MISSION_RESULT (MAVLink, MAV_CMD)."""

import math
from typing import Any

import pytest

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.services.plans import rules

NAN, INF = math.nan, math.inf
OK = dialect.MAV_MISSION_ACCEPTED
PARAM1, PARAM2, PARAM3, PARAM4 = (
    dialect.MAV_MISSION_INVALID_PARAM1,
    dialect.MAV_MISSION_INVALID_PARAM2,
    dialect.MAV_MISSION_INVALID_PARAM3,
    dialect.MAV_MISSION_INVALID_PARAM4,
)
X, Y, Z = (
    dialect.MAV_MISSION_INVALID_PARAM5_X,
    dialect.MAV_MISSION_INVALID_PARAM6_Y,
    dialect.MAV_MISSION_INVALID_PARAM7,
)
UNSUPPORTED, FRAME = dialect.MAV_MISSION_UNSUPPORTED, dialect.MAV_MISSION_UNSUPPORTED_FRAME
INSIDE, OUTSIDE = (
    dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
    dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
)
CIRCLES = (dialect.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, dialect.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION)


def item(command: int, **values: Any) -> MissionItem:
    return MissionItem(command=command, **{"frame": dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT, **values})


@pytest.mark.parametrize(
    ("changed", "result"),
    [
        ({}, OK),
        ({"x": 90.0, "y": 180.0, "z": 83_000.0}, OK),
        ({"x": -90.0, "y": -180.0, "z": -83_000.0}, OK),
        ({"x": 90.01}, X),
        ({"x": -90.01}, X),
        ({"x": NAN}, X),
        ({"y": 180.01}, Y),
        ({"y": -180.01}, Y),
        ({"y": NAN}, Y),
        ({"z": 83_000.1}, Z),
        ({"z": -83_000.1}, Z),
        ({"z": NAN}, Z),
    ],
)
def test_a_position_is_on_earth(changed: dict[str, float], result: int) -> None:
    waypoint = item(dialect.MAV_CMD_NAV_WAYPOINT, **changed)
    assert rules.check_position(waypoint) == result


@pytest.mark.parametrize(
    ("command", "here"),
    [
        (dialect.MAV_CMD_NAV_TAKEOFF, True),
        (dialect.MAV_CMD_NAV_LAND, True),
        (dialect.MAV_CMD_NAV_LOITER_UNLIM, True),
        (dialect.MAV_CMD_NAV_LOITER_TIME, True),
        (dialect.MAV_CMD_NAV_LOITER_TURNS, True),
        (dialect.MAV_CMD_NAV_LOITER_TO_ALT, True),
        (dialect.MAV_CMD_NAV_WAYPOINT, False),
        (dialect.MAV_CMD_NAV_SPLINE_WAYPOINT, False),
    ],
)
def test_a_position_that_is_not_set_means_here_for_some_commands(command: int, here: bool) -> None:
    assert rules.check_position(item(command, x=NAN, y=NAN)) == (OK if here else X)
    assert rules.check_position(item(command, x=NAN, y=NAN, z=NAN)) == (Z if here else X)
    assert rules.check_position(item(command, x=10.0, y=NAN)) == Y  # half of a position is none


@pytest.mark.parametrize(("place", "result"), list(enumerate((PARAM1, PARAM2, PARAM3, PARAM4), start=1)))
@pytest.mark.parametrize("value", [INF, -INF, NAN])
def test_parameters_are_finite_or_not_set_where_that_is_allowed(
    place: int, result: int, value: float
) -> None:
    spoiled = item(dialect.MAV_CMD_NAV_WAYPOINT, **{f"param{place}": value})
    assert rules.check_params(spoiled, nan_allowed=(False,) * 4) == result
    allowed: Any = tuple(k == place for k in range(1, 5))
    assert rules.check_params(spoiled, nan_allowed=allowed) == (OK if math.isnan(value) else result)
    assert rules.check_params(item(dialect.MAV_CMD_NAV_WAYPOINT), nan_allowed=(False,) * 4) == OK


@pytest.mark.parametrize(
    ("target", "repeats", "result"),
    [
        (0, 1, OK),
        (9, 1, OK),
        (5, -1, OK),
        (5, 65_535, OK),
        (5, 0, OK),
        (-1, 1, PARAM1),
        (10, 1, PARAM1),
        (3, 1, PARAM1),  # itself
        (4.5, 1, PARAM1),
        (NAN, 1, PARAM1),
        (5, -1.5, PARAM2),
        (5, 65_536, PARAM2),
        (5, NAN, PARAM2),
    ],
)
def test_a_jump_goes_to_another_item(target: float, repeats: float, result: int) -> None:
    jump = item(dialect.MAV_CMD_DO_JUMP, param1=target, param2=repeats)
    assert rules.check_special(jump, 3, 10) == result


@pytest.mark.parametrize(
    ("command", "place", "value", "result"),
    [
        (dialect.MAV_CMD_DO_JUMP_TAG, 2, -1, OK),
        (dialect.MAV_CMD_DO_JUMP_TAG, 2, 65_535, OK),
        (dialect.MAV_CMD_DO_JUMP_TAG, 2, -2, PARAM2),
        (dialect.MAV_CMD_DO_JUMP_TAG, 2, 65_536, PARAM2),
        (dialect.MAV_CMD_DO_CHANGE_SPEED, 2, 0, OK),
        (dialect.MAV_CMD_DO_CHANGE_SPEED, 2, 7.5, OK),
        (dialect.MAV_CMD_DO_CHANGE_SPEED, 2, -1, OK),
        (dialect.MAV_CMD_DO_CHANGE_SPEED, 2, -2, OK),
        (dialect.MAV_CMD_DO_CHANGE_SPEED, 2, -0.5, PARAM2),
        (dialect.MAV_CMD_DO_CHANGE_SPEED, 2, -3, PARAM2),
        (dialect.MAV_CMD_DO_CHANGE_SPEED, 2, NAN, PARAM2),
        *(
            (command, 1, value, PARAM1 if value < 0.0 else OK)
            for command in (
                dialect.MAV_CMD_NAV_WAYPOINT,
                dialect.MAV_CMD_NAV_SPLINE_WAYPOINT,
                dialect.MAV_CMD_NAV_LOITER_TIME,
                dialect.MAV_CMD_CONDITION_DELAY,
                dialect.MAV_CMD_CONDITION_DISTANCE,
            )
            for value in (-0.1, 0.0, 5.0)
        ),
        (dialect.MAV_CMD_NAV_LAND, 1, -5, OK),
    ],
)
def test_impossible_speeds_and_delays(command: int, place: int, value: float, result: int) -> None:
    assert rules.check_special(item(command, **{f"param{place}": value}), 3, 10) == result


@pytest.mark.parametrize("command", [INSIDE, OUTSIDE])
@pytest.mark.parametrize(
    ("changed", "result"),
    [
        ({}, OK),
        ({"param1": 65_535.0}, OK),
        ({"param1": 2.9}, PARAM1),
        ({"param1": 2.0}, PARAM1),
        ({"param1": 65_536.0}, PARAM1),
        ({"param1": NAN}, PARAM1),
        ({"x": 90.0, "y": -180.0}, OK),
        ({"x": 90.1}, X),
        ({"x": NAN}, X),
        ({"y": -180.1}, Y),
        ({"z": INF}, Z),
        ({"z": NAN}, OK),
        ({"param2": INF}, PARAM2),
        ({"param4": NAN}, OK),
        ({"frame": dialect.MAV_FRAME_LOCAL_NED}, FRAME),
    ],
)
def test_corners_of_a_fence(command: int, changed: dict[str, Any], result: int) -> None:
    assert rules.check_fence(item(command, **{"param1": 3.0, **changed})) == result


@pytest.mark.parametrize("command", CIRCLES)
@pytest.mark.parametrize(
    ("radius_m", "result", "with_empty"),
    [
        (0.5, OK, OK),
        (1e4, OK, OK),
        (0.0, PARAM1, OK),
        (-1.0, PARAM1, PARAM1),
        (INF, PARAM1, PARAM1),
        (NAN, PARAM1, PARAM1),
    ],
)
def test_circles_of_a_fence(command: int, radius_m: float, result: int, with_empty: int) -> None:
    circle = item(command, param1=radius_m)
    assert rules.check_fence(circle) == result
    assert rules.check_fence(circle, empty_circles=True) == with_empty


def test_a_fence_and_a_rally_plan_hold_their_own_commands() -> None:
    assert rules.check_fence(item(dialect.MAV_CMD_NAV_FENCE_RETURN_POINT)) == OK
    assert rules.check_fence(item(dialect.MAV_CMD_NAV_WAYPOINT)) == UNSUPPORTED
    rally = item(dialect.MAV_CMD_NAV_RALLY_POINT, z=30.0)
    assert rules.check_rally(rally) == OK
    assert rules.check_rally(item(dialect.MAV_CMD_NAV_WAYPOINT)) == UNSUPPORTED
    for changed, result in (
        ({"frame": dialect.MAV_FRAME_LOCAL_NED}, FRAME),
        ({"x": 91.0}, X),
        ({"y": 181.0}, Y),
        ({"z": 83_001.0}, Z),
        ({"param3": INF}, PARAM3),
        ({"param3": NAN}, OK),
    ):
        assert rules.check_rally(item(dialect.MAV_CMD_NAV_RALLY_POINT, **changed)) == result


def corners(
    *places: tuple[float, float], command: int = INSIDE, stated: int | None = None
) -> tuple[MissionItem, ...]:
    count = float(len(places) if stated is None else stated)
    return tuple(item(command, param1=count, x=x, y=y) for x, y in places)


TRIANGLE = corners((0.0, 0.0), (4.0, 0.0), (0.0, 4.0))
SQUARE = corners((10.0, 10.0), (10.0, 12.0), (12.0, 12.0), (12.0, 10.0))
CIRCLE = item(CIRCLES[0], param1=50.0)


@pytest.mark.parametrize(
    ("items", "result"),
    [
        ((), OK),
        (TRIANGLE, OK),
        (TRIANGLE + SQUARE, OK),
        ((CIRCLE, *TRIANGLE, CIRCLE, *SQUARE, CIRCLE), OK),
        (TRIANGLE[:2], PARAM1),
        (TRIANGLE[:2] + SQUARE, PARAM1),
        ((*TRIANGLE[:2], CIRCLE, TRIANGLE[2]), PARAM1),
        (TRIANGLE + TRIANGLE[:1], PARAM1),
        (TRIANGLE[:2] + corners((0.0, 4.0), command=OUTSIDE, stated=3), PARAM1),
        (TRIANGLE[:2] + corners((0.0, 4.0), stated=4), PARAM1),
    ],
)
def test_each_polygon_has_as_many_corners_as_each_states(items: tuple[MissionItem, ...], result: int) -> None:
    assert rules.check_fence_polygons(items) == result


@pytest.mark.parametrize(
    ("x", "y", "inside"),
    [
        (1.0, 1.0, True),
        (1.9, 1.9, True),
        (2.1, 2.1, False),
        (3.5, 0.2, True),
        (0.2, 3.5, True),
        (3.5, 0.7, False),
        (-0.1, 1.0, False),
        (1.0, -0.1, False),
        (5.0, 1.0, False),
        (11.0, 11.0, True),
        (9.9, 11.0, False),
        (12.1, 11.0, False),
        (11.0, 9.9, False),
        (11.0, 12.1, False),
    ],
)
def test_a_point_outside_of_every_inclusion_polygon_is_excluded(x: float, y: float, inside: bool) -> None:
    """Of the triangle below x + y = 4, and the square from 10 to 12."""
    around = corners((-50.0, -50.0), (-50.0, 50.0), (50.0, 50.0), (50.0, -50.0), command=OUTSIDE)
    plan = (*TRIANGLE, CIRCLE, *around, *SQUARE)
    assert rules.fence_excludes(plan, x, y) is not inside


def test_without_an_inclusion_polygon_nothing_is_excluded() -> None:
    assert not rules.fence_excludes((), 0.0, 0.0)
    assert not rules.fence_excludes((CIRCLE,), 0.0, 0.0)
