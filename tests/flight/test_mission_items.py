"""Every kind of mission item, flown by the iris model, as each firmware goes through a plan."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import (
    FlightEvent,
    HomeChangeRequested,
    ItemCommanded,
    MissionFinished,
    WaypointReached,
)
from autopilot_bridge.flight.multicopter import MissionTask
from autopilot_bridge.flight.parameters import FlightParameters
from autopilot_bridge.flight.plan_reading import ARDUCOPTER_PLANS, PX4_PLANS, Command, PlanRules
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as n
from tests.flight.rig import Rig, positions, velocities

HEIGHT_M = 20.0
Array = np.ndarray


def place(
    north: float, east: float, height: float = HEIGHT_M, command: int = Command.NAV_WAYPOINT, **params: float
) -> MissionItem:
    return MissionItem(command=command, frame=1, x=north, y=east, z=-height, **{"param4": math.nan, **params})


def do(command: int, **params: float) -> MissionItem:
    return MissionItem(command=command, frame=2, **params)


class Flight:
    """A plan flown from a hover at the origin."""

    def __init__(
        self, *items: MissionItem, rules: PlanRules = PX4_PLANS, parameters: FlightParameters | None = None
    ) -> None:
        self.rig = Rig(height_m=HEIGHT_M, parameters=parameters)
        self.store = MissionStore()
        self.store.replace(items, 1)
        self.task = MissionTask(self.store, rules=rules)
        self.rig.fly(self.task)
        self.times: list[tuple[float, FlightEvent]] = []

    def run(self, limit_s: float, until: Callable[[], bool] | None = None) -> Array:
        """Navigation states at 10 Hz until the mission is finished, or until a condition."""
        logs = []
        until = until or (lambda: self.finished)
        for _ in range(round(limit_s * 10)):
            logs.append(self.rig.run(0.1)[-1])
            self.times += [(self.rig.time_s, event) for event in self.rig.ctx.events]
            self.rig.ctx.events.clear()
            if until():
                return np.array(logs)
        raise AssertionError(f"not done within {limit_s} s: item {self.store.current}, {self.times[-3:]}")

    @property
    def finished(self) -> bool:
        return any(isinstance(event, MissionFinished) for _, event in self.times)

    @property
    def reached(self) -> list[int]:
        return [event.seq for _, event in self.times if isinstance(event, WaypointReached)]

    @property
    def commanded(self) -> list[int]:
        return [event.seq for _, event in self.times if isinstance(event, ItemCommanded)]

    def when(self, seq: int) -> float:
        return next(t for t, e in self.times if isinstance(e, WaypointReached) and e.seq == seq)


def yaw_deg(state: Array) -> float:
    return math.degrees(float(state[27]))


def bearing_deg(state: Array, north: float, east: float) -> float:
    position = state[n.POS_NED_M]
    return math.degrees(math.atan2(east - position[1], north - position[0]))


def turned_from(a_deg: float, b_deg: float) -> float:
    return abs((a_deg - b_deg + 180.0) % 360.0 - 180.0)


# places and times


@pytest.mark.parametrize("hold_s", [0.0, 4.0])
def test_a_waypoint_is_held_for_its_time(hold_s: float) -> None:
    flight = Flight(place(10.0, 0.0, param1=hold_s), place(20.0, 0.0))
    log = flight.run(30.0)
    here = np.linalg.norm(positions(log)[:, :2] - [10.0, 0.0], axis=1) < 0.5
    still = here & (np.linalg.norm(velocities(log), axis=1) < 0.3)
    assert (still.sum() * 0.1 > hold_s - 0.5) if hold_s else (still.sum() == 0)


@pytest.mark.parametrize(("rules", "passes_m"), [(PX4_PLANS, 3.0), (ARDUCOPTER_PLANS, 1.5)])
def test_an_own_acceptance_radius_rounds_the_corner(rules: PlanRules, passes_m: float) -> None:
    """ArduCopter has one radius for all waypoints; PX4 rounds by the item's."""
    flight = Flight(place(30.0, 0.0, param2=9.0), place(30.0, 30.0), rules=rules)
    track = positions(flight.run(30.0))[:, :2]
    missed = np.linalg.norm(track - [30.0, 0.0], axis=1).min()
    assert (missed > 1.0) if rules.item_radius else (missed < passes_m)


