"""The controllers' records and arrays: every quantity has a place of its own."""

import math
from dataclasses import replace
from types import ModuleType
from typing import get_type_hints

import numpy as np
import pytest
from numba.core.errors import TypingError
from numpy.typing import NDArray

from autopilot_bridge.control.controller import ControllerState
from autopilot_bridge.control.fixed_wing import layout as wing
from autopilot_bridge.control.fixed_wing import setpoint as wing_setpoint
from autopilot_bridge.control.fixed_wing.attitude import rate_control as wing_rate_control
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.control.multicopter import layout as copter
from autopilot_bridge.control.multicopter import setpoint as copter_setpoint
from autopilot_bridge.control.multicopter.attitude import limit_rates, rate_control
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from autopilot_bridge.control.multicopter.position import trajectory_control, update_airborne, update_filters
from autopilot_bridge.navigation import layout as n
from autopilot_bridge.navigation.layout import NavigationState
from flightsim.foundation.records import new_record, packed, record_array, size_of, the_record, viewed


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
    nav, state = new_record(NavigationState), new_record(copter.MulticopterState)
    update_airborne(nav, state)
    with pytest.raises((TypingError, KeyError), match="airborne"):
        update_airborne(nav, nav)  # type: ignore[arg-type]
    with pytest.raises((TypingError, KeyError), match="airborne"):  # a record without the field
        update_airborne(nav, new_record(wing.FixedWingState))  # type: ignore[arg-type]


@pytest.mark.parametrize("setpoint", [copter_setpoint, wing_setpoint], ids=["copter", "wing"])
def test_places_in_the_array_are_those_of_the_record(setpoint: ModuleType) -> None:
    for kind, names in ((setpoint.Setpoint, setpoint), (NavigationState, n)):
        numbers = np.arange(float(size_of(kind)))
        record = the_record(viewed(numbers, kind), kind)
        for name in get_type_hints(kind):
            assert np.array_equal(numbers[getattr(names, name.upper())], getattr(record, name)), name


def test_the_setpoint_in_the_place_of_the_navigation_state_does_not_compile() -> None:
    state = new_record(copter.MulticopterState)
    setpoint = new_record(copter_setpoint.Setpoint)
    with pytest.raises((TypingError, KeyError), match="specific_force_frd_m_s2"):
        update_filters(setpoint, packed_copter(), state, 0.02)  # type: ignore[arg-type]
    nav = new_record(NavigationState)
    with pytest.raises((TypingError, KeyError), match=r"yaw_rad|level|vel_ned_m_s"):
        trajectory_control(nav, nav, packed_copter(), state, 0.02, False)  # type: ignore[arg-type]


def packed_copter() -> MulticopterParameters:
    return the_record(packed(MulticopterParameters()), MulticopterParameters)


def test_another_record_in_the_place_of_the_parameters_does_not_compile() -> None:
    rates = np.zeros(3)
    limit_rates(rates, the_record(packed(MulticopterParameters()), MulticopterParameters))
    with pytest.raises((TypingError, KeyError), match="roll_rate_max_rad_s"):
        limit_rates(rates, new_record(copter.MulticopterState))  # type: ignore[arg-type]


_AXES = ("roll", "pitch", "yaw")


@pytest.mark.parametrize("axis", range(3))
def test_the_gains_of_an_axis_are_its_own(axis: int) -> None:
    """A gain moves the torque and the surface of its axis, and no other."""
    names = [f"rate_{_AXES[axis]}_{gain}" for gain in ("p", "i", "d", "ff", "integral_max")]
    for name in names:
        copter_before, wing_before = _outputs(MulticopterParameters()), _outputs(FixedWingParameters())
        copter_after = _outputs(replace(MulticopterParameters(), **{name: 0.07}))
        wing_after = _outputs(replace(FixedWingParameters(), **{name: 0.07}))
        for before, after in ((copter_before, copter_after), (wing_before, wing_after)):
            assert [k for k in range(3) if (before[:, k] != after[:, k]).any()] == [axis], name


def _outputs(parameters: MulticopterParameters | FixedWingParameters) -> NDArray[np.float64]:
    """Torques or surfaces (n, 3) of rate errors that change their signs, until integrals are at a limit."""
    outputs = []
    nav = new_record(NavigationState)
    if isinstance(parameters, MulticopterParameters):
        p, s = the_record(packed(parameters), MulticopterParameters), new_record(copter.MulticopterState)
        s.dt = 0.1
        for step in range(60):
            rates = np.full(3, 0.1 * math.sin(step))
            s.unallocated[:] = 0.0
            rate_control(rates, np.full(3, 0.5), p, s, s.dt, True)
            outputs.append(s.unallocated.copy())
        return np.array(outputs)
    wing_p, wing_s = the_record(packed(parameters), FixedWingParameters), new_record(wing.FixedWingState)
    wing_s.dt, wing_s.eas = 0.1, 15.0
    for step in range(60):
        nav.rates_frd_rad_s[:] = 0.1 * math.sin(step)
        wing_s.rate_setpoint[:] = 0.5
        surfaces = np.zeros(3)
        wing_rate_control(nav, wing_p, wing_s, surfaces, False)
        outputs.append(surfaces)
    return np.array(outputs)
