"""Landings of the Aerosonde: along a leg, against the wind, go-around, without a position."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import FlightPhase, LandedState, TouchedDown
from autopilot_bridge.flight.fixed_wing import DescendTask, FixedWingFlightParameters, LandPhase, LandTask
from autopilot_bridge.flight.fixed_wing.approach import approach_along_leg
from autopilot_bridge.flight.fixed_wing.flare import flare_airspeed, flare_height, flare_time, power
from autopilot_bridge.flight.fixed_wing.state import AircraftState
from autopilot_bridge.flight.task import TaskStatus
from autopilot_bridge.navigation import layout as n
from flightsim.environment import Environment
from flightsim.foundation.geodesy import LocalFrame
from flightsim.wind_profile import SURFACE_LAYER
from tests.control.fixed_wing.aerosonde import AEROSONDE
from tests.flight.fixed_wing.aircraft import Aircraft

REST_M = 0.3  # height of the centre of gravity, standing


def flying(
    wind: tuple[float, float], height_m: float = 50.0, yaw_rad: float = 0.0, seed: int = 1
) -> Aircraft:
    environment = Environment(wind_ned_m_s=(*wind, 0.0))
    rig = Aircraft(environment=environment, height_m=height_m, yaw_rad=yaw_rad, seed=seed)
    rig.ctx.home_ned_m[2] = -REST_M
    return rig


def flaring(wind: tuple[float, float], *, rangefinder: bool = False) -> tuple[Aircraft, LandTask]:
    """An aircraft that has come down along a leg, and its landing."""
    rig = flying(wind)
    rig.rangefinder = rangefinder
    task = LandTask(np.array([600.0, 0.0, -REST_M]), np.array([0.0, 0.0, -50.3]))
    rig.fly(task)
    rig.run_until(lambda: task.phase is LandPhase.FLARE, 60.0)
    return rig, task


def land(rig: Aircraft, task: LandTask) -> tuple[float, float]:
    """Fly the landing; (along, right) of the place where the wheels first touched."""
    rig.fly(task)
    return finish(rig, task)


def finish(rig: Aircraft, task: LandTask) -> tuple[float, float]:
    """Fly on until it is landed; as `land`."""
    rig.run_until(lambda: task.phase is LandPhase.LANDED, 250.0)
    approach = task.approach
    assert approach is not None
    north = rig.touch_ned_m[0] - approach.north_m
    east = rig.touch_ned_m[1] - approach.east_m
    c, s = math.cos(approach.course_rad), math.sin(approach.course_rad)
    return north * c + east * s, east * c - north * s


@pytest.mark.parametrize("wind", [(0.0, 0.0), (-6.0, 0.0), (0.0, 5.0), (-4.0, -4.0), (3.0, 0.0)])
@pytest.mark.parametrize("rangefinder", [False, True])
@pytest.mark.sampled(1)
def test_lands_on_the_place_along_a_leg(wind: tuple[float, float], rangefinder: bool) -> None:
    rig = flying(wind)
    rig.rangefinder = rangefinder
    task = LandTask(np.array([600.0, 0.0, -REST_M]), np.array([0.0, 0.0, -50.3]))
    along, right = land(rig, task)
    assert abs(along) < 15.0
    assert abs(right) < 3.0
    assert rig.touch_sink_m_s < 1.2
    assert rig.ctx.events == [TouchedDown()]
    assert rig.ctx.phase is FlightPhase.CRUISE
    assert rig.ctx.landed_state is LandedState.ON_GROUND
    rig.run(1.0)
    assert rig.controller.setpoint[sp.LEVEL] == sp.IDLE
    assert task.update(rig.ctx) is TaskStatus.DONE


@pytest.mark.slow
def test_turbulence_leaves_it_on_the_runway() -> None:
    touches = []
    for seed in (1, 2, 3):
        environment = Environment(wind_ned_m_s=(-6.0, 0.0, 0.0), turbulence="moderate")
        rig = Aircraft(environment=environment, height_m=50.0, seed=seed)
        touches.append(land(rig, LandTask(np.array([600.0, 0.0, -REST_M]), np.array([0.0, 0.0, -50.3]))))
        assert rig.touch_sink_m_s < 2.0
    assert np.abs(np.array(touches)).max() < 20.0


@pytest.mark.parametrize("wind", [(0.0, 0.0), (5.0, 3.0)])
@pytest.mark.parametrize("radius", [120.0, -120.0])
@pytest.mark.slow
def test_without_a_leg_it_circles_down_and_lands_against_the_wind(
    wind: tuple[float, float], radius: float
) -> None:
    rig = flying(wind, height_m=110.0, yaw_rad=2.0)
    rig.ctx.parameters = replace(rig.parameters, loiter_radius_m=radius)
    task = LandTask()
    along, right = land(rig, task)
    assert task.approach is not None
    expected = math.atan2(-wind[1], -wind[0]) if any(wind) else rig.ctx.home_yaw_rad
    assert math.remainder(task.approach.course_rad - expected, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert abs(along) < 16.0
    assert abs(right) < 3.0
    assert rig.touch_sink_m_s < 1.2


@pytest.mark.slow
def test_go_around_climbs_comes_back_and_lands() -> None:
    rig, task = flaring((-3.0, 2.0))
    lowest = -rig.nav[n.POS + 2]
    assert task.go_around(rig.ctx)
    log = rig.run(5.0)
    assert log[:, 12].max() < -0.5 * lowest  # it doesn't touch
    assert -rig.nav[n.POS + 2] > 15.0
    assert abs(rig.nav[n.POS + 1]) < 5.0  # straight on
    along, right = finish(rig, task)
    assert abs(along) < 15.0 and abs(right) < 3.0


def test_go_around_is_refused_on_the_ground_and_on_the_way() -> None:
    rig = flying((0.0, 0.0), height_m=110.0)
    task = LandTask()
    rig.fly(task)
    rig.run(1.0)
    assert task.phase is LandPhase.CIRCLE
    assert not task.go_around(rig.ctx)


@pytest.mark.slow
def test_far_from_the_leg_it_circles_to_its_entry_first() -> None:
    rig = flying((0.0, 3.0), yaw_rad=1.0)
    task = LandTask(np.array([1500.0, 800.0, -REST_M]), np.array([900.0, 800.0, -50.3]))
    rig.fly(task)
    assert task.phase is LandPhase.CIRCLE
    along, right = land(rig, task)
    assert abs(along) < 15.0 and abs(right) < 3.0


@pytest.mark.slow
def test_beside_the_runway_on_short_final_it_goes_around() -> None:
    rig = flying((0.0, 0.0))
    task = LandTask(np.array([600.0, 0.0, -REST_M]), np.array([0.0, 0.0, -50.3]))
    rig.fly(task)
    rig.run_until(lambda: -rig.nav[n.POS + 2] < 11.0, 60.0)
    origin = rig.frame.origin  # GPS finds itself aside
    rig.frame = LocalFrame(replace(origin, lon_deg=origin.lon_deg + 30.0 / 75_000.0))
    rig.run(0.2)
    assert task.phase is LandPhase.GO_AROUND
    along, right = finish(rig, task)
    assert abs(along) < 15.0 and abs(right) < 3.0


def _in_the_flare(known_m_s: float) -> float:
    return power(known_m_s, 20.0, FixedWingFlightParameters())


def test_throttle_holds_the_airspeed_that_can_be_counted_on() -> None:
    steady = _in_the_flare(20.0)
    assert 0.0 < steady < _in_the_flare(18.0) <= 1.0
    assert _in_the_flare(25.0) == 0.0
    assert _in_the_flare(math.nan) == 0.0


def test_the_flare_gives_up_less_airspeed_against_the_wind() -> None:
    p = FixedWingFlightParameters()
    still = flare_airspeed(0.0, p)
    assert 0.9 * p.landing_airspeed_m_s < still < p.landing_airspeed_m_s
    assert flare_airspeed(-5.0, p) == still < flare_airspeed(2.0, p) < flare_airspeed(4.0, p)
    assert flare_airspeed(20.0, p) == p.landing_airspeed_m_s


@pytest.mark.parametrize("wind_m_s", [-6.0, 6.0])
@pytest.mark.slow
def test_airspeed_is_held_in_a_wind_that_fades(wind_m_s: float) -> None:
    """The navigation state here has the wind of 10 m at all heights, as a filter that takes its time has."""
    rig = Aircraft(
        environment=Environment(wind_ned_m_s=(wind_m_s, 0.0, 0.0), profile=SURFACE_LAYER),
        height_m=50.0,
        seed=1,
    )
    rig.ctx.home_ned_m[2] = -REST_M
    rig.rangefinder = True
    task = LandTask(np.array([600.0, 0.0, -REST_M]), np.array([0.0, 0.0, -50.3]))
    rig.fly(task)
    airspeeds = []

    def touched() -> bool:
        if task.phase is LandPhase.FLARE:
            airspeeds.append(float(rig.nav[n.AIRSPEED_M_S]))
        return task.phase is LandPhase.ROLL_OUT

    rig.run_until(touched, 90.0)
    along, _ = finish(rig, task)
    wanted = rig.parameters.landing_airspeed_m_s
    assert 0.88 * wanted < airspeeds[-1] < 1.0 * wanted, (airspeeds[-1], wanted)
    assert abs(along) < 5.0 and rig.touch_sink_m_s < 1.0


def test_the_airspeed_that_lasts_is_the_one_in_the_wind_as_estimated() -> None:
    rig = flying((-6.0, 0.0))
    state = AircraftState()
    state.read(rig.ctx)
    nav = rig.ctx.nav
    assert state.lasting_airspeed_m_s == pytest.approx(
        state.true_airspeed_m_s * nav[n.AIRSPEED_M_S] / nav[n.AIRSPEED_TRUE_M_S]
    )
    nav[n.AIRSPEED_M_S] *= 1.2  # a gust
    nav[n.AIRSPEED_TRUE_M_S] *= 1.2
    before = state.lasting_airspeed_m_s
    state.read(rig.ctx)
    assert state.lasting_airspeed_m_s == pytest.approx(before)
    nav[n.WIND_NED_M_S] = math.nan
    state.read(rig.ctx)
    assert math.isnan(state.lasting_airspeed_m_s)


def _carried_on(rig: Aircraft, along_m: float) -> None:
    """GPS finds itself farther along the runway."""
    origin = rig.frame.origin
    rig.frame = LocalFrame(replace(origin, lat_deg=origin.lat_deg - along_m / 111_195.0))


@pytest.mark.slow
def test_carried_too_far_in_the_flare_it_goes_around_three_times_and_then_comes_down() -> None:
    rig = flying((-3.0, 0.0))
    task = LandTask(np.array([600.0, 0.0, -REST_M]), np.array([0.0, 0.0, -50.3]))
    rig.fly(task)
    for _ in range(3):
        rig.run_until(lambda: task.phase is LandPhase.FLARE, 200.0)
        _carried_on(rig, 60.0)
        rig.run_until(lambda: task.phase is not LandPhase.FLARE, 3.0)
        assert task.phase is LandPhase.GO_AROUND
        lowest = -rig.nav[n.POS + 2]
        log = rig.run(5.0)
        assert log[:, 12].max() < -0.5 * lowest  # it doesn't touch
    rig.run_until(lambda: task.phase is LandPhase.FLARE, 200.0)
    _carried_on(rig, 60.0)
    rig.run_until(lambda: task.phase is not LandPhase.FLARE, 10.0)
    assert task.phase is LandPhase.ROLL_OUT


def test_a_glider_comes_down_wherever_the_flare_carries_it() -> None:
    rig = flying((-3.0, 0.0))
    rig.ctx.parameters = replace(rig.parameters, trim_throttle=0.0)
    task = LandTask(np.array([600.0, 0.0, -REST_M]), np.array([0.0, 0.0, -50.3]))
    rig.fly(task)
    rig.run_until(lambda: task.phase is LandPhase.FLARE, 60.0)
    _carried_on(rig, 60.0)
    rig.run_until(lambda: task.phase is not LandPhase.FLARE, 10.0)
    assert task.phase is LandPhase.ROLL_OUT


@pytest.mark.parametrize("requested", [False, True])
@pytest.mark.sampled(1)
def test_a_go_around_without_power_comes_down_straight_ahead(requested: bool) -> None:
    rig, task = flaring((-3.0, 0.0), rangefinder=True)
    rig.vehicle.set_motor_effectiveness(0, 0.0)
    if requested:
        assert task.go_around(rig.ctx)
    else:
        _carried_on(rig, 60.0)
        rig.run_until(lambda: task.phase is not LandPhase.FLARE, 3.0)
    assert task.phase is LandPhase.GO_AROUND
    rig.run_until(lambda: task.phase is not LandPhase.GO_AROUND, 3.0)
    assert task.phase is LandPhase.FLARE
    assert rig.ctx.phase is FlightPhase.LANDING
    _, right = finish(rig, task)
    assert abs(right) < 3.0
    assert rig.touch_sink_m_s < 2.0


def test_a_go_around_in_a_downdraught_keeps_climbing() -> None:
    rig, task = flaring((-3.0, 0.0))
    assert task.go_around(rig.ctx)
    rig.vehicle.set_wind((-3.0, 0.0, 1.5))
    rig.run(4.0)
    assert task.phase is LandPhase.GO_AROUND


def test_lifted_again_after_the_touch_it_flares_once_more() -> None:
    rig = flying((-4.0, 0.0))
    rig.rangefinder = True
    task = LandTask(np.array([600.0, 0.0, -REST_M]), np.array([0.0, 0.0, -50.3]))
    rig.fly(task)
    rig.run_until(lambda: task.phase is LandPhase.ROLL_OUT, 60.0)
    rig.nav[n.HEIGHT_ABOVE_GROUND_M] = REST_M + 0.5
    task.update(rig.ctx)
    assert task.phase is LandPhase.FLARE
    assert rig.controller.setpoint[sp.HEIGHT_RATE_M_S] < 0.0
    rig.run_until(lambda: task.phase is LandPhase.LANDED, 60.0)


def test_other_aircraft_stand_higher_and_hold_their_own_pitch_in_the_flare() -> None:
    small = FixedWingFlightParameters.for_envelope(AEROSONDE)
    assert small.standing_height_m == AEROSONDE.standing_height_m
    assert small.flare_pitch_min_rad == pytest.approx(math.radians(1.0))
    level = replace(AEROSONDE, standing_height_m=1.3, trim_pitch_rad=0.0, short_period_frequency_rad_s=5.0)
    other = FixedWingFlightParameters.for_envelope(level)
    assert other.standing_height_m == 1.3
    assert other.flare_pitch_min_rad < 0.0  # else it would float until it is slow
    assert other.pitch_time_constant_s > small.pitch_time_constant_s


def test_position_lost_on_short_final_it_goes_straight_on() -> None:
    rig = flying((0.0, 0.0))
    task = LandTask(np.array([600.0, 0.0, -REST_M]), np.array([0.0, 0.0, -50.3]))
    rig.fly(task)
    rig.run_until(lambda: -rig.nav[n.POS + 2] < 12.0, 60.0)
    assert rig.ctx.health is not None
    rig.ctx.health.position_horizontal_relative = rig.ctx.health.position_horizontal_absolute = False
    rig.run_until(lambda: task.phase is LandPhase.LANDED, 60.0)
    assert rig.touch_sink_m_s < 1.5
    assert abs(rig.touch_ned_m[1]) < 5.0


def test_position_lost_high_up_it_descends_and_takes_the_approach_up_again() -> None:
    rig = flying((0.0, 0.0), height_m=110.0)
    task = LandTask()
    rig.fly(task)
    rig.run(2.0)
    health = rig.ctx.health
    assert health is not None
    health.position_horizontal_relative = health.position_horizontal_absolute = False
    rig.run(10.0)
    assert task.phase is LandPhase.BLIND
    assert 97.0 > -rig.nav[n.POS + 2] > 80.0
    health.position_horizontal_relative = health.position_horizontal_absolute = True
    rig.run(1.0)
    assert task.phase is LandPhase.CIRCLE


@pytest.mark.slow
def test_descend_spirals_down_and_touches_level() -> None:
    rig = flying((2.0, 0.0), height_m=60.0)
    task = DescendTask()
    rig.fly(task)
    log = rig.run(20.0)
    assert np.degrees(log[-200:, 25]).mean() == pytest.approx(15.0, abs=2.0)
    rig.run_until(lambda: rig.ctx.on_ground, 120.0)
    assert rig.touch_sink_m_s < 1.5
    assert rig.ctx.events == [TouchedDown()]


@given(st.floats(0.5, 10.0), st.floats(0.3, 0.8), st.floats(0.81, 3.0), st.floats(0.01, 0.99))
def test_flare_time_and_height_are_inverse(start: float, after: float, before: float, share: float) -> None:
    time = flare_time(share * start, start, before, after)
    assert flare_height(time, start, before, after) == pytest.approx(share * start)
    assert share * start / before <= time * (1.0 + 1e-9) <= share * start / after * (1.0 + 2e-9)


def test_slope_is_the_legs_within_limits() -> None:
    p = FixedWingFlightParameters()
    normal = approach_along_leg((0.0, 0.0, -50.0), (600.0, 0.0, 0.0), p)
    assert normal is not None and normal.slope == pytest.approx(50.0 / 600.0)
    steep = approach_along_leg((0.0, 0.0, -200.0), (600.0, 0.0, 0.0), p)
    assert steep is not None and steep.slope == pytest.approx(math.tan(p.landing_angle_max_rad))
    shallow = approach_along_leg((0.0, 0.0, -50.0), (5000.0, 0.0, 0.0), p)
    assert shallow is not None and shallow.slope == pytest.approx(math.tan(p.landing_angle_rad))
    assert approach_along_leg((0.0, 0.0, -50.0), (5.0, 0.0, 0.0), p) is None
    assert approach_along_leg((0.0, 0.0, 10.0), (600.0, 0.0, 0.0), p) is None