def test_loiter_time_delay_and_height() -> None:
    flight = Flight(
        place(6.0, 0.0, command=Command.NAV_LOITER_TIME, param1=3.0),
        do(Command.NAV_DELAY, param1=2.0),
        place(6.0, 0.0, 26.0, command=Command.NAV_LOITER_TO_ALT),
        place(0.0, 0.0, 26.0),
    )
    log = flight.run(45.0)
    assert flight.reached == [0, 1, 2, 3]
    assert 1.9 < flight.when(1) - flight.when(0) < 2.3
    assert abs(positions(log)[-1][2] + 26.0) < 0.8


def test_loiter_turns_are_counted() -> None:
    flight = Flight(place(10.0, 0.0, command=Command.NAV_LOITER_TURNS, param1=2.0, param3=-6.0), place(0, 0))
    log = flight.run(60.0)
    track = positions(log)[:, :2] - [10.0, 0.0]
    on = np.abs(np.linalg.norm(track, axis=1) - 6.0) < 0.6
    turned = np.unwrap(np.arctan2(track[on][:, 1], track[on][:, 0]))
    assert -4.4 * math.pi < turned[-1] - turned[0] < -3.6 * math.pi  # twice, counter-clockwise


def test_loiter_without_end_stays() -> None:
    flight = Flight(place(5.0, 0.0, command=Command.NAV_LOITER_UNLIM), place(50.0, 0.0))
    flight.run(15.0, until=lambda: flight.rig.time_s > 14.0)
    assert abs(float(flight.rig.nav[n.POS_NED_M][0]) - 5.0) < 0.5
    assert not flight.reached


# jumps


@pytest.mark.parametrize("tagged", [False, True])
@pytest.mark.parametrize("repeats", [0, 1, 2])
def test_jumps_repeat_as_often_as_they_say(repeats: int, tagged: bool) -> None:
    if tagged:
        first, jump = (
            do(Command.JUMP_TAG, param1=7.0),
            do(Command.DO_JUMP_TAG, param1=7.0, param2=float(repeats)),
        )
    else:
        first, jump = do(Command.DO_LAND_START), do(Command.DO_JUMP, param1=0.0, param2=float(repeats))
    flight = Flight(first, place(3.0, 0.0), place(0.0, 0.0), jump, rules=ARDUCOPTER_PLANS)
    flight.run(80.0)
    assert [seq for seq in flight.reached if seq in (1, 2)] == [1, 2] * (repeats + 1)


def test_a_jump_for_ever() -> None:
    flight = Flight(
        place(3.0, 0.0), place(0.0, 0.0), do(Command.DO_JUMP, param1=0.0, param2=-1.0), place(9.0, 9.0)
    )
    flight.run(90.0, until=lambda: flight.reached.count(0) >= 4)
    assert 3 not in flight.reached


# what acts at once


def test_speed_home_and_equipment_items() -> None:
    flight = Flight(
        do(Command.DO_CHANGE_SPEED, param1=1.0, param2=2.0),
        place(20.0, 0.0),
        do(Command.DO_CHANGE_SPEED, param1=1.0, param2=-2.0),
        do(mavlink.MAV_CMD_DO_SET_SERVO, param1=9.0, param2=1500.0),
        MissionItem(command=Command.DO_SET_HOME, frame=1, x=4.0, y=5.0, z=-6.0),
        place(60.0, 0.0),
    )
    log = flight.run(60.0)
    north, speed = positions(log)[:, 0], np.linalg.norm(velocities(log)[:, :2], axis=1)
    assert 1.7 < speed[north < 18.0].max() < 2.3
    assert speed[north > 20.0].max() > 4.0
    assert flight.commanded == [3]
    (home,) = [event for _, event in flight.times if isinstance(event, HomeChangeRequested)]
    assert (home.north_m, home.east_m, home.down_m) == (4.0, 5.0, -6.0)


# conditions: ArduPilot's hold the DO_ items up beside the flight, PX4's are passed over


