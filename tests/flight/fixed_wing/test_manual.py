"""Flying by the sticks."""

import math

import numpy as np
import pytest

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import ManualInput
from autopilot_bridge.flight.fixed_wing import FixedWingFlightParameters, ManualMode, ManualTask
from autopilot_bridge.flight.fixed_wing.manual import stick, stick_airspeed, throttle_of
from autopilot_bridge.navigation import layout as n
from flightsim.environment import Environment
from tests.flight.fixed_wing.aircraft import Aircraft
from tests.flight.fixed_wing.kinematic import PointMass

P = FixedWingFlightParameters()


def pilot(**sticks: float) -> ManualInput:
    return ManualInput(valid=True, **sticks)


def setpoint_of(mode: ManualMode, sticks: ManualInput, mass: PointMass | None = None) -> np.ndarray:
    mass = mass or PointMass()
    mass.ctx.sticks = sticks
    task = ManualTask(mode)
    task.activate(mass.ctx)
    task.update(mass.ctx)
    return mass.ctx.setpoint


def test_manual_moves_the_surfaces() -> None:
    s = setpoint_of(ManualMode.MANUAL, pilot(roll=0.3, pitch=-0.2, yaw=0.1, throttle=0.5))
    assert s[sp.LEVEL] == sp.SURFACES_DIRECT
    assert s[sp.SURFACES] == pytest.approx([0.3, 0.2, 0.1])  # stick back: nose up
    assert s[sp.THROTTLE] == pytest.approx(0.75)


def test_acro_turns_sticks_into_rates() -> None:
    s = setpoint_of(ManualMode.ACRO, pilot(roll=1.0, pitch=1.0, yaw=-1.0, throttle=-1.0))
    assert s[sp.LEVEL] == sp.RATES
    rates = [P.acro_roll_rate_rad_s, -P.acro_pitch_rate_rad_s, -P.acro_yaw_rate_rad_s]
    assert s[sp.RATES_FRD_RAD_S] == pytest.approx(rates)
    assert s[sp.THROTTLE] == 0.0


@pytest.mark.parametrize("mode", [ManualMode.STABILIZED, ManualMode.FBWA])
def test_attitude_modes_command_bank_and_pitch(mode: ManualMode) -> None:
    s = setpoint_of(mode, pilot(roll=0.53, pitch=-1.0, throttle=0.2, yaw=0.3))
    assert s[sp.ROLL_RAD] == pytest.approx(0.5 * P.manual_bank_max_rad)
    assert s[sp.PITCH_RAD] == pytest.approx(P.manual_pitch_max_rad)
    assert s[sp.THROTTLE] == pytest.approx(0.6)
    assert s[sp.YAW_STICK] == pytest.approx(0.3)


@pytest.mark.parametrize("mode", [ManualMode.ALTITUDE, ManualMode.FBWB])
def test_height_modes_command_climb_rates_and_hold_the_height(mode: ManualMode) -> None:
    mass = PointMass()
    mass.ctx.sticks = pilot(pitch=-1.0, throttle=1.0)
    task = ManualTask(mode)
    mass.fly(task)
    mass.run(10.0)
    assert mass.climb == pytest.approx(P.climb_rate_m_s, rel=0.02)
    assert mass.airspeed == pytest.approx(P.airspeed_max_m_s, rel=0.02)
    mass.ctx.sticks = pilot(roll=-0.53, throttle=0.0)
    log = mass.run(20.0)
    assert log[-1, 3] == pytest.approx(-0.5 * P.manual_bank_max_rad, rel=0.01)
    assert log[-1, 4] == pytest.approx(P.airspeed_trim_m_s, rel=0.02)
    assert abs(mass.climb) < 0.01


