"""The controllers' arrays: every quantity has places of its own, and the parameters their order."""

from types import ModuleType

import numpy as np
import pytest
from numba.core.errors import TypingError

from autopilot_bridge.control.controller import ControllerState
from autopilot_bridge.control.fixed_wing import layout as wing
from autopilot_bridge.control.fixed_wing import setpoint as wing_setpoint
from autopilot_bridge.control.multicopter import layout as copter
from autopilot_bridge.control.multicopter import setpoint as copter_setpoint
from autopilot_bridge.control.multicopter.position import update_airborne
from autopilot_bridge.navigation.layout import NAV_SIZE
from flightsim.foundation.records import new_record, record_array, the_record


@pytest.mark.parametrize("kind", [copter.MulticopterState, wing.FixedWingState])
def test_the_state_is_a_record_of_numbers_without_gaps(kind: type[ControllerState]) -> None:
    array = record_array(kind)
    record = the_record(array, kind)
    assert record_array(kind).dtype.itemsize == array.view(np.float64).size * 8
    record.dt, record.vel_setpoint[2] = 0.25, 3.0
    assert array["dt"][0] == 0.25 and array["vel_setpoint"][0, 2] == 3.0
    array["q_setpoint"][0] = 1.0
    assert record.q_setpoint.tolist() == [1.0] * 4


def test_another_array_in_the_place_of_the_state_does_not_compile() -> None:
    nav, state = np.zeros(NAV_SIZE), new_record(copter.MulticopterState)
    update_airborne(nav, state)
    with pytest.raises(TypingError, match="airborne"):
        update_airborne(nav, nav)  # type: ignore[arg-type]
    with pytest.raises((TypingError, KeyError), match="airborne"):  # a record without the field
        update_airborne(nav, new_record(wing.FixedWingState))  # type: ignore[arg-type]


@pytest.mark.parametrize("setpoint", [copter_setpoint, wing_setpoint], ids=["copter", "wing"])
def test_the_setpoint_is_filled_without_gaps_or_overlaps(setpoint: ModuleType) -> None:
    found: list[int] = []
    for name in vars(setpoint):
        place = getattr(setpoint, name)
        if name.endswith(
            ("_M", "_M_S", "_M_S2", "_RAD", "_RAD_S", "FRD", "SURFACES", "THROTTLE", "THRUST", "MAX")
        ) or name in ("LEVEL", "FLAPS", "BRAKE", "YAW_STICK"):
            found.extend(range(place.start, place.stop) if isinstance(place, slice) else [place])
    assert sorted(found) == list(range(setpoint.SETPOINT_SIZE))


def test_parameters_of_the_axes_follow_each_other() -> None:
    """Kernels address roll, pitch and yaw by the first one's place and the number of gains per axis."""
    for layout, gains in (
        (copter, ("p", "i", "d", "ff", "k", "integral_max")),
        (wing, ("p", "i", "d", "ff", "integral_max")),
    ):
        assert len(gains) == layout.RATE_GAINS_PER_AXIS
        for axis, name in enumerate(("roll", "pitch", "yaw")):
            for k, gain in enumerate(gains):
                place = layout.RATE_GAINS + axis * layout.RATE_GAINS_PER_AXIS + k
                assert layout.PARAMETER_NAMES[place] == f"rate_{name}_{gain}"
    for k, axis in enumerate(("roll", "pitch", "yaw")):
        assert copter.PARAMETER_NAMES[copter.ATTITUDE_P + k] == f"{axis}_p_1_s"
        assert copter.PARAMETER_NAMES[copter.RATE_MAX + k] == f"{axis}_rate_max_rad_s"
    for k, surface in enumerate(("aileron", "elevator", "rudder")):
        assert wing.PARAMETER_NAMES[wing.TRIM_SURFACES + k] == f"trim_{surface}"