def test_condition_delay_holds_items_up_beside_the_flight() -> None:
    items = (
        place(2.0, 0.0),
        do(Command.CONDITION_DELAY, param1=3.0),
        do(mavlink.MAV_CMD_DO_SET_SERVO),
        place(40.0, 0.0),
    )
    beside = Flight(*items, rules=ARDUCOPTER_PLANS)
    beside.run(40.0)
    assert 2.9 < beside.when(2) - beside.when(0) < 3.3 < beside.when(3) - beside.when(0)
    at_once = Flight(*items)
    at_once.run(40.0)
    assert at_once.when(2) - at_once.when(0) < 0.2


def test_a_condition_that_is_overtaken_drops_what_waits_for_it() -> None:
    flight = Flight(
        place(2.0, 0.0),
        do(Command.CONDITION_DELAY, param1=60.0),
        do(mavlink.MAV_CMD_DO_SET_SERVO),
        place(10.0, 0.0),
        place(12.0, 0.0),
        rules=ARDUCOPTER_PLANS,
    )
    flight.run(40.0)
    assert flight.commanded == []
    assert [seq for seq in flight.reached if seq != 1] == [0, 3, 4]


def test_condition_distance() -> None:
    flight = Flight(
        place(1.0, 0.0),
        do(Command.CONDITION_DISTANCE, param1=10.0),
        do(mavlink.MAV_CMD_DO_SET_SERVO),
        place(30.0, 0.0),
        rules=ARDUCOPTER_PLANS,
    )
    flight.run(30.0, until=lambda: bool(flight.commanded))
    assert 19.5 < float(flight.rig.nav[n.POS_NED_M][0]) < 21.5


@pytest.mark.parametrize(("relative", "wanted_deg"), [(0.0, 90.0), (1.0, 90.0)])
def test_condition_yaw_turns_the_nose_on_the_way(relative: float, wanted_deg: float) -> None:
    flight = Flight(
        place(1.0, 0.0),
        do(Command.CONDITION_YAW, param1=90.0, param3=1.0, param4=relative),
        do(mavlink.MAV_CMD_DO_SET_SERVO),
        place(40.0, 0.0),
        place(80.0, 0.0),
        rules=ARDUCOPTER_PLANS,
        parameters=FlightParameters(use_waypoint_yaw=False),
    )
    log = flight.run(60.0, until=lambda: 3 in flight.reached)
    assert turned_from(yaw_deg(log[-1]), wanted_deg) < 8.0
    assert flight.commanded == [2]
    flight.run(20.0)
    assert turned_from(yaw_deg(flight.rig.nav), 0.0) < 8.0  # until the next waypoint


# regions of interest

SPOT = (10.0, 30.0)


def roi(command: int, **fields: float) -> MissionItem:
    return MissionItem(command=command, frame=1, x=SPOT[0], y=SPOT[1], z=0.0, **fields)


@pytest.mark.parametrize(
    "item",
    [
        roi(Command.DO_SET_ROI_LOCATION),
        roi(Command.DO_SET_ROI, param1=3.0),  # PX4: MAV_ROI_LOCATION
        roi(Command.DO_SET_ROI),  # ArduPilot
        roi(Command.NAV_ROI, param1=3.0),
    ],
)
@pytest.mark.parametrize("rules", [PX4_PLANS, ARDUCOPTER_PLANS])
@pytest.mark.sampled(3)
def test_the_nose_follows_a_place(item: MissionItem, rules: PlanRules) -> None:
    flight = Flight(
        place(1.0, 0.0),
        item,
        place(40.0, 0.0),
        do(Command.NAV_DELAY, param1=4.0),
        do(Command.DO_SET_ROI_NONE),
        place(60.0, 0.0),
        rules=rules,
    )
    log = flight.run(40.0, until=lambda: 2 in flight.reached)
    on_the_way = [state for state in log if state[n.POS_NED_M][0] > 12.0]
    assert max(turned_from(yaw_deg(s), bearing_deg(s, *SPOT)) for s in on_the_way) < 12.0
    log = flight.run(10.0, until=lambda: 3 in flight.reached)
    assert turned_from(yaw_deg(log[-1]), bearing_deg(log[-1], *SPOT)) < 6.0  # in the delay, too
    flight.run(30.0)
    assert turned_from(yaw_deg(flight.rig.nav), 0.0) < 10.0
    assert flight.commanded == [1, 4]  # the gimbal gets the command as well


