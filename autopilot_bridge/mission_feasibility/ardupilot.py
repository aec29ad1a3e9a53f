"""ArduPilot's rules for stored missions: what arming and the mode AUTO refuse.

The premise of each rule is noted with it. Sources: ArduPilot 4.6.3, ArduCopter/mode_auto.cpp
(ModeAuto::init), AP_Mission::is_takeoff_next, AP_Arming::mission_checks, ArduPlane/AP_Arming.cpp.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem

COPTER_PARAMETERS: Final[Mapping[str, float]] = MappingProxyType(
    {"ARMING_CHECK": 1.0, "ARMING_MIS_ITEMS": 0.0}
)
"""Parameters that the rules depend on, with the firmware's defaults."""
PLANE_PARAMETERS: Final[Mapping[str, float]] = MappingProxyType({**COPTER_PARAMETERS, "RTL_AUTOLAND": 0.0})

_ALL_CHECKS: Final = 1  # ARMING_CHECK
_MISSION_CHECK: Final = 1 << 14
_REQUIRED_ITEMS: Final = (  # by the bits of ARMING_MIS_ITEMS; bit 5 asks for a rally point
    (1 << 0, dialect.MAV_CMD_NAV_LAND, "land"),
    (1 << 1, dialect.MAV_CMD_NAV_VTOL_LAND, "vtol land"),
    (1 << 2, dialect.MAV_CMD_DO_LAND_START, "do land start"),
    (1 << 3, dialect.MAV_CMD_NAV_TAKEOFF, "takeoff"),
    (1 << 4, dialect.MAV_CMD_NAV_VTOL_TAKEOFF, "vtol takeoff"),
    (1 << 6, dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH, "RTL"),
)
_TAKEOFFS: Final = (dialect.MAV_CMD_NAV_TAKEOFF, dialect.MAV_CMD_NAV_VTOL_TAKEOFF)
_LANDING_SEQUENCES: Final = {
    "DO_LAND_START": dialect.MAV_CMD_DO_LAND_START,
    "DO_RETURN_PATH_START": dialect.MAV_CMD_DO_RETURN_PATH_START,
}
_BEFORE_TAKEOFF: Final = (dialect.MAV_CMD_NAV_DELAY,)
"""Items that are flown, and may precede a takeoff."""
_LAST_FLOWN: Final = dialect.MAV_CMD_NAV_LAST
"""Commands up to this one are flown; later ones are executed on the way."""


def starts_with_takeoff(items: Sequence[MissionItem]) -> bool:
    """Whether the first flown item of a mission (without ArduPilot's home) is a takeoff."""
    flown = (item.command for item in items if item.command <= _LAST_FLOWN)
    first = next((command for command in flown if command not in _BEFORE_TAKEOFF), None)
    return first in _TAKEOFFS


def copter_problems(
    items: Sequence[MissionItem], parameters: Mapping[str, float], *, landed: bool
) -> tuple[str, ...]:
    """Why ArduCopter does not fly a mission, in its words; empty when it does.

    Args:
        items: the mission, without home.
        parameters: values of `COPTER_PARAMETERS`.
        landed: it is armed on the ground before AUTO is selected; in flight AUTO asks for no takeoff.
    """
    missing = () if not landed or starts_with_takeoff(items) else ("Auto: Missing Takeoff Cmd",)
    return (*_missing_items(items, parameters), *missing)


def plane_problems(items: Sequence[MissionItem], parameters: Mapping[str, float]) -> tuple[str, ...]:
    """Why ArduPlane does not arm with a mission, in its words; empty when it does.

    Args:
        items: the mission, without home.
        parameters: values of `PLANE_PARAMETERS`. With ARMING_CHECK 0 nothing is checked.
    """
    problems = list(_missing_items(items, parameters))
    if round(parameters["ARMING_CHECK"]) and not round(parameters["RTL_AUTOLAND"]):
        problems += [
            f"Arm: {name} set and RTL_AUTOLAND disabled"
            for name, command in _LANDING_SEQUENCES.items()
            if any(item.command == command for item in items)
        ]
    return tuple(problems)


def _missing_items(items: Sequence[MissionItem], parameters: Mapping[str, float]) -> tuple[str, ...]:
    """The first item that ARMING_MIS_ITEMS asks for and the mission does not have, if ARMING_CHECK includes
    the mission.
    """
    if not round(parameters["ARMING_CHECK"]) & (_ALL_CHECKS | _MISSION_CHECK):
        return ()
    required = round(parameters["ARMING_MIS_ITEMS"])
    stored = {item.command for item in items}
    names = [name for bit, command, name in _REQUIRED_ITEMS if required & bit and command not in stored]
    return tuple(f"Arm: Missing mission item: {name}" for name in names[:1])
