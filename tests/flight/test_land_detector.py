"""The land detector is never wrong in the air and quick on the ground."""

import math

import numpy as np
import pytest

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.multicopter import (
    HoldTask,
    LandDetector,
    LandDetectorParameters,
    LandedState,
    LandTask,
    OffboardTask,
)
from autopilot_bridge.navigation import layout as nav_layout
from flightsim.environment import Environment, Turbulence
from tests.flight.rig import Rig


def in_air(rig: Rig) -> bool:
    return LandedState.ON_GROUND not in rig.landed_log


def test_hover_in_severe_turbulence_is_flight() -> None:
    rig = Rig(
        height_m=15.0, environment=Environment(wind_ned_m_s=(8.0, 0.0, 0.0), turbulence=Turbulence.SEVERE)
    )
    rig.fly(HoldTask())
    rig.run(60.0)
    assert in_air(rig)


@pytest.mark.slow
def test_landing_descent_in_turbulence_is_flight_until_the_ground() -> None:
    rig = Rig(
        height_m=25.0, environment=Environment(wind_ned_m_s=(6.0, 0.0, 0.0), turbulence=Turbulence.MODERATE)
    )
    rig.fly(LandTask())
    log = rig.run(50.0)
    first = rig.landed_log.index(LandedState.ON_GROUND)
    assert -log[first, 12] < 0.2


def test_free_descent_is_flight() -> None:
    rig = Rig(height_m=120.0)
    task = OffboardTask()
    task.set_attitude((1.0, 0.0, 0.0, 0.0), 0.0)  # motors at idle: falls
    rig.fly(task)
    rig.run(3.5)
    assert -rig.nav[nav_layout.POS + 2] > 30.0
    assert rig.nav[nav_layout.VEL + 2] > 10.0
    assert in_air(rig)


def test_slow_descent_at_constant_speed_is_flight() -> None:
    rig = Rig(height_m=20.0)
    task = OffboardTask()
    task.set_trajectory(velocity_ned_m_s=(0.0, 0.0, 0.4))
    rig.fly(task)
    rig.run(30.0)
    assert in_air(rig)


def test_stages_come_in_order_with_their_times() -> None:
    ctx = FlightContext()
    ctx.nav[:] = 0.0
    ctx.armed = True
    ctx.setpoint[sp.LEVEL] = sp.TRAJECTORY
    detector = LandDetector(on_ground=False)
    seen = []
    for _ in range(100):
        detector.update(ctx, 0.05)
        seen.append((ctx.ground_contact, ctx.maybe_landed, ctx.on_ground))
    contact, maybe, landed = (next(i for i, s in enumerate(seen) if s[k]) * 0.02 for k in range(3))
    assert contact == pytest.approx(0.34, abs=0.05)
    assert maybe == pytest.approx(contact + 0.667, abs=0.05)
    assert landed == pytest.approx(maybe + 0.333, abs=0.05)
    detector.update(ctx, ctx.hover_thrust)  # thrust ends it at once
    assert not ctx.on_ground


def test_disarmed_is_on_the_ground_unless_falling() -> None:
    ctx = FlightContext()
    ctx.nav[:] = 0.0
    detector = LandDetector(on_ground=False)
    ctx.nav[nav_layout.VEL + 2] = 5.0
    assert detector.update(ctx, 0.0) is not LandedState.ON_GROUND
    ctx.nav[nav_layout.VEL + 2] = 0.0
    assert detector.update(ctx, 0.0) is LandedState.ON_GROUND
    assert np.isnan(ctx.setpoint[sp.POS])


def test_parameters_refuse_nonsense() -> None:
    with pytest.raises(ValueError, match="trigger_time_s nan"):
        LandDetectorParameters(trigger_time_s=math.nan)
