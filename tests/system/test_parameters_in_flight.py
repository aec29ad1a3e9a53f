"""A parameter that a client sets counts from the next take-off on, through every change of mode."""

import math

import pytest

from autopilot_bridge.commander.modes import FlightMode
from tests.system.flying import Flying


def test_px4_takes_off_to_the_height_a_client_has_set_and_holds_it() -> None:
    flying = Flying("px4")
    flying.step(6.0)
    flying.autopilot.parameters.set("MIS_TAKEOFF_ALT", 6.0)
    commander = flying.autopilot.commander
    assert commander.arm().accepted
    assert commander.guidance.takeoff(down_m=math.nan, yaw_rad=math.nan).accepted
    flying.step(15.0)
    assert commander.mode is FlightMode.HOLD
    home_down_m = float(flying.autopilot.context.home_ned_m[2])
    assert home_down_m - flying.estimate_ned_m[2] == pytest.approx(6.0, abs=0.2)
