"""The controllers' arrays: every quantity has places of its own, and the parameters their order."""

from types import ModuleType

import pytest

from autopilot_bridge.control.fixed_wing import layout as wing
from autopilot_bridge.control.fixed_wing import setpoint as wing_setpoint
from autopilot_bridge.control.multicopter import layout as copter
from autopilot_bridge.control.multicopter import setpoint as copter_setpoint

RATES = {"RATE_SETPOINT": 3, "RATE_INTEGRAL": 3, "RATE_PREVIOUS": 3, "RATE_DERIVATIVE": 3, "UNALLOCATED": 3}
WIDTHS: dict[ModuleType, dict[str, int]] = {
    copter: {
        "VEL_INTEGRAL": 3,
        "ACC_FILTERED": 3,
        "DRAG": 3,
        "BUMP": 3,
        "ACC_SETPOINT": 3,
        "VEL_SETPOINT": 3,
        "Q_SETPOINT": 4,
        "MOTOR_THRUST": 4,
        **RATES,
    },
    wing: {"Q_SETPOINT": 4, "VEL_SETPOINT": 3, **RATES},
}


@pytest.mark.parametrize("layout", [copter, wing], ids=["copter", "wing"])
def test_the_state_is_filled_without_gaps_or_overlaps(layout: ModuleType) -> None:
    names = [name for name in vars(layout) if name.isupper()]
    state = names[names.index("DT") : names.index("STATE_SIZE")]
    places = [
        getattr(layout, name) + offset for name in state for offset in range(WIDTHS[layout].get(name, 1))
    ]
    assert places == list(range(layout.STATE_SIZE))


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
