"""Tasks that start, or go on, without a position or a height."""

import math

import numpy as np
import pytest

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.fixed_wing import (
    DescendTask,
    GuidedTask,
    LandTask,
    LoiterTask,
    ManualMode,
    ManualTask,
    MissionTask,
    OffboardTask,
    ReturnTask,
    TakeoffTask,
)
from autopilot_bridge.flight.plan_reading import Command
from autopilot_bridge.flight.task import FlightTask
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as n
from tests.flight.fixed_wing.kinematic import PointMass


def mission() -> MissionTask:
    store = MissionStore()
    store.replace((MissionItem(command=Command.NAV_WAYPOINT, frame=1, x=900.0, y=0.0, z=-100.0),), 1)
    return MissionTask(store)


TASKS = {
    "loiter": LoiterTask,
    "takeoff": TakeoffTask,
    "land": LandTask,
    "return": ReturnTask,
    "mission": mission,
    "manual": lambda: ManualTask(ManualMode.CRUISE),
    "offboard": OffboardTask,
    "guided": GuidedTask,
    "descend": DescendTask,
}


def without_position(mass: PointMass, known: bool) -> None:
    health = mass.ctx.health
    assert health is not None
    health.position_horizontal_relative = health.position_horizontal_absolute = known


@pytest.mark.parametrize("name", list(TASKS))
def test_no_position_from_the_start(name: str) -> None:
    mass = PointMass()
    task: FlightTask = TASKS[name]()  # type: ignore[operator]
    without_position(mass, known=False)
    observe = mass.observe

    def lost() -> None:
        observe()
        mass.ctx.nav[n.POS_NED_M][0:2] = math.nan
        mass.ctx.nav[n.WIND_NED_M_S] = math.nan

    mass.observe = lost  # type: ignore[method-assign]
    mass.observe()
    mass.fly(task)
    log = mass.run(10.0)
    s = mass.ctx.setpoint
    assert s[sp.LEVEL] == sp.FLY
    assert math.isfinite(s[sp.ROLL_RAD]) or math.isfinite(s[sp.HEADING_RAD])
    assert np.abs(log[:, 3]).max() < math.radians(20.0)
    assert np.isfinite(log).all()
    # and found again
    mass.observe = observe  # type: ignore[method-assign]
    mass.observe()
    without_position(mass, known=True)
    mass.run(2.0)
    s = mass.ctx.setpoint
    given = np.isfinite(s[[sp.ROLL_RAD, sp.HEADING_RAD, sp.COURSE_RAD]])
    assert given.any()


@pytest.mark.parametrize("name", list(TASKS))
def test_no_height_flies_the_trim(name: str) -> None:
    mass = PointMass()
    health = mass.ctx.health
    assert health is not None
    health.position_vertical_absolute = False
    mass.fly(TASKS[name]())  # type: ignore[operator]
    mass.run(1.0)
    s = mass.ctx.setpoint
    assert math.isnan(s[sp.DOWN_M]) and math.isnan(s[sp.HEIGHT_RATE_M_S])
    assert s[sp.PITCH_RAD] == pytest.approx(mass.parameters.trim_pitch_rad)
    assert s[sp.THROTTLE] == pytest.approx(mass.parameters.trim_throttle)


def test_after_a_while_without_a_position_it_sinks() -> None:
    mass = PointMass()
    mass.fly(LoiterTask())
    without_position(mass, known=False)
    mass.run(mass.parameters.position_lost_wait_s - 1.0)
    assert mass.climb == pytest.approx(0.0, abs=0.01)
    mass.run(6.0)
    assert mass.climb == pytest.approx(-mass.parameters.position_lost_sink_m_s, abs=0.02)


@pytest.mark.parametrize("name", list(TASKS))
def test_disarmed_everything_is_off(name: str) -> None:
    mass = PointMass()
    mass.ctx.armed = False
    mass.fly(TASKS[name]())  # type: ignore[operator]
    mass.run(0.1)
    assert mass.ctx.setpoint[sp.LEVEL] == sp.OFF
