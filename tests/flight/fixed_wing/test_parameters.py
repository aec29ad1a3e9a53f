"""Parameters of fixed-wing flight, and the context that holds them."""

import math
from dataclasses import replace

import pytest

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.fixed_wing import FixedWingFlightParameters, LoiterTask
from autopilot_bridge.flight.fixed_wing.landing_parameters import FlareParameters, LandingParameters
from autopilot_bridge.flight.parameters import FlightParameters
from autopilot_bridge.flight.task import FlightTask, SpeedTask
from tests.control.fixed_wing.aerosonde import AEROSONDE
from tests.flight.fixed_wing.kinematic import PointMass


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"airspeed_trim_m_s": 40.0}, "airspeed_trim_m_s = 40"),
        ({"airspeed_min_m_s": -1.0}, "airspeed_min_m_s -1"),
        ({"guidance_period_s": 0.0}, "guidance_period_s 0"),
        ({"bank_max_rad": math.nan}, "bank_max_rad nan"),
        ({"bank_max_rad": 1.56}, "85 degrees"),
        ({"loiter_radius_m": 0.2}, "loiter_radius_m = 0.2"),
        ({"pitch_min_rad": 0.5}, "pitch_min_rad = 0.5"),
        ({"trim_throttle": 1.2}, "trim_throttle 1.2"),
        ({"flaps_landing": -0.1}, "flaps_landing -0.1"),
        ({"flaps_takeoff": 1.1}, "flaps_takeoff 1.1"),
        ({"manual_deadzone": 1.0}, "manual_deadzone = 1"),
        ({"landing_angle_max_rad": 0.05}, "landing_angle_max_rad = 0.05"),
    ],
)
def test_nonsense_is_named(change: dict[str, float], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        FixedWingFlightParameters(**change)  # type: ignore[arg-type]


def test_what_may_be_signed_or_endless() -> None:
    FixedWingFlightParameters(
        loiter_radius_m=-80.0, acceptance_altitude_m=math.inf, position_lost_wait_s=math.inf
    )


def test_of_an_envelope() -> None:
    p = FixedWingFlightParameters.for_envelope(AEROSONDE, takeoff_altitude_m=77.0)
    assert p.takeoff_altitude_m == 77.0
    assert p.airspeed_trim_m_s == AEROSONDE.airspeed_trim_m_s
    assert AEROSONDE.stall_speed_m_s < p.landing_airspeed_m_s <= p.airspeed_trim_m_s
    glider = replace(AEROSONDE, powered=False, climb_max_m_s=-1.0, trim_throttle=0.0)
    assert FixedWingFlightParameters.for_envelope(glider).climb_max_m_s == 0.0


def test_a_context_knows_its_class_of_vehicle() -> None:
    aircraft = FlightContext(parameters=FixedWingFlightParameters())
    assert aircraft.fixed_wing is aircraft.parameters
    assert aircraft.setpoint.shape == (sp.SETPOINT_SIZE,)
    with pytest.raises(TypeError, match="FixedWingFlightParameters"):
        _ = aircraft.multicopter
    multicopter = FlightContext(parameters=FlightParameters())
    with pytest.raises(TypeError, match="FlightParameters"):
        _ = multicopter.fixed_wing


def test_parameters_may_change_in_flight() -> None:
    mass = PointMass()
    task: FlightTask = LoiterTask()
    assert isinstance(task, SpeedTask)
    mass.fly(task)
    mass.run(1.0)
    mass.ctx.parameters = replace(mass.parameters, guidance_period_s=20.0)
    mass.run(1.0)
    assert mass.ctx.setpoint[sp.LEVEL] == sp.FLY


def test_the_values_of_a_landing_must_fit_each_other() -> None:
    with pytest.raises(ValueError, match=r"low_m = 20\.0 is not below free_bank_m = 15\.0"):
        LandingParameters(low_m=20.0)
    with pytest.raises(ValueError, match=r"touch_s 0"):
        FlareParameters(touch_s=0.0)
    assert LandingParameters(dive_low_rad=0.0).dive_low_rad == 0.0
