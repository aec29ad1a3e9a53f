"""Default gains: PX4's, by the firmware's own table, but for those that are tuned for a vehicle."""

import math
from collections.abc import Iterable

import pytest

from autopilot_bridge.control.fixed_wing import FixedWingParameters
from autopilot_bridge.control.multicopter import MulticopterParameters
from autopilot_bridge.firmware.mapping import FieldMap
from autopilot_bridge.firmware.px4.copter.mapping import CONTROLLER
from autopilot_bridge.firmware.px4.copter.parameters import PX4_PARAMETERS
from autopilot_bridge.firmware.px4.plane.mapping import CONTROLLER as PLANE_CONTROLLER
from autopilot_bridge.firmware.px4.plane.parameters import PX4_PLANE_PARAMETERS
from autopilot_bridge.parameters import ParameterDefinition

TUNED_FOR_THE_IRIS = {
    "pos_xy_p_1_s",
    "vel_xy_p_1_s",
    "vel_xy_i_1_s2",
    "thrust_min",
    "hover_thrust",
    "rate_yaw_p",
    "rate_yaw_i",
    "thrust_model_factor",
}


def differing(
    parameters: object, table: Iterable[FieldMap], known: Iterable[ParameterDefinition]
) -> set[str]:
    """Fields whose default is not that of the firmware's parameter."""
    defaults = {definition.name: float(definition.default) for definition in known}
    return {
        entry.field
        for entry in table
        if entry.name in defaults
        and getattr(parameters, entry.field) != pytest.approx(defaults[entry.name] * entry.factor, rel=1e-6)
    }


def test_multicopter_defaults_are_px4s() -> None:
    assert differing(MulticopterParameters(), CONTROLLER, PX4_PARAMETERS) == TUNED_FOR_THE_IRIS


def test_fixed_wing_defaults_are_px4s() -> None:
    other = differing(FixedWingParameters(), PLANE_CONTROLLER, PX4_PLANE_PARAMETERS)
    assert other == {"rate_derivative_cutoff_hz"}  # ArduPilot's RLL_RATE_FLTD


@pytest.mark.parametrize(
    ("field", "value"),
    [
        # published with PX4 1.16 and not in the tables above, or not of PX4: see the fields
        ("load_factor_max", 2.0),  # 60 degrees of bank
        ("stall_margin", 1.1),
        ("trim_pitch_rad", 0.0),
        ("lift_angle_rad", 0.0),
        ("sideslip_gain_rad_s_per_m_s2", 0.0),
        ("rate_derivative_cutoff_hz", 20.0),  # RLL_RATE_FLTD
        ("heading_p_1_s", 4.0 * math.pi * 0.7071 / 10.0),  # NPFG_DAMPING, NPFG_PERIOD
    ],
)
def test_fixed_wing_defaults_without_a_parameter(field: str, value: float) -> None:
    assert getattr(FixedWingParameters(), field) == pytest.approx(value, rel=1e-3)
