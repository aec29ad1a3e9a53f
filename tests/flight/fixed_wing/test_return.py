"""Returns: PX4's and ArduPlane's, by their parameters."""

import math
from dataclasses import replace

import numpy as np
import pytest

from autopilot_bridge.flight.context import ReturnStarted, TouchedDown
from autopilot_bridge.flight.fixed_wing import (
    FixedWingFlightParameters,
    MissionTask,
    ReturnDestination,
    ReturnPhase,
    ReturnTask,
)
from autopilot_bridge.flight.fixed_wing.return_home import return_height
from autopilot_bridge.flight.plan_reading import Command
from autopilot_bridge.flight.task import SpeedKind
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from tests.flight.fixed_wing.aircraft import Aircraft
from tests.flight.fixed_wing.kinematic import PointMass

PX4 = FixedWingFlightParameters(return_altitude_m=150.0, return_descend_altitude_m=80.0)
ARDUPILOT = FixedWingFlightParameters(
    return_altitude_m=100.0, return_climbs=False, return_loiter_radius_m=-90.0, acceptance_altitude_m=math.inf
)


def landing_plan() -> MissionStore:
    store = MissionStore()
    store.replace(
        (
            MissionItem(command=Command.NAV_WAYPOINT, frame=1, x=5000.0, y=0.0, z=-100.0),
            MissionItem(command=Command.DO_LAND_START, frame=2),
            MissionItem(command=Command.NAV_WAYPOINT, frame=1, x=-600.0, y=300.0, z=-50.0),
            MissionItem(command=Command.NAV_LAND, frame=1, x=0.0, y=300.0, z=-0.3),
        ),
        1,
    )
    return store


def test_px4_climbs_where_it_is_flies_home_and_circles_down() -> None:
    mass = PointMass((900.0, 400.0, -100.0), 1.0, (3.0, 3.0), PX4)
    task = ReturnTask()
    mass.fly(task)
    mass.run(5.0)
    assert task.phase is ReturnPhase.CLIMB
    assert math.hypot(mass.place[0] - 900.0, mass.place[1] - 400.0) < 250.0
    while task.phase is ReturnPhase.CLIMB:
        mass.run(0.5)
    assert -mass.place[2] > 139.0
    while task.phase is ReturnPhase.FLY:
        log = mass.run(0.5)
        assert log[-1, 2] < -138.0
    assert np.hypot(mass.place[0], mass.place[1]) < 110.0
    mass.run(60.0)
    assert task.phase is ReturnPhase.LOITER
    log = mass.run(60.0)
    assert -log[-1, 2] == pytest.approx(80.0, abs=1.0)
    assert np.hypot(log[:, 0], log[:, 1]).mean() == pytest.approx(80.0, rel=0.03)
    assert mass.ctx.events == [ReturnStarted(-150.0, 0.0)]  # circles on for ever


def test_arduplane_circles_home_at_its_altitude_the_other_way_round() -> None:
    mass = PointMass((900.0, 400.0, -180.0), 1.0, (0.0, 0.0), ARDUPILOT)
    task = ReturnTask()
    mass.fly(task)
    mass.run(90.0)
    log = mass.run(40.0)
    assert -log[-1, 2] == pytest.approx(100.0, abs=1.0)
    assert np.hypot(log[:, 0], log[:, 1]).mean() == pytest.approx(90.0, rel=0.03)
    angle = np.unwrap(np.arctan2(log[:, 1], log[:, 0]))
    assert angle[-1] < angle[0]
    task.change_speed(mass.ctx, SpeedKind.AIRSPEED, 30.0)
    mass.run(10.0)
    assert mass.airspeed == pytest.approx(30.0, abs=0.3)


def test_arduplane_returns_at_its_present_height_with_a_negative_altitude() -> None:
    """RTL_ALTITUDE -1."""
    parameters = replace(
        ARDUPILOT,
        return_altitude_m=5.0,
        return_climbs=True,
        return_climb_min_m=0.0,
        return_descend_altitude_m=math.inf,
    )
    mass = PointMass((900.0, 400.0, -130.0), 1.0, (0.0, 0.0), parameters)
    mass.fly(ReturnTask())
    log = mass.run(130.0)
    assert np.hypot(*log[-1, :2]) == pytest.approx(90.0, rel=0.05)
    assert -log[:, 2] == pytest.approx(130.0, abs=1.0)


