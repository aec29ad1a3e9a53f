"""Where a return leads: home, rally points, the landing of the plan, along the plan."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.flight.context import FlightContext, MissionFinished, TouchedDown, WaypointReached
from autopilot_bridge.flight.fixed_wing import FixedWingFlightParameters
from autopilot_bridge.flight.fixed_wing import MissionTask as AircraftMissionTask
from autopilot_bridge.flight.fixed_wing import ReturnTask as AircraftReturnTask
from autopilot_bridge.flight.multicopter import MissionTask, ReturnPhase, ReturnTask
from autopilot_bridge.flight.parameters import FlightParameters, RallyRule, ReturnDestination
from autopilot_bridge.flight.plan_reading import Command
from autopilot_bridge.flight.return_place import choose_return, plan_landing
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as n
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from tests.flight.fixed_wing.kinematic import PointMass
from tests.flight.rig import Rig, positions

PX4 = RallyRule()
COPTER = RallyRule(limit_m=300.0, within_fence=True, altitude_is_ground=False)
PLANE = RallyRule(limit_m=5000.0, home_competes=False, altitude_is_ground=False)


def rally_at(frame: LocalFrame, *points: tuple[float, float, float]) -> MissionStore:
    items = []
    for north, east, height in points:
        lat, lon, _ = frame.geodetic_from_ned(north, east, 0.0)
        items.append(MissionItem(command=mavlink.MAV_CMD_NAV_RALLY_POINT, frame=3, x=lat, y=lon, z=height))
    store = MissionStore()
    store.replace(tuple(items), 1)
    return store


def plan(*items: MissionItem) -> MissionStore:
    store = MissionStore()
    store.replace(items, 1)
    return store


def place(
    north: float,
    east: float,
    command: int = mavlink.MAV_CMD_NAV_WAYPOINT,
    height: float = 20.0,
    **params: float,
) -> MissionItem:
    return MissionItem(command=command, frame=1, x=north, y=east, z=-height, **{"param4": math.nan, **params})


def context(north: float, east: float) -> FlightContext:
    ctx = FlightContext()
    ctx.frame = LocalFrame(GeodeticPosition(lat_deg=47.4, lon_deg=8.5, alt_m=489.0))
    ctx.nav[n.POS_NED_M] = (north, east, -30.0)
    ctx.home_ned_m[:] = 0.0
    return ctx


HOME = ReturnDestination.HOME


@pytest.mark.parametrize(
    ("rule", "here", "points", "taken"),
    [
        (PX4, (100.0, 0.0), ((140.0, 0.0, 0.0),), (140.0, 0.0)),
        (PX4, (40.0, 0.0), ((140.0, 0.0, 0.0),), (0.0, 0.0)),
        (PX4, (100.0, 0.0), ((140.0, 0.0, 0.0), (100.0, 20.0, 0.0)), (100.0, 20.0)),
        (replace(PX4, used=False), (100.0, 0.0), ((101.0, 0.0, 0.0),), (0.0, 0.0)),
        (COPTER, (100.0, 0.0), ((140.0, 0.0, 25.0),), (140.0, 0.0)),
        (COPTER, (1000.0, 0.0), ((600.0, 0.0, 25.0),), (0.0, 0.0)),  # beyond RALLY_LIMIT_KM
        (PLANE, (40.0, 0.0), ((140.0, 0.0, 60.0),), (140.0, 0.0)),  # home doesn't compete
        (replace(PLANE, home_competes=True), (40.0, 0.0), ((140.0, 0.0, 60.0),), (0.0, 0.0)),
        (PLANE, (6000.0, 0.0), ((140.0, 0.0, 60.0),), (0.0, 0.0)),
    ],
)
def test_which_rally_point(rule: RallyRule, here: tuple, points: tuple, taken: tuple) -> None:
    ctx = context(*here)
    assert ctx.frame is not None
    ctx.rally = rally_at(ctx.frame, *points)
    chosen = choose_return(ctx, rule, HOME, None, None)
    assert chosen is not None
    assert chosen.ned_m[:2] == pytest.approx(taken, abs=0.1)
    assert chosen.rally is (taken != (0.0, 0.0))


def test_the_altitude_of_a_rally_point() -> None:
    """PX4 takes it for the ground there, ArduPilot for the altitude to return at."""
    ctx = context(100.0, 0.0)
    assert ctx.frame is not None
    ctx.rally = rally_at(ctx.frame, (100.0, 10.0, 45.0))
    ground = choose_return(ctx, PX4, HOME, None, None)
    assert ground is not None and ground.ned_m[2] == pytest.approx(-45.0, abs=0.1)
    above = choose_return(ctx, COPTER, HOME, None, None)
    assert above is not None and above.ned_m[2] == 0.0
    assert above.altitude_down_m == pytest.approx(-45.0, abs=0.1)


def test_rally_points_outside_the_fence_are_not_taken() -> None:
    ctx = context(100.0, 0.0)
    assert ctx.frame is not None
    ctx.rally = rally_at(ctx.frame, (110.0, 0.0, 20.0), (60.0, 0.0, 20.0))
    ctx.within_fence = lambda place: bool(place[0] < 100.0)
    chosen = choose_return(ctx, COPTER, HOME, None, None)
    assert chosen is not None and chosen.ned_m[0] == pytest.approx(60.0, abs=0.1)


def test_without_a_home_there_is_nowhere_to_go() -> None:
    ctx = context(0.0, 0.0)
    ctx.home_ned_m[:] = math.nan
    assert choose_return(ctx, PX4, HOME, None, None) is None


@pytest.mark.parametrize(
    ("destination", "here", "landing"),
    [
        (ReturnDestination.LANDING_OR_RALLY, 0.0, True),  # right over home, too
        (ReturnDestination.LANDING_OR_RALLY, 480.0, False),  # a rally point is closer
        (ReturnDestination.CLOSEST, 10.0, False),
        (ReturnDestination.CLOSEST, 320.0, True),
        (ReturnDestination.LANDING_SEQUENCE, 480.0, True),
    ],
)
def test_landing_or_rally(destination: ReturnDestination, here: float, landing: bool) -> None:
    ctx = context(here, 0.0)
    assert ctx.frame is not None
    ctx.rally = rally_at(ctx.frame, (500.0, 0.0, 0.0))
    store = plan(
        place(200.0, 50.0),
        MissionItem(command=mavlink.MAV_CMD_DO_LAND_START, frame=2),
        place(250.0, 0.0),
        place(300.0, 0.0, 21),
    )
    chosen = choose_return(ctx, PX4, destination, plan_landing(store), store)
    assert chosen is not None
    assert (chosen.landing == 1) is landing


# multicopter


def px4_returns(**fields: object) -> FlightParameters:
    return FlightParameters(return_altitude_m=12.0, return_descend_altitude_m=6.0, **fields)


def fly_home(rig: Rig, task: ReturnTask, limit_s: float = 90.0) -> np.ndarray:
    rig.fly(task)
    logs = []
    for _ in range(round(limit_s)):
        logs.append(rig.run(1.0))
        if rig.ctx.on_ground:
            break
    return positions(np.concatenate(logs))


def test_a_copter_lands_at_the_nearest_rally_point() -> None:
    rig = Rig(height_m=8.0, parameters=px4_returns())
    rig.ctx.home_ned_m[:] = (-60.0, 0.0, 0.0)
    rig.ctx.rally = rally_at(rig.frame, (15.0, 10.0, 0.0), (-30.0, 60.0, 0.0))
    track = fly_home(rig, ReturnTask())
    assert rig.ctx.on_ground
    assert np.linalg.norm(track[-1][:2] - [15.0, 10.0]) < 0.6
    assert -track[:, 2].min() == pytest.approx(12.0, abs=0.6)


def test_an_arducopter_climbs_to_its_rally_points_altitude_but_not_over_the_fence() -> None:
    heights = []
    for limit_m in (math.inf, 22.0):
        parameters = FlightParameters(
            return_altitude_m=15.0, return_loiters_high=True, rally=COPTER, return_height_max_m=limit_m
        )
        rig = Rig(height_m=8.0, parameters=parameters)
        rig.ctx.rally = rally_at(rig.frame, (12.0, 0.0, 26.0))
        rig.ctx.home_ned_m[:] = (-40.0, 0.0, 0.0)
        heights.append(-fly_home(rig, ReturnTask(), 30.0)[:, 2].min())
    assert heights == pytest.approx([26.0, 22.0], abs=0.6)


def test_rtl_alt_final_stays_in_the_air() -> None:
    parameters = FlightParameters(return_altitude_m=12.0, return_loiters_high=True, return_stays_at_m=5.0)
    rig = Rig(height_m=8.0, parameters=parameters)
    task = ReturnTask()
    fly_home(rig, task, 35.0)
    assert task.phase is ReturnPhase.STAY
    assert -float(rig.nav[n.POS_NED_M][2]) == pytest.approx(5.0, abs=0.3)


def test_a_copter_lands_by_its_plan() -> None:
    rig = Rig(height_m=8.0, parameters=px4_returns(return_destination=ReturnDestination.LANDING_OR_RALLY))
    store = plan(
        place(80.0, 0.0),
        MissionItem(command=mavlink.MAV_CMD_DO_LAND_START, frame=2),
        place(15.0, 15.0, height=10.0),
        place(0.0, 15.0, Command.NAV_LAND, 0.0),
    )
    track = fly_home(rig, ReturnTask(store, plan_task=MissionTask))
    assert rig.ctx.on_ground
    assert np.linalg.norm(track[-1][:2] - [0.0, 15.0]) < 0.6
    assert np.linalg.norm(track[:, :2] - [15.0, 15.0], axis=1).min() < 2.0
    assert track[:, 0].max() < 20.0  # the waypoint before the landing sequence isn't flown


def long_plan(landing: bool) -> MissionStore:
    return plan(
        place(10.0, 0.0),
        place(20.0, 10.0),
        place(30.0, 0.0, param1=30.0),
        place(40.0, 10.0, Command.NAV_LOITER_TIME, param1=30.0),
        *((place(50.0, 0.0, Command.NAV_LAND, 0.0),) if landing else ()),
    )


@pytest.mark.parametrize(
    ("destination", "landing", "current", "ends", "passes"),
    [
        (ReturnDestination.ALONG_PLAN, True, 2, (50.0, 0.0), (30.0, 0.0)),
        (ReturnDestination.ALONG_PLAN, False, 3, (0.0, 0.0), (20.0, 10.0)),
        (ReturnDestination.ALONG_PLAN_SHORTER, True, 1, (0.0, 0.0), (10.0, 0.0)),
        (ReturnDestination.ALONG_PLAN_SHORTER, True, 3, (50.0, 0.0), (40.0, 10.0)),
    ],
)
@pytest.mark.sampled(1)
def test_a_return_along_the_plan(
    destination: ReturnDestination, landing: bool, current: int, ends: tuple, passes: tuple
) -> None:
    """RTL_TYPE 2 and 4: forward to the landing without waiting on the way, or back to home."""
    rig = Rig(height_m=12.0, parameters=px4_returns(return_destination=destination))
    store = long_plan(landing)
    store.current = current
    track = fly_home(rig, ReturnTask(store, plan_task=MissionTask))
    assert rig.ctx.on_ground
    assert np.linalg.norm(track[-1][:2] - ends) < 0.7
    assert np.linalg.norm(track[:, :2] - passes, axis=1).min() < 2.1
    if ends == (0.0, 0.0):  # a plan of its own: no event reports its items
        reported = [e for e in rig.ctx.events if isinstance(e, WaypointReached | MissionFinished)]
        assert not reported
        assert store.current == current


# aircraft


def height_at_rally(
    parameters: FixedWingFlightParameters, *, start_height_m: float, rally_height_m: float, after_s: float
) -> float:
    """Return to a rally point 600 m north of home; the height over home of the circle flown there."""
    mass = PointMass((900.0, 400.0, -start_height_m), parameters=parameters)
    assert mass.ctx.frame is not None
    mass.ctx.rally = rally_at(mass.ctx.frame, (600.0, 0.0, rally_height_m))
    mass.fly(AircraftReturnTask())
    mass.run(after_s)
    log = mass.run(30.0)
    assert np.hypot(log[:, 0] - 600.0, log[:, 1]).mean() == pytest.approx(80.0, rel=0.06)
    return -float(log[-1, 2])


def test_an_aircraft_circles_at_its_rally_point() -> None:
    parameters = FixedWingFlightParameters(rally=PLANE, return_climbs=False, return_altitude_m=100.0)
    height_m = height_at_rally(parameters, start_height_m=80.0, rally_height_m=140.0, after_s=90.0)
    assert height_m == pytest.approx(140.0, abs=2.0)


def test_a_px4_aircraft_takes_the_rally_points_ground() -> None:
    parameters = FixedWingFlightParameters(
        return_altitude_m=100.0, return_descend_altitude_m=70.0, return_destination=ReturnDestination.HOME
    )
    height_m = height_at_rally(parameters, start_height_m=120.0, rally_height_m=50.0, after_s=150.0)
    assert height_m == pytest.approx(120.0, abs=2.0)  # 70 m over 50 m


def test_an_aircraft_goes_back_along_its_plan() -> None:
    parameters = FixedWingFlightParameters(return_destination=ReturnDestination.ALONG_PLAN)
    mass = PointMass((900.0, 0.0, -100.0), parameters=parameters)
    store = plan(
        place(300.0, 300.0, height=100.0), place(600.0, 300.0, height=100.0), place(1500.0, 0.0, height=100.0)
    )
    store.current = 2
    mass.fly(AircraftReturnTask(store, plan_task=AircraftMissionTask))
    log = mass.run(70.0)
    for north in (600.0, 300.0):
        assert np.hypot(log[:, 0] - north, log[:, 1] - 300.0).min() < 25.0
    assert store.current == 2
    assert TouchedDown() not in mass.ctx.events
