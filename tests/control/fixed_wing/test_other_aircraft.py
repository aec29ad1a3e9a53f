"""Aircraft of the jsbsim package with gains made from their envelopes: nothing was tuned by hand."""

import math
from functools import lru_cache

import numpy as np
import pytest

from autopilot_bridge.navigation import layout as n
from flightsim.environment import Environment, Turbulence
from flightsim.flight_envelope import FlightEnvelope, flight_envelope
from tests.control.fixed_wing.rig import Rig
from tests.slow import slow_after

ROLL, PITCH, YAW = 25, 26, 27
HEIGHT_M = 1000.0
POWERED = ("aerosonde", "c172x", "j3cub", "t37")
# the elevator cable of this model has 15 % slack, which no control law keeps still
SLACK = {"c172x": math.radians(3.5)}


@lru_cache
def envelope_of(name: str) -> FlightEnvelope:
    return flight_envelope(name)


def rig(name: str, environment: Environment | None = None) -> Rig:
    made = Rig(envelope_of(name), model=name, height_m=HEIGHT_M, environment=environment)
    made.run(30.0)
    return made


@pytest.mark.parametrize("name", POWERED)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_height_airspeed_and_heading_are_held(name: str) -> None:
    flown = rig(name)
    log = flown.run(20.0)
    assert np.abs(log[:, 12] + HEIGHT_M).max() < 1.5
    assert np.abs(log[:, n.AIRSPEED_M_S] - flown.envelope.airspeed_trim_m_s).max() < 0.5
    assert np.degrees(np.abs(log[:, YAW])).max() < 0.5
    assert np.ptp(log[:, PITCH]) < SLACK.get(name, math.radians(0.2))


@pytest.mark.parametrize("name", ("sgs126", *slow_after(2, POWERED)))
@pytest.mark.sampled(1)
def test_bank_steps_are_coordinated(name: str) -> None:
    flown = rig(name)
    bank = 0.7 * flown.envelope.bank_max_rad
    for wanted in (bank, -bank, 0.0):
        flown.set(roll_rad=wanted, down_m=-HEIGHT_M)
        log = flown.run(15.0)
        step = wanted - log[0, ROLL]
        assert (np.sign(step) * (log[:, ROLL] - wanted)).max() < 0.05 * abs(step)
        assert np.abs(log[-100:, ROLL] - wanted).max() < math.radians(2.0)
        assert np.abs(log[-100:, 23]).max() < 0.2
        assert np.abs(log[:, n.AIRSPEED_M_S] - flown.envelope.airspeed_trim_m_s).max() < 1.0


@pytest.mark.parametrize("name", POWERED)
@pytest.mark.slow
def test_height_step(name: str) -> None:
    flown = rig(name)
    flown.set(heading_rad=0.0, down_m=-HEIGHT_M - 30.0)
    log = flown.run(40.0)
    assert np.abs(log[:, n.AIRSPEED_M_S] - flown.envelope.airspeed_trim_m_s).max() < 1.5
    assert (-log[:, 12]).max() < HEIGHT_M + 32.0
    assert np.abs(log[-100:, 12] + HEIGHT_M + 30.0).max() < 1.5


@pytest.mark.parametrize("name", ("sgs126", *POWERED))
@pytest.mark.slow
def test_airspeeds_between_the_limits(name: str) -> None:
    flown = rig(name)
    envelope = flown.envelope
    for airspeed in (1.08 * envelope.airspeed_min_m_s, 0.88 * envelope.airspeed_max_m_s):
        flown.set(heading_rad=0.0, down_m=-HEIGHT_M, airspeed_m_s=airspeed)
        log = flown.run(60.0)[-250:]
        assert log[:, n.AIRSPEED_M_S].mean() == pytest.approx(airspeed, rel=0.02)
        assert np.ptp(log[:, PITCH]) < SLACK.get(name, math.radians(0.5)) * 1.3


@pytest.mark.parametrize("name", (*POWERED, "sgs126"))
@pytest.mark.slow
def test_turn_onto_a_course_in_moderate_turbulence(name: str) -> None:
    windy = Environment(wind_ned_m_s=(4.0, 4.0, 0.0), turbulence=Turbulence.MODERATE)
    flown = rig(name, windy)
    flown.set(course_rad=1.5, down_m=-HEIGHT_M)
    flown.run(40.0)
    log = flown.run(30.0)
    course = np.arctan2(log[:, 8], log[:, 7])
    assert np.sqrt(np.mean((course - 1.5) ** 2)) < math.radians(2.0)
    assert (log[:, n.AIRSPEED_M_S] > 1.05 * flown.envelope.stall_speed_m_s).all()
    if flown.envelope.powered:
        assert np.sqrt(np.mean((log[:, 12] + HEIGHT_M) ** 2)) < 6.0