def test_arduplane_glides_down_on_its_way_home() -> None:
    """Higher than GLIDE_SLOPE_MIN above the return altitude it loses the height over the whole way."""
    parameters = replace(ARDUPILOT, glide_slope_min_m=15.0)
    mass = PointMass((1200.0, 0.0, -130.0), math.pi, (0.0, 0.0), parameters)
    mass.fly(ReturnTask())
    halfway = mass.run(30.0)
    middle = halfway[np.argmin(np.abs(halfway[:, 0] - 600.0))]
    assert -middle[2] == pytest.approx(115.0, abs=3.0)
    mass.run(60.0)
    assert -mass.place[2] == pytest.approx(100.0, abs=1.0)


def test_arduplane_dives_the_last_few_metres_at_once() -> None:
    parameters = replace(ARDUPILOT, glide_slope_min_m=15.0)
    mass = PointMass((1200.0, 0.0, -112.0), math.pi, (0.0, 0.0), parameters)
    mass.fly(ReturnTask())
    mass.run(15.0)
    assert mass.place[0] > 700.0
    assert -mass.place[2] == pytest.approx(100.0, abs=1.0)


@pytest.mark.parametrize(
    "destination", [ReturnDestination.LANDING_SEQUENCE, ReturnDestination.HOME_THEN_LANDING_SEQUENCE]
)
def test_the_landing_sequence_of_the_plan_is_flown(destination: ReturnDestination) -> None:
    parameters = FixedWingFlightParameters(return_destination=destination, return_altitude_m=60.0)
    mass = PointMass((900.0, 400.0, -100.0), 3.0, parameters=parameters)
    store = landing_plan()
    task = ReturnTask(store, plan_task=MissionTask)
    mass.fly(task)
    if destination is ReturnDestination.HOME_THEN_LANDING_SEQUENCE:
        assert task.phase is ReturnPhase.FLY
        while task.phase is ReturnPhase.FLY:
            mass.run(0.5)
        assert math.hypot(mass.place[0], mass.place[1]) < 110.0
    assert task.phase is ReturnPhase.LAND
    assert isinstance(task.sub_task, MissionTask)
    assert store.current >= 1
    while store.current < 3:
        mass.run(0.5)
        assert len(mass.log) < 50 * 200
    assert isinstance(task.sub_task, MissionTask) and task.sub_task.landing
    assert task.go_around(mass.ctx)


def test_without_a_sequence_home_is_the_destination() -> None:
    parameters = FixedWingFlightParameters(return_destination=ReturnDestination.LANDING_SEQUENCE)
    mass = PointMass((900.0, 400.0, -100.0), parameters=parameters)
    task = ReturnTask(MissionStore(), plan_task=MissionTask)
    mass.fly(task)
    assert task.phase is ReturnPhase.FLY
    assert not task.go_around(mass.ctx)


def test_without_a_home_it_circles_where_it_is() -> None:
    mass = PointMass((900.0, 400.0, -100.0))
    mass.ctx.home_ned_m[:] = math.nan
    mass.fly(ReturnTask())
    log = mass.run(60.0)
    assert np.hypot(log[-1000:, 0] - 900.0, log[-1000:, 1] - 400.0).mean() == pytest.approx(80.0, rel=0.05)


@pytest.mark.slow
def test_after_its_loiter_time_it_lands() -> None:
    rig = Aircraft(height_m=60.0)
    rig.ctx.home_ned_m[2] = -0.3
    rig.ctx.parameters = replace(rig.parameters, return_loiter_time_s=5.0, return_altitude_m=60.0)
    task = ReturnTask()
    rig.fly(task)
    rig.run_until(lambda: TouchedDown() in rig.ctx.events, 300.0)
    assert rig.ctx.on_ground
    assert abs(rig.touch_ned_m[0]) < 15.0 and abs(rig.touch_ned_m[1]) < 3.0


def test_height_to_fly_home_at() -> None:
    p = FixedWingFlightParameters(return_altitude_m=100.0, return_descend_altitude_m=40.0)
    assert return_height(50.0, p) == 100.0
    assert return_height(130.0, p) == 130.0
    assert return_height(130.0, ARDUPILOT) == 100.0
