"""Mission items that firmwares fly differently with an aircraft, on a point mass that turns by bank."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.flight.context import FlightEvent, ItemCommanded, WaypointReached
from autopilot_bridge.flight.fixed_wing import FixedWingFlightParameters, LoiterTask, MissionTask, TurnInRule
from autopilot_bridge.flight.plan_reading import ARDUPLANE_PLANS, PX4_PLANS, Command, PlanRules
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from tests.flight.fixed_wing.kinematic import PointMass

PLANE = FixedWingFlightParameters(turn_in=TurnInRule.TURN_ANGLE, acceptance_altitude_m=math.inf)


def place(north: float, east: float, command: int = Command.NAV_WAYPOINT, **params: float) -> MissionItem:
    return MissionItem(command=command, frame=1, x=north, y=east, z=-100.0, **params)


def do(command: int, **params: float) -> MissionItem:
    return MissionItem(command=command, frame=2, **params)


class Flight:
    def __init__(self, *items: MissionItem, rules: PlanRules = ARDUPLANE_PLANS) -> None:
        self.mass = PointMass(parameters=PLANE)
        self.store = MissionStore()
        self.store.replace(items, 1)
        self.task = MissionTask(self.store, rules=rules)
        self.mass.fly(self.task)
        self.times: list[tuple[float, FlightEvent]] = []

    @property
    def time_s(self) -> float:
        return len(self.mass.log) * 0.02

    def run(self, until: Callable[[], bool], limit_s: float = 300.0) -> None:
        while not until():
            self.mass.run(0.1)
            self.times += [(self.time_s, event) for event in self.mass.ctx.events]
            self.mass.ctx.events.clear()
            assert self.time_s < limit_s, f"item {self.store.current}"

    def when(self, seq: int) -> float:
        return next((t for t, e in self.times if isinstance(e, WaypointReached) and e.seq == seq), math.inf)

    def has_reached(self, seq: int) -> Callable[[], bool]:
        return lambda: self.when(seq) < math.inf

    @property
    def commanded(self) -> list[int]:
        return [event.seq for _, event in self.times if isinstance(event, ItemCommanded)]


@pytest.mark.parametrize(("rules", "beyond_m"), [(ARDUPLANE_PLANS, 120.0), (PX4_PLANS, 0.0)])
def test_passing_a_waypoint_by(rules: PlanRules, beyond_m: float) -> None:
    """ArduPlane's param3: the next leg begins so far behind the waypoint. PX4 doesn't know it."""
    flight = Flight(place(600.0, 0.0, param3=120.0), place(600.0, 800.0), rules=rules)
    flight.run(flight.has_reached(0))
    assert flight.mass.place[0] == pytest.approx(600.0 + beyond_m, abs=28.0)


@pytest.mark.parametrize(("rules", "waits"), [(PX4_PLANS, True), (ARDUPLANE_PLANS, False)])
def test_hold_times(rules: PlanRules, waits: bool) -> None:
    """PX4's aircraft circle at a waypoint with a hold time; ArduPlane has none."""
    flight = Flight(place(500.0, 0.0, param1=40.0), place(1500.0, 0.0), rules=rules)
    flight.run(lambda: flight.mass.place[0] > 470.0)
    start = flight.time_s
    flight.run(flight.has_reached(0))
    assert (flight.time_s - start > 38.0) is waits
    flight.run(flight.has_reached(1))


def test_conditions_hold_items_up_beside_the_leg() -> None:
    flight = Flight(
        place(200.0, 0.0),
        do(Command.CONDITION_DELAY, param1=5.0),
        do(mavlink.MAV_CMD_DO_SET_SERVO),
        do(Command.CONDITION_DISTANCE, param1=300.0),
        do(mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST, param1=20.0),
        place(1200.0, 0.0),
    )
    flight.run(flight.has_reached(1))
    assert 4.9 < flight.time_s - flight.when(0) < 5.4
    flight.run(flight.has_reached(4))
    assert 890.0 < flight.mass.place[0] < 915.0
    assert flight.commanded == [2, 4]
    assert math.isinf(flight.when(5))


def test_condition_yaw_is_passed_over() -> None:
    flight = Flight(
        place(100.0, 0.0),
        do(Command.CONDITION_YAW, param1=90.0),
        do(mavlink.MAV_CMD_DO_SET_SERVO),
        place(500.0, 0.0),
    )
    flight.run(lambda: bool(flight.commanded), limit_s=30.0)


def test_tags_and_delay() -> None:
    flight = Flight(
        do(Command.JUMP_TAG, param1=3.0),
        place(400.0, 0.0),
        place(400.0, 400.0),
        do(Command.DO_JUMP_TAG, param1=3.0, param2=1.0),
        do(Command.NAV_DELAY, param1=6.0),
        place(0.0, 0.0),
    )
    flight.run(flight.has_reached(4))
    passed = [e.seq for _, e in flight.times if isinstance(e, WaypointReached) and e.seq in (1, 2)]
    assert passed == [1, 2, 1, 2]
    last = max(t for t, e in flight.times if isinstance(e, WaypointReached) and e.seq == 2)
    assert flight.when(4) - last == pytest.approx(6.0, abs=0.3)
    flight.run(flight.has_reached(5))


def test_a_region_of_interest_is_the_gimbals() -> None:
    flight = Flight(
        MissionItem(command=Command.DO_SET_ROI_LOCATION, frame=1, x=0.0, y=900.0), place(600.0, 0.0)
    )
    flight.run(flight.has_reached(1))
    assert flight.commanded == [0]
    assert np.abs(np.array(flight.mass.log)[:, 1]).max() < 5.0  # flown straight on


def test_what_is_circled_when_the_plan_is_over() -> None:
    flight = Flight(place(300.0, 0.0))
    flight.run(flight.has_reached(0))
    flight.mass.run(30.0)
    assert isinstance(flight.task.sub_task, LoiterTask)