def test_a_gimbal_that_turns_by_itself_leaves_the_nose_alone() -> None:
    flight = Flight(
        roi(Command.DO_SET_ROI_LOCATION),
        place(30.0, 0.0),
        parameters=FlightParameters(nose_follows_roi=False),
    )
    log = flight.run(30.0)
    assert max(turned_from(yaw_deg(s), 0.0) for s in log) < 10.0


@pytest.mark.parametrize("offset_deg", [0.0, 60.0])
def test_the_next_waypoint_with_an_offset(offset_deg: float) -> None:
    flight = Flight(
        MissionItem(command=Command.DO_SET_ROI_WPNEXT_OFFSET, frame=2, z=offset_deg), place(30.0, 30.0)
    )
    log = flight.run(40.0)
    middle = [s for s in log if 8.0 < s[n.POS_NED_M][0] < 24.0]
    assert max(turned_from(yaw_deg(s), 45.0 + offset_deg) for s in middle) < 12.0


# splines (ArduCopter)


def spline(north: float, east: float, height: float = HEIGHT_M, **params: float) -> MissionItem:
    return place(north, east, height, Command.NAV_SPLINE_WAYPOINT, **params)


def test_splines_pass_their_waypoints_smoothly() -> None:
    points = [(30.0, 0.0, 20.0), (60.0, 20.0, 24.0), (40.0, 50.0, 24.0), (0.0, 40.0, 20.0)]
    flight = Flight(place(*points[0]), *(spline(*point) for point in points[1:]), rules=ARDUCOPTER_PLANS)
    log = flight.run(90.0)
    assert flight.reached == [0, 1, 2, 3]
    track = positions(log)
    for north, east, height in points:
        assert np.linalg.norm(track - [north, east, -height], axis=1).min() < 1.2
    between = np.linalg.norm(velocities(log)[:, :2], axis=1)[
        (np.linalg.norm(track[:, :2], axis=1) > 15.0) & (np.linalg.norm(track[:, :2] - [0, 40], axis=1) > 12)
    ]
    assert between.min() > 1.5  # no stop on the way
    assert np.linalg.norm(track[-1] - [0.0, 40.0, -20.0]) < 1.0
    course = np.unwrap(np.arctan2(velocities(log)[:, 1], velocities(log)[:, 0]))[20:-40]
    assert np.abs(np.diff(course)).max() < 0.35  # per tenth of a second


def test_a_spline_between_straight_legs_keeps_their_directions() -> None:
    flight = Flight(place(30.0, 0.0), spline(60.0, 30.0), place(60.0, 80.0), rules=ARDUCOPTER_PLANS)
    log = flight.run(60.0)
    track, speed = positions(log), velocities(log)
    into = np.linalg.norm(track[:, :2] - [30.0, 0.0], axis=1).argmin()
    out = np.linalg.norm(track[:, :2] - [60.0, 30.0], axis=1).argmin()
    assert turned_from(math.degrees(math.atan2(speed[into][1], speed[into][0])), 0.0) < 15.0
    assert turned_from(math.degrees(math.atan2(speed[out][1], speed[out][0])), 90.0) < 15.0
    straight = track[out + 15 :]
    assert np.abs(straight[:, 0] - 60.0).max() < 0.8


def test_a_held_spline_waypoint_stops_there() -> None:
    flight = Flight(
        place(20.0, 0.0), spline(40.0, 20.0, param1=3.0), spline(20.0, 40.0), rules=ARDUCOPTER_PLANS
    )
    log = flight.run(60.0)
    still = np.linalg.norm(velocities(log), axis=1) < 0.3
    there = np.linalg.norm(positions(log)[:, :2] - [40.0, 20.0], axis=1) < 0.6
    assert (still & there).sum() * 0.1 > 2.5
    assert flight.reached == [0, 1, 2]


def test_a_spline_from_a_hover_and_back_to_the_same_place() -> None:
    flight = Flight(spline(0.0, 0.0), spline(12.0, 0.0), spline(12.0, 0.0), rules=ARDUCOPTER_PLANS)
    flight.run(60.0)
    assert flight.reached == [0, 1, 2]
    assert np.isfinite(flight.rig.ctx.setpoint[sp.POS_NED_M]).all()
