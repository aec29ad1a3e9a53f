"""Plans flown on the iris model."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.flight.context import MissionFinished, MissionModeRequested, WaypointReached
from autopilot_bridge.flight.heading import turn_angle
from autopilot_bridge.flight.multicopter import MissionTask, TaskStatus
from autopilot_bridge.flight.multicopter.corners import passing_speed, turn_distance, turn_speed
from autopilot_bridge.flight.parameters import FlightParameters
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav_layout
from tests.flight.rig import Rig, positions, velocities

HEIGHT_M = 20.0


def waypoint(
    rig: Rig, north_m: float, east_m: float, height_m: float = HEIGHT_M, **fields: float
) -> MissionItem:
    lat, lon, _ = rig.frame.geodetic_from_ned(north_m, east_m, -height_m)
    return MissionItem(
        command=mavlink.MAV_CMD_NAV_WAYPOINT, frame=6, x=lat, y=lon, z=height_m, param4=math.nan, **fields
    )


def store_of(*items: MissionItem) -> MissionStore:
    store = MissionStore()
    store.replace(tuple(items), 1)
    return store


def reached(rig: Rig) -> list[int]:
    return [e.seq for e in rig.ctx.events if isinstance(e, WaypointReached)]


@pytest.mark.slow
def test_lissajous_waypoints_are_passed_without_stopping() -> None:
    rig = Rig(height_m=HEIGHT_M)
    phase = np.linspace(0.0, 2.0 * np.pi, 121)[:-1]
    points = np.stack([50.0 * np.sin(2.0 * phase), 50.0 * np.sin(3.0 * phase)], axis=1)
    store = store_of(*(waypoint(rig, n, e, param2=2.0) for n, e in points))
    task = MissionTask(store)
    rig.fly(task)
    logs = []
    for _ in range(300):
        logs.append(rig.run(1.0))
        if any(isinstance(e, MissionFinished) for e in rig.ctx.events):
            break
    log = np.concatenate(logs)
    assert reached(rig) == list(range(len(points)))
    track = positions(log)[:, 0:2]
    misses = [np.linalg.norm(track - point, axis=1).min() for point in points]
    assert max(misses) < 1.6  # of 2 m
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    # 5 m/s commanded; tight corners may slow the vehicle, but it never stops on the way
    assert len(log) * 0.02 < length / 5.0 * 1.35 + 10.0
    speed = np.linalg.norm(velocities(log)[200:-400, 0:2], axis=1)
    assert speed.min() > 1.5
    assert speed.max() < 5.5


def test_square_with_takeoff_hold_and_return_lands_at_home() -> None:
    rig = Rig(parameters=FlightParameters(return_altitude_m=8.0, return_descend_altitude_m=4.0))
    store = store_of(
        MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, frame=6, z=6.0, param4=math.nan),
        waypoint(rig, 15.0, 0.0, 6.0),
        waypoint(rig, 15.0, 10.0, 6.0, param1=2.0),
        MissionItem(command=mavlink.MAV_CMD_DO_CHANGE_SPEED, frame=2, param1=1.0, param2=3.0),
        waypoint(rig, 0.0, 10.0, 8.0),
        MissionItem(command=mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, frame=2),
    )
    rig.fly(MissionTask(store))
    log = rig.run(85.0)
    assert any(isinstance(e, MissionModeRequested) for e in rig.ctx.events)
    assert reached(rig)[:5] == [0, 1, 2, 3, 4]
    assert rig.ctx.on_ground
    assert np.linalg.norm(positions(log)[-1][0:2]) < 0.5
    # the hold: two seconds within the acceptance radius, standing
    near = np.linalg.norm(positions(log) - [15.0, 10.0, -6.0], axis=1) < 1.0
    assert near.sum() * 0.02 > 2.0


def test_set_current_and_a_new_plan_take_effect_in_flight() -> None:
    rig = Rig(height_m=HEIGHT_M)
    store = store_of(waypoint(rig, 60.0, 0.0), waypoint(rig, 0.0, 20.0))
    rig.fly(MissionTask(store))
    rig.run(3.0)
    assert store.current == 0
    store.current = 1
    rig.run(11.5)
    assert np.linalg.norm(rig.nav[nav_layout.POS : nav_layout.POS + 2] - [0.0, 20.0]) < 2.0
    store.replace((waypoint(rig, -10.0, 20.0),), 2)
    rig.run(8.0)
    assert np.linalg.norm(rig.nav[nav_layout.POS : nav_layout.POS + 2] - [-10.0, 20.0]) < 1.0


def test_jump_repeats_and_unknown_items_are_passed_over() -> None:
    rig = Rig(height_m=HEIGHT_M)
    store = store_of(
        waypoint(rig, 4.0, 0.0),
        waypoint(rig, 0.0, 0.0),
        MissionItem(command=mavlink.MAV_CMD_IMAGE_START_CAPTURE, frame=2),
        MissionItem(command=mavlink.MAV_CMD_DO_JUMP, frame=2, param1=0.0, param2=1.0),
    )
    task = MissionTask(store)
    rig.fly(task)
    rig.run(30.0)
    assert [s for s in reached(rig) if s < 2] == [0, 1, 0, 1]
    assert sum(isinstance(e, MissionFinished) for e in rig.ctx.events) == 1
    assert task.update(rig.ctx) is TaskStatus.DONE


def test_endless_jump_over_nothing_ends_in_a_hold() -> None:
    rig = Rig(height_m=HEIGHT_M)
    rig.fly(
        MissionTask(
            store_of(
                MissionItem(command=mavlink.MAV_CMD_DO_DIGICAM_CONTROL, frame=2),
                MissionItem(command=mavlink.MAV_CMD_DO_JUMP, frame=2, param1=0.0, param2=-1.0),
            )
        )
    )
    rig.run(2.0)
    assert any(isinstance(e, MissionFinished) for e in rig.ctx.events)
    assert np.abs(velocities(rig.run(1.0))).max() < 0.3


@pytest.mark.parametrize(
    "item",
    [
        MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, frame=99),
        MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=200.0, y=0.5),
    ],
)
def test_items_without_a_place_are_skipped(item: MissionItem) -> None:
    rig = Rig(height_m=HEIGHT_M)
    rig.fly(MissionTask(store_of(item, waypoint(rig, 3.0, 0.0))))
    rig.run(6.0)
    assert rig.nav[nav_layout.POS] == pytest.approx(3.0, abs=0.5)


def test_corner_geometry() -> None:
    assert turn_angle((0, 0, 0), (1, 0, 0), (1, 1, 0)) == pytest.approx(math.pi / 2)
    assert turn_speed(0.0, 2.0, 2.5, 4.0) == math.inf
    assert turn_speed(math.pi, 2.0, 2.5, 4.0) == 0.0


@pytest.mark.parametrize("angle_deg", [5.0, 20.0, 60.0, 90.0, 120.0])
@pytest.mark.parametrize("distance_m", [0.3, 1.7, 8.0])
def test_turn_speed_is_the_inverse_of_the_turn_distance(angle_deg: float, distance_m: float) -> None:
    angle = math.radians(angle_deg)
    assert turn_distance(angle, turn_speed(angle, distance_m, 2.5, 4.0), 2.5, 4.0) == pytest.approx(
        distance_m
    )


@pytest.mark.parametrize("turn_deg", [45.0, 90.0, -90.0, 120.0])
@pytest.mark.sampled(2)
def test_corners_are_rounded_inside_without_swinging_out(turn_deg: float) -> None:
    rig = Rig(height_m=HEIGHT_M)
    turn = math.radians(turn_deg)
    corner = np.array([40.0, 0.0])
    end = corner + 40.0 * np.array([math.cos(turn), math.sin(turn)])
    rig.fly(MissionTask(store_of(*(waypoint(rig, n, e, param2=2.0) for n, e in (corner, end)))))
    track = positions(rig.run(24.0))[:, 0:2]
    assert reached(rig) == [0, 1]
    assert np.linalg.norm(track - corner, axis=1).min() < 0.6
    inside = np.array([-math.sin(turn / 2), math.cos(turn / 2)]) * math.copysign(1.0, turn)
    swing_out = -((track - corner) @ inside)  # negative on the side to which the course turns
    passed = int(np.linalg.norm(track - corner, axis=1).argmin())
    assert np.abs(track[:passed][track[:passed, 0] < 36.0, 1]).max() < 0.1  # the leg before
    along = np.array([math.cos(turn), math.sin(turn)])
    across = np.array([-along[1], along[0]])
    after = track[passed:] - corner
    assert np.abs(after[after @ along > 6.0] @ across).max() < 0.2  # the leg behind it, without overshoot
    near = np.linalg.norm(track - corner, axis=1) < 2.0
    assert swing_out[near].max() < 2.0 * math.cos(turn / 2)


def test_look_ahead_brakes_for_a_corner_two_legs_away() -> None:
    p = FlightParameters()
    straight = [(0.0, 0.0, 0.0), (5.0, 0.0, 0.0), (10.0, 0.0, 0.0), (60.0, 0.0, 0.0)]
    hook = [(0.0, 0.0, 0.0), (5.0, 0.0, 0.0), (10.0, 0.0, 0.0), (5.0, 0.5, 0.0), (60.0, 0.5, 0.0)]
    assert passing_speed(straight, [2.0] * 4, p) > 5.0
    assert passing_speed(hook, [2.0] * 5, p) < 4.0
