"""Plans flown by the Aerosonde."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import (
    FlightEvent,
    LandedState,
    MissionFinished,
    MissionModeRequested,
    TouchedDown,
    WaypointReached,
)
from autopilot_bridge.flight.fixed_wing import (
    FixedWingFlightParameters,
    LandPhase,
    LandTask,
    LoiterTask,
    MissionTask,
    ReturnTask,
    TurnInRule,
)
from autopilot_bridge.flight.plan_reading import Command, landing_start
from autopilot_bridge.flight.task import SpeedKind, TaskStatus
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as n
from flightsim.environment import Environment
from tests.control.fixed_wing.aerosonde import AEROSONDE
from tests.flight.fixed_wing.aircraft import Aircraft
from tests.flight.fixed_wing.kinematic import PointMass

Place = tuple[float, float, float]


def item(place: Place, command: int = Command.NAV_WAYPOINT, **params: float) -> MissionItem:
    """An item at (north, east, height over the origin)."""
    return MissionItem(command=command, frame=1, x=place[0], y=place[1], z=-place[2], **params)


def do(command: int, **params: float) -> MissionItem:
    return MissionItem(command=command, frame=2, **params)


def store_of(*items: MissionItem) -> MissionStore:
    store = MissionStore()
    store.replace(items, 1)
    return store


def reached(events: list[FlightEvent]) -> list[int]:
    return [e.seq for e in events if isinstance(e, WaypointReached)]


def cross_track(log: np.ndarray, start: Place, end: Place) -> tuple[np.ndarray, np.ndarray]:
    """(distance along, distance right of) the line of a leg."""
    leg = np.array(end[:2]) - np.array(start[:2])
    unit = leg / np.hypot(*leg)
    away = log[:, 0:2] - np.array(start[:2])
    return away @ unit, unit[0] * away[:, 1] - unit[1] * away[:, 0]


@pytest.mark.parametrize("wind", [(0.0, 0.0, 0.0), (-3.5, 4.9, 0.0)])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_whole_flight_from_runway_to_runway(wind: tuple[float, float, float]) -> None:
    """6 m/s of wind and moderate turbulence: cross-track RMS under 5 m, height under 2, airspeed under 1."""
    turbulence = "moderate" if any(wind) else "none"
    rig = Aircraft(environment=Environment(wind_ned_m_s=wind, turbulence=turbulence), seed=1)
    rig.rangefinder = True  # as the aircraft has it
    corners: list[Place] = [
        (700.0, 0.0, 80.0),
        (700.0, 700.0, 80.0),
        (-500.0, 700.0, 60.0),
        (-500.0, 0.0, 45.3),
    ]
    store = store_of(
        item((300.0, 0.0, 60.0), Command.NAV_TAKEOFF),
        *(item(c) for c in corners),
        item((0.0, 0.0, 0.3), Command.NAV_LAND),
    )
    task = MissionTask(store)
    rig.fly(task)
    current = []
    while not any(isinstance(e, MissionFinished) for e in rig.ctx.events):
        rig.run(0.1)
        current += [store.current] * 5
        assert rig.time_s < 300.0
    assert reached(rig.ctx.events) == [0, 1, 2, 3, 4, 5]
    assert TouchedDown() in rig.ctx.events
    assert task.update(rig.ctx) is TaskStatus.DONE
    assert rig.ctx.landed_state is LandedState.ON_GROUND
    assert rig.touch_sink_m_s < 2.0
    assert math.hypot(*rig.touch_ned_m) < 20.0
    log, seq = np.array(rig.log), np.array(current)
    for k in (1, 2):
        start, end = corners[k - 1], corners[k]
        length = math.dist(start[:2], end[:2])
        leg = log[seq == k + 1]
        along, right = cross_track(leg[:, 10:13], start, end)
        settled = (along > 250.0) & (along < length - 80.0)
        assert np.sqrt(np.mean(right[settled] ** 2)) < 5.0
        height = start[2] + (end[2] - start[2]) * along[settled] / (
            length - rig.parameters.acceptance_radius_m
        )
        assert np.sqrt(np.mean((-leg[settled, 12] - height) ** 2)) < 2.0
        assert np.sqrt(np.mean((leg[settled, n.AIRSPEED_M_S] - 25.0) ** 2)) < 1.0


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_waypoints_are_flown_through_with_the_turn_begun_before(turn: float) -> None:
    mass = PointMass(wind_ne_m_s=(3.0, -4.0))
    store = store_of(item((800.0, 0.0, 100.0)), item((800.0, turn * 900.0, 100.0)), item((0.0, 0.0, 100.0)))
    mass.fly(MissionTask(store))
    while store.current == 0:
        mass.run(0.1)
    assert 30.0 < 800.0 - mass.place[0] < 90.0
    log = []
    while store.current == 1:
        log.append(mass.run(0.1))
    flown = np.concatenate(log)
    _, right = cross_track(flown[:, 0:3], (800.0, 0.0, 0.0), (800.0, 900.0, 0.0))
    assert np.abs(right[len(right) // 2 :]).max() < 3.0
    assert np.abs(right).max() < 90.0


def test_arduplanes_turns_begin_by_their_angle() -> None:
    p = FixedWingFlightParameters(
        turn_in=TurnInRule.TURN_ANGLE, acceptance_radius_m=90.0, acceptance_altitude_m=math.inf
    )
    for bend_deg, expected in ((90.0, 90.0), (45.0, 45.0), (120.0, 90.0)):
        mass = PointMass(parameters=p)
        bend = math.radians(bend_deg)
        store = store_of(
            item((800.0, 0.0, 150.0)), item((800.0 + 900.0 * math.cos(bend), 900.0 * math.sin(bend), 100.0))
        )
        mass.fly(MissionTask(store))
        while store.current == 0:
            mass.run(0.02)
        assert math.hypot(800.0 - mass.place[0], mass.place[1]) == pytest.approx(expected, abs=1.5)


def test_a_height_not_reached_is_circled_to() -> None:
    mass = PointMass()
    store = store_of(item((500.0, 0.0, 250.0)), item((500.0, 800.0, 250.0)))
    task = MissionTask(store)
    mass.fly(task)
    mass.run(25.0)
    assert isinstance(task.sub_task, LoiterTask)
    while store.current == 0:
        mass.run(0.1)
    assert 239.0 < -mass.place[2] < 251.0


def test_a_missed_waypoint_is_flown_to_again() -> None:
    p = FixedWingFlightParameters(acceptance_radius_m=20.0, turn_in=TurnInRule.TURN_ANGLE)
    mass = PointMass(parameters=p)
    # right behind: the turn to it ends beside it
    store = store_of(item((30.0, 60.0, 100.0)), item((800.0, 0.0, 100.0)))
    mass.fly(MissionTask(store))
    while store.current == 0:
        mass.run(0.1)
        assert len(mass.log) < 50 * 120
    assert math.hypot(30.0 - mass.place[0], 60.0 - mass.place[1]) < 45.0


@pytest.mark.parametrize("radius", [120.0, -120.0])
@pytest.mark.slow
def test_circles_of_a_plan(radius: float) -> None:
    mass = PointMass(wind_ne_m_s=(0.0, 4.0))
    store = store_of(
        item((600.0, 0.0, 100.0), Command.NAV_LOITER_TURNS, param1=2.0, param2=1.0, param3=radius),
        item((600.0, 0.0, 130.0), Command.NAV_LOITER_TO_ALT, param1=0.0, param2=radius),
        item((600.0, 0.0, 130.0), Command.NAV_LOITER_TIME, param1=20.0, param3=radius),
        item((600.0, 0.0, 130.0), Command.NAV_LOITER_UNLIM, param3=radius),
    )
    task = MissionTask(store)
    mass.fly(task)
    times = {}
    while store.current < 3:
        before = store.current
        mass.run(0.1)
        if store.current != before:
            times[before] = len(mass.log) * 0.02
        assert len(mass.log) < 50 * 300
    # two turns of 30 s at 25 m/s, the way there, and a piece of a turn until the course fits
    assert 75.0 < times[0] < 135.0
    assert mass.place[2] == pytest.approx(-130.0, abs=4.0)
    assert times[2] - times[1] == pytest.approx(20.0, abs=3.0)
    log = mass.run(100.0)
    assert store.current == 3
    assert np.abs(np.hypot(log[:, 0] - 600.0, log[:, 1]) - 120.0).max() < 10.0
    angle = np.unwrap(np.arctan2(log[:, 1], log[:, 0] - 600.0))
    assert (angle[-1] - angle[0]) * radius > 0.0


def test_a_circle_is_left_towards_the_next_waypoint() -> None:
    mass = PointMass()
    store = store_of(
        item((600.0, 0.0, 100.0), Command.NAV_LOITER_TURNS, param1=1.0, param2=1.0, param3=120.0),
        item((600.0, 2000.0, 100.0)),
    )
    mass.fly(MissionTask(store))
    while store.current == 0:
        mass.run(0.02)
    course = mass.heading
    wanted = math.atan2(2000.0 - mass.place[1], 600.0 - mass.place[0])
    assert abs(math.remainder(course - wanted, 2.0 * math.pi)) < math.radians(25.0)
    log = mass.run(30.0)
    assert np.abs(np.diff(log[:, 1]) < 0.0).sum() == 0  # straight there


def test_speed_jump_and_unknown_items() -> None:
    mass = PointMass()
    store = store_of(
        do(Command.DO_CHANGE_SPEED, param1=0.0, param2=30.0, param3=-1.0),
        item((300.0, 0.0, 100.0)),
        do(mavlink.MAV_CMD_DO_DIGICAM_CONTROL),  # a camera it doesn't have
        item((600.0, 300.0, 100.0)),
        do(Command.DO_JUMP, param1=1.0, param2=1.0),
        do(Command.DO_CHANGE_SPEED, param1=0.0, param2=-2.0),
        item((-300.0, 0.0, 100.0)),
    )
    task = MissionTask(store)
    mass.fly(task)
    mass.run(8.0)
    assert mass.airspeed == pytest.approx(30.0, abs=0.3)
    while not any(isinstance(e, MissionFinished) for e in mass.ctx.events):
        mass.run(0.5)
        assert len(mass.log) < 50 * 300
    assert reached(mass.ctx.events) == [0, 1, 2, 3, 1, 2, 3, 5, 6]  # a jump is not reported
    assert mass.airspeed == pytest.approx(25.0, abs=0.3)
    log = mass.run(60.0)  # circles at the last waypoint
    assert np.hypot(log[-1000:, 0] + 300.0, log[-1000:, 1]).mean() == pytest.approx(80.0, rel=0.05)
    task.change_speed(mass.ctx, SpeedKind.AIRSPEED, 28.0)
    mass.run(8.0)
    assert mass.airspeed == pytest.approx(28.0, abs=0.3)


def test_delay_continue_and_return() -> None:
    mass = PointMass()
    store = store_of(
        do(Command.NAV_DELAY, param1=5.0),
        item((0.0, 0.0, 130.0), Command.NAV_CONTINUE_AND_CHANGE_ALT),
        do(Command.NAV_RETURN_TO_LAUNCH),
    )
    task = MissionTask(store)
    mass.fly(task)
    mass.run(4.5)
    assert store.current == 0
    mass.run(1.0)
    assert store.current == 1
    while store.current == 1:
        mass.run(0.1)
    assert mass.place[2] == pytest.approx(-120.0, abs=1.0)
    assert MissionModeRequested(Command.NAV_RETURN_TO_LAUNCH) in mass.ctx.events
    assert isinstance(task.sub_task, ReturnTask)


def test_set_current_and_a_new_plan_take_effect_in_flight() -> None:
    mass = PointMass()
    store = store_of(item((900.0, 0.0, 100.0)), item((0.0, 900.0, 100.0)))
    mass.fly(MissionTask(store))
    mass.run(1.0)
    store.current = 1
    mass.run(25.0)
    assert mass.place[1] > 300.0
    store.replace((item((-900.0, 0.0, 100.0)),), 2)
    mass.run(30.0)
    assert mass.place[0] < -100.0


def test_on_the_ground_only_a_takeoff_moves_it() -> None:
    rig = Aircraft()
    store = store_of(item((900.0, 0.0, 100.0)))
    rig.fly(MissionTask(store))
    rig.run(2.0)
    assert rig.controller.setpoint[sp.LEVEL] == sp.IDLE
    rig.ctx.armed = False
    rig.run(0.1)
    assert rig.controller.setpoint[sp.LEVEL] == sp.OFF


def test_without_a_position_it_banks_and_goes_on_when_there_is_one() -> None:
    mass = PointMass()
    store = store_of(item((900.0, 0.0, 100.0)))
    mass.fly(MissionTask(store))
    mass.run(5.0)
    health = mass.ctx.health
    assert health is not None
    health.position_horizontal_relative = health.position_horizontal_absolute = False
    log = mass.run(10.0)
    assert np.degrees(log[-1, 3]) == pytest.approx(15.0, abs=0.5)
    assert log[-1, 2] == pytest.approx(-100.0, abs=1.0)
    health.position_horizontal_relative = health.position_horizontal_absolute = True
    mass.run(60.0)
    assert reached(mass.ctx.events) == [0]


@pytest.mark.slow
def test_go_around_in_a_plan_comes_back_to_the_landing() -> None:
    rig = Aircraft(height_m=60.0, environment=Environment(wind_ned_m_s=(-4.0, 0.0, 0.0)))
    rig.ctx.home_ned_m[2] = -0.3
    store = store_of(
        do(Command.DO_LAND_START), item((300.0, 0.0, 50.0)), item((900.0, 0.0, 0.3), Command.NAV_LAND)
    )
    assert landing_start(store.items) == 0
    task = MissionTask(store)
    rig.fly(task)
    assert not task.go_around(rig.ctx)

    def on_slope() -> bool:
        return isinstance(task.sub_task, LandTask) and -float(rig.nav[n.POS + 2]) < 15.0

    rig.run_until(on_slope, 120.0)
    assert task.go_around(rig.ctx)
    landing = task.sub_task
    rig.run(20.0)
    assert isinstance(landing, LandTask) and task.sub_task is landing
    assert -rig.nav[n.POS + 2] > 30.0
    rig.run_until(lambda: landing.phase is LandPhase.LANDED, 200.0)
    assert abs(rig.touch_ned_m[0] - 900.0) < 15.0


def test_endless_jump_over_nothing_and_items_without_a_place() -> None:
    mass = PointMass()
    nowhere = MissionItem(command=Command.NAV_WAYPOINT, frame=99)
    mass.fly(MissionTask(store_of(nowhere, do(Command.DO_JUMP, param1=0.0, param2=-1.0))))
    mass.run(1.0)
    assert any(isinstance(e, MissionFinished) for e in mass.ctx.events)
    assert mass.ctx.setpoint[sp.LEVEL] == sp.FLY


@pytest.mark.slow
def test_same_flight_twice_is_the_same_to_the_bit() -> None:
    def flight() -> bytes:
        environment = Environment(wind_ned_m_s=(2.0, 3.0, 0.0), turbulence="light")
        rig = Aircraft(
            height_m=80.0,
            environment=environment,
            parameters=FixedWingFlightParameters.for_envelope(AEROSONDE),
        )
        rig.fly(MissionTask(store_of(item((300.0, 200.0, 100.0)), item((0.0, 600.0, 80.0)))))
        return rig.run(40.0).tobytes()

    assert flight() == flight()
