"""ArduCopter's crash check: lying still and leaning for two seconds, where the attitude loop wants level."""

import math

import numpy as np
import pytest

from autopilot_bridge.commander.events import Crashed
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.navigation import layout as nav
from flightsim.foundation.vectors import from_euler
from tests.commander.rig import Rig


def crashed(flavour: str = "ardupilot", **parameters: float) -> Rig:
    """In the air as far as the land detector knows, on its back."""
    rig = Rig(flavour)
    for name, value in parameters.items():
        rig.set_parameter(name, value)
    if flavour == "ardupilot":
        rig.commander.set_mode(FlightMode.GUIDED)
    rig.put_in_air()
    rig.context.attitude_setpoint = np.array((1.0, 0.0, 0.0, 0.0))
    rig.context.nav[nav.Q_NED_FROM_FRD] = from_euler(3.0, 0.0, 0.0)
    return rig


def lie(rig: Rig, seconds: float, roll_rad: float = 3.0) -> bool:
    """Whether it is still armed."""
    for _ in range(round(seconds * 50)):
        rig.context.nav[nav.EULER_RAD] = (roll_rad, 0.0, 0.0)
        rig.tick()
    return rig.commander.armed


def test_a_crashed_copter_is_disarmed_and_says_why() -> None:
    rig = crashed()
    assert lie(rig, 1.9)
    assert not lie(rig, 0.4)
    (event,) = rig.happened(Crashed)
    assert event.angle_error_deg == pytest.approx(math.degrees(3.0), abs=0.1)
    assert "Crash: Disarming: AngErr=172>30, Accel=0.0<3.0" in rig.texts()


@pytest.mark.parametrize("case", ["wanted", "upright", "falling", "fast", "acro", "off", "px4"])
def test_what_is_no_crash(case: str) -> None:
    rig = crashed(
        "px4" if case == "px4" else "ardupilot", **({"FS_CRASH_CHECK": 0.0} if case == "off" else {})
    )
    state = rig.context.nav
    roll_rad = 3.0
    if case == "wanted":
        rig.context.attitude_setpoint = state[nav.Q_NED_FROM_FRD].copy()
    elif case == "upright":
        roll_rad = 0.1
    elif case == "falling":
        state[nav.ACC_NED_M_S2] = (0.0, 0.0, 9.0)
    elif case == "fast":
        rig.context.setpoint[:] = math.nan
        rig._follow = lambda: state.__setitem__(nav.VEL_NED_M_S, (12.0, 0.0, 0.0))  # type: ignore[method-assign]
    elif case == "acro":
        rig.commander.set_mode(FlightMode.ACRO)
    assert lie(rig, 5.0, roll_rad)
    assert not rig.happened(Crashed)


@pytest.mark.parametrize(("speed_m_s", "disarmed"), [(9.5, True), (10.5, False)])
def test_a_vehicle_that_falls_fast_has_not_crashed_yet(speed_m_s: float, disarmed: bool) -> None:
    rig = crashed()
    rig.context.setpoint[:] = math.nan
    rig._follow = lambda: rig.context.nav.__setitem__(nav.VEL_NED_M_S, (0.0, 0.0, speed_m_s))  # type: ignore[method-assign]
    assert lie(rig, 3.0) is not disarmed
