"""Parameter values with which ArduPilot does not arm, in its words.

Source: ArduPilot 4.6.3, `AP_Arming_Copter::parameter_checks` (ArduCopter/AP_Arming.cpp) and
`AP_Arming_Plane::pre_arm_checks` (ArduPlane/AP_Arming.cpp). With ARMING_CHECK 0 none of them is made.
"""

from typing import Final

from autopilot_bridge.parameters import ParameterStore

_THROTTLE_OFF: Final = 0  # FS_THR_ENABLE
_LEAST_PULSE_US: Final = 910.0  # of FS_THR_VALUE
_ANGLE_MAX_CDEG: Final = (1000.0, 8000.0)
_LEAST_LIMIT_DEG: Final = 3.0
_LEAST_AIRSPEED_M_S: Final = 5
_SHORT_OFF: Final = 3  # FS_SHORT_ACTN


def copter_faults(store: ParameterStore) -> tuple[str, ...]:
    """The first fault of ArduCopter's parameters; empty when there is none."""
    value = store.get
    if value("FS_THR_ENABLE") != _THROTTLE_OFF and value("FS_THR_VALUE") < _LEAST_PULSE_US:
        return ("Check FS_THR_VALUE",)
    if not _ANGLE_MAX_CDEG[0] <= value("ANGLE_MAX") <= _ANGLE_MAX_CDEG[1]:
        return ("Check ANGLE_MAX",)
    if value("ACRO_BAL_ROLL") > value("ATC_ANG_RLL_P") or value("ACRO_BAL_PITCH") > value("ATC_ANG_PIT_P"):
        return ("Check ACRO_BAL_ROLL/PITCH",)
    return ("Check PILOT_SPEED_UP",) if value("PILOT_SPEED_UP") <= 0.0 else ()


def plane_faults(store: ParameterStore) -> tuple[str, ...]:
    """The faults of ArduPlane's parameters."""
    value = store.get
    roll, up, down = value("ROLL_LIMIT_DEG"), value("PTCH_LIM_MAX_DEG"), value("PTCH_LIM_MIN_DEG")
    airspeed = int(value("AIRSPEED_MIN"))
    short_acts = value("FS_SHORT_ACTN") != _SHORT_OFF
    checks = (
        (
            short_acts and value("FS_LONG_TIMEOUT") < value("FS_SHORT_TIMEOUT"),
            "FS_LONG_TIMEOUT < FS_SHORT_TIMEOUT",
        ),
        (roll < _LEAST_LIMIT_DEG, f"ROLL_LIMIT_DEG too small ({roll:.1f})"),
        (up < _LEAST_LIMIT_DEG, f"PTCH_LIM_MAX_DEG too small ({up:.1f})"),
        (down > -_LEAST_LIMIT_DEG, f"PTCH_LIM_MIN_DEG too large ({down:.1f})"),
        (airspeed < _LEAST_AIRSPEED_M_S, f"AIRSPEED_MIN too low ({airspeed} < {_LEAST_AIRSPEED_M_S})"),
    )
    return tuple(text for failed, text in checks if failed)
