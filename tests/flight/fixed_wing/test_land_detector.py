"""The landed state of an aircraft."""

import math

import pytest

from autopilot_bridge.flight.context import FlightPhase, LandedState
from autopilot_bridge.flight.fixed_wing import LandDetector, LandDetectorParameters, ManualMode, ManualTask
from autopilot_bridge.navigation import layout as n
from flightsim.environment import Environment
from tests.flight.fixed_wing.aircraft import Aircraft
from tests.flight.fixed_wing.kinematic import PointMass


def standing() -> PointMass:
    mass = PointMass()
    mass.airspeed = 0.0
    mass.observe()
    return mass


def run(detector: LandDetector, mass: PointMass, seconds: float, throttle: float = 0.0) -> LandedState:
    for _ in range(round(seconds / 0.02)):
        detector.update(mass.ctx, throttle)
    return detector.state


def test_standing_still_for_the_trigger_time_is_landed() -> None:
    mass = standing()
    mass.ctx.phase = FlightPhase.LANDING
    detector = LandDetector(on_ground=False)
    assert run(detector, mass, 1.9) is LandedState.LANDING
    assert mass.ctx.ground_contact and mass.ctx.maybe_landed
    assert run(detector, mass, 0.2) is LandedState.ON_GROUND


def test_speed_lifts_off_at_once() -> None:
    mass = standing()
    detector = LandDetector(on_ground=True)
    assert run(detector, mass, 1.0) is LandedState.ON_GROUND
    mass.airspeed = 9.0
    mass.observe()
    mass.ctx.phase = FlightPhase.TAKEOFF
    assert run(detector, mass, 1.0) is LandedState.TAKEOFF
    mass.ctx.phase = FlightPhase.CRUISE
    assert run(detector, mass, 1.0) is LandedState.IN_AIR


def test_wind_over_a_standing_aircraft_is_not_flight() -> None:
    mass = standing()
    mass.ctx.nav[n.AIRSPEED_M_S] = 12.0
    detector = LandDetector(on_ground=False)
    assert run(detector, mass, 3.0) is LandedState.ON_GROUND
    # without a velocity the airspeed is what there is
    assert mass.ctx.health is not None
    mass.ctx.health.velocity_horizontal = False
    detector = LandDetector(on_ground=False)
    assert run(detector, mass, 3.0) is LandedState.IN_AIR


def test_turning_an_aircraft_by_hand_is_not_flight_but_delays_a_landing() -> None:
    mass = standing()
    mass.ctx.nav[n.RATES_FRD_RAD_S] = (0.0, 0.0, 1.0)
    assert run(LandDetector(on_ground=True), mass, 3.0) is LandedState.ON_GROUND
    assert run(LandDetector(on_ground=False), mass, 3.0) is LandedState.IN_AIR


def test_disarmed_in_the_air_stays_in_the_air_until_it_lies_still() -> None:
    mass = PointMass()
    detector = LandDetector(on_ground=False)
    run(detector, mass, 1.0)
    mass.ctx.armed = False
    assert run(detector, mass, 1.0) is LandedState.IN_AIR
    assert not mass.ctx.ground_contact
    mass.airspeed = 0.0
    mass.observe()
    assert run(detector, mass, 3.0) is LandedState.ON_GROUND


def test_carried_in_a_hand_it_stays_on_the_ground() -> None:
    mass = standing()
    mass.airspeed = 1.5
    mass.climb = 0.5
    mass.observe()
    assert run(LandDetector(on_ground=True), mass, 3.0) is LandedState.ON_GROUND


def test_circling_in_severe_turbulence_is_flight() -> None:
    rig = Aircraft(
        height_m=150.0, environment=Environment(wind_ned_m_s=(-14.0, 0.0, 0.0), turbulence="severe")
    )
    rig.fly(ManualTask(ManualMode.FBWB))
    for _ in range(300):
        rig.run(0.1)
        assert rig.ctx.landed_state is LandedState.IN_AIR
        assert not rig.ctx.ground_contact


def test_parameters_refuse_nonsense() -> None:
    with pytest.raises(ValueError, match="trigger_time_s -1"):
        LandDetectorParameters(trigger_time_s=-1.0)
    with pytest.raises(ValueError, match="nan"):
        LandDetectorParameters(airspeed_max_m_s=math.nan)