@pytest.mark.parametrize("mode", [ManualMode.POSITION, ManualMode.CRUISE])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_centred_sticks_hold_the_track_over_ground(mode: ManualMode, side: float) -> None:
    mass = PointMass(wind_ne_m_s=(0.0, 7.0))
    mass.ctx.sticks = pilot(roll=side * 0.5)
    mass.fly(ManualTask(mode))
    mass.run(4.0)
    mass.ctx.sticks = pilot()
    mass.run(4.0)
    log = mass.run(40.0)
    fit = np.polyfit(log[:, 0], log[:, 1], 1) if abs(np.ptp(log[:, 0])) > 300.0 else None
    if fit is not None:
        assert np.abs(np.polyval(fit, log[:, 0]) - log[:, 1]).max() < 1.5
    else:
        fit = np.polyfit(log[:, 1], log[:, 0], 1)
        assert np.abs(np.polyval(fit, log[:, 1]) - log[:, 0]).max() < 1.5


def test_fbwb_levels_the_wings_but_holds_no_track() -> None:
    s = setpoint_of(ManualMode.FBWB, pilot())
    assert s[sp.ROLL_RAD] == 0.0
    assert math.isnan(s[sp.COURSE_RAD])


def test_training_stops_at_the_limits() -> None:
    mass = PointMass()
    s = setpoint_of(ManualMode.TRAINING, pilot(roll=1.0, pitch=0.1), mass)
    assert s[sp.LEVEL] == sp.SURFACES_DIRECT
    mass.roll = P.manual_bank_max_rad + 0.05
    mass.observe()
    s = setpoint_of(ManualMode.TRAINING, pilot(roll=1.0), mass)
    assert s[sp.LEVEL] == sp.FLY
    assert s[sp.ROLL_RAD] == pytest.approx(P.manual_bank_max_rad)
    s = setpoint_of(ManualMode.TRAINING, pilot(roll=-1.0), mass)
    assert s[sp.LEVEL] == sp.SURFACES_DIRECT  # back to level is free
    mass.roll = 0.0
    mass.ctx.nav[n.EULER_RAD] = (0.0, P.manual_pitch_max_rad + 0.1, 0.0)
    s = setpoint_of(ManualMode.TRAINING, pilot(pitch=-1.0), mass)
    assert s[sp.PITCH_RAD] == pytest.approx(P.manual_pitch_max_rad)


@pytest.mark.parametrize("mode", list(ManualMode))
@pytest.mark.sampled(1)
def test_without_a_pilot_it_flies_straight_and_level(mode: ManualMode) -> None:
    rig = Aircraft(height_m=100.0, environment=Environment(wind_ned_m_s=(3.0, 2.0, 0.0)))
    rig.fly(ManualTask(mode))
    log = rig.run(20.0)
    assert np.abs(log[100:, 25]).max() < math.radians(5.0)
    assert np.abs(log[:, 12] + 100.0).max() < 3.0


@pytest.mark.parametrize("mode", list(ManualMode))
def test_on_the_ground_without_throttle_nothing_moves(mode: ManualMode) -> None:
    rig = Aircraft()
    rig.fly(ManualTask(mode))
    rig.sticks(throttle=-1.0)
    rig.run(3.0)
    assert rig.ctx.on_ground
    assert np.hypot(*rig.nav[n.POS : n.POS + 2]) < 0.5
    rig.ctx.sticks = ManualInput()
    rig.run(0.1)
    assert rig.controller.setpoint[sp.LEVEL] == sp.IDLE


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_fbwa_flies_the_aircraft(side: float) -> None:
    rig = Aircraft(height_m=100.0)
    rig.fly(ManualTask(ManualMode.FBWA))
    rig.sticks(roll=side * 0.53, throttle=0.6)
    log = rig.run(6.0)
    assert np.degrees(log[-50:, 25]).mean() == pytest.approx(side * 22.5, abs=1.5)


def test_sticks() -> None:
    assert stick(0.05, P) == 0.0
    assert stick(1.0, P) == 1.0
    assert stick(-1.0, P) == -1.0
    assert throttle_of(-1.0) == 0.0
    assert stick_airspeed(0.0, P) == P.airspeed_trim_m_s
    assert stick_airspeed(-1.0, P) == P.airspeed_min_m_s
