"""Take-offs of the Aerosonde: runway, catapult, hand; calm and wind."""

import math

import numpy as np
import pytest

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import FlightPhase, LandedState, TaskFinished
from autopilot_bridge.flight.fixed_wing import (
    FixedWingFlightParameters,
    LaunchKind,
    TakeoffPhase,
    TakeoffTask,
)
from autopilot_bridge.flight.fixed_wing.climb_out_checks import LaunchDetector
from autopilot_bridge.flight.fixed_wing.state import AircraftState
from autopilot_bridge.flight.task import TaskStatus
from autopilot_bridge.navigation import layout as n
from flightsim.environment import Environment
from tests.control.fixed_wing.aerosonde import AEROSONDE
from tests.flight.fixed_wing.aircraft import Aircraft
from tests.flight.fixed_wing.kinematic import PointMass

LAUNCHES = {"runway": LaunchKind.RUNWAY, "catapult": LaunchKind.CATAPULT, "hand": LaunchKind.HAND}


def aircraft(launch: str, wind: tuple[float, float, float] = (0.0, 0.0, 0.0), **fields: float) -> Aircraft:
    parameters = FixedWingFlightParameters.for_envelope(AEROSONDE, launch=LAUNCHES[launch], **fields)
    return Aircraft(environment=Environment(wind_ned_m_s=wind), launch=launch, parameters=parameters)


@pytest.mark.parametrize("launch", list(LAUNCHES))
@pytest.mark.parametrize("wind", [(0.0, 0.0, 0.0), (-3.0, 4.0, 0.0)])
@pytest.mark.sampled(2)
def test_takes_off_and_reaches_its_height(launch: str, wind: tuple[float, float, float]) -> None:
    rig = aircraft(launch, wind)
    task = TakeoffTask(60.0)
    rig.fly(task)
    rig.run(1.0)
    assert rig.ctx.phase is FlightPhase.TAKEOFF
    if launch != "runway":
        assert task.phase is TakeoffPhase.WAIT
        assert rig.ctx.landed_state is LandedState.ON_GROUND
        assert rig.controller.setpoint[sp.LEVEL] == sp.IDLE
        rig.vehicle.launch()
    start = rig.nav[n.POS_NED_M].copy()
    rig.run_until(lambda: task.phase is TakeoffPhase.REACHED, 40.0)
    log = np.array(rig.log)
    climbed = start[2] - log[:, 12]
    straight = log[(climbed > 0.5) & (climbed < rig.parameters.takeoff_clearance_m)]
    assert np.abs(straight[:, 25]).max() < math.radians(20.0)  # wings
    assert np.abs(straight[:, 11] - start[1]).max() < 10.0  # along the runway
    low = log[(climbed > -0.02) & (climbed < 0.4)]
    assert launch != "runway" or low[:, 26].max() < math.radians(13.0)  # the tail has no more room
    flying = log[climbed > 5.0]
    assert flying[:, n.AIRSPEED_M_S].min() > 16.0
    assert rig.ctx.events == [TaskFinished("takeoff")]
    assert rig.ctx.phase is FlightPhase.CRUISE
    assert rig.ctx.landed_state is LandedState.TAKEOFF
    rig.run(5.0)
    assert rig.ctx.landed_state is LandedState.IN_AIR
    assert -rig.nav[n.POS + 2] + rig.ctx.home_ned_m[2] == pytest.approx(60.0, abs=3.0)
    assert task.update(rig.ctx) is TaskStatus.DONE


@pytest.mark.slow
def test_a_place_is_flown_to_and_circled() -> None:
    rig = aircraft("runway")
    task = TakeoffTask(50.0, np.array([600.0, 300.0, math.nan]))
    rig.fly(task)
    rig.run(60.0)
    log = rig.run(30.0)
    away = np.hypot(log[:, 10] - 600.0, log[:, 11] - 300.0)
    assert away.mean() == pytest.approx(rig.parameters.loiter_radius_m, rel=0.03)
    assert task.place_ned_m[0:2] == pytest.approx([600.0, 300.0])


def test_who_is_slow_at_the_clearance_height_climbs_on_and_does_not_dive_for_speed() -> None:
    rig = aircraft("runway", takeoff_airspeed_m_s=34.0, takeoff_clearance_m=8.0)  # far more than it has
    task = TakeoffTask(60.0, np.array([900.0, 0.0, 0.0]))
    rig.fly(task)
    start = rig.nav[n.POS_NED_M].copy()
    rig.run_until(lambda: task.phase is TakeoffPhase.CLIMB, 30.0)
    rig.run(6.0)
    log = np.array(rig.log)
    climbed = start[2] - log[:, 12]
    gained = np.maximum.accumulate(climbed)
    assert np.max(gained - climbed) < 0.3
    assert climbed[-1] > 20.0


def test_disarmed_it_does_nothing_and_armed_again_it_starts_anew() -> None:
    rig = aircraft("runway")
    task = TakeoffTask(50.0)
    rig.fly(task)
    rig.run(1.0)
    rig.ctx.armed = False
    rig.run(1.0)
    assert rig.controller.setpoint[sp.LEVEL] == sp.OFF
    rig.ctx.armed = True
    rig.step()
    assert task.phase is TakeoffPhase.ROLL
    assert rig.controller.setpoint[sp.THROTTLE] < 0.05


def test_in_the_air_it_only_climbs_and_never_sinks() -> None:
    mass = PointMass((0.0, 0.0, -100.0))
    task = TakeoffTask(50.0)
    mass.fly(task)
    mass.run(1.0)
    assert task.phase is TakeoffPhase.REACHED
    mass.run(20.0)
    assert mass.place[2] == pytest.approx(-100.0, abs=0.5)


def test_launch_needs_the_acceleration_for_its_time() -> None:
    mass = PointMass()
    mass.airspeed = 0.0
    mass.observe()
    p = mass.parameters
    detector, state = LaunchDetector(), AircraftState()

    def feel(acceleration: float, updates: int) -> bool:
        mass.ctx.nav[n.SPECIFIC_FORCE_FRD_M_S2] = (acceleration, 0.0, -9.8)
        result = False
        for _ in range(updates):
            state.read(mass.ctx)
            result = detector.update(mass.ctx, state, p)
        return result

    assert not feel(p.launch_acceleration_m_s2 - 1.0, 50)
    assert not feel(p.launch_acceleration_m_s2 + 1.0, 2)  # a bump
    assert not feel(0.0, 1)
    assert feel(p.launch_acceleration_m_s2 + 1.0, 4)
    assert feel(0.0, 1)  # for good


def test_height_must_be_a_number() -> None:
    with pytest.raises(ValueError, match="inf"):
        TakeoffTask(math.inf)


def test_without_airspeed_a_climb_rate_is_flown() -> None:
    rig = aircraft("runway")
    task = TakeoffTask(50.0)
    rig.fly(task)
    observe = rig.observe

    def blind() -> None:
        observe()
        rig.nav[n.AIRSPEED_M_S] = rig.nav[n.AIRSPEED_TRUE_M_S] = math.nan

    rig.observe = blind  # type: ignore[method-assign]
    rig.run_until(lambda: task.phase is TakeoffPhase.REACHED, 40.0)
    assert -rig.nav[n.POS + 2] > 45.0
