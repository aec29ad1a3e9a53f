"""ArduCopter modes: custom_mode numbers, names and base_mode (docs/firmware/ardupilot.md, section 1)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.firmware.flavour import ModeDisplay

_CUSTOM: Final = 0x01
_GUIDED: Final = 0x08
_STABILIZE: Final = 0x10
_MANUAL_INPUT: Final = 0x40
_ARMED: Final = 0x80

CUSTOM_MODES: Final[Mapping[FlightMode, int]] = MappingProxyType(
    {
        FlightMode.STABILIZED: 0,
        FlightMode.ACRO: 1,
        FlightMode.ALTITUDE: 2,
        FlightMode.MISSION: 3,
        FlightMode.GUIDED: 4,
        FlightMode.HOLD: 5,
        FlightMode.RETURN: 6,
        FlightMode.CIRCLE: 7,
        FlightMode.LAND: 9,
        FlightMode.DRIFT: 11,
        FlightMode.POSHOLD: 16,
        FlightMode.BRAKE: 17,
        FlightMode.THROW: 18,
        FlightMode.AVOID: 19,
        FlightMode.GUIDED_NOGPS: 20,
        FlightMode.SMART_RETURN: 21,
        FlightMode.FOLLOW: 23,
        FlightMode.ZIGZAG: 24,
        FlightMode.AUTO_RETURN: 27,
        FlightMode.TERMINATION: 0,  # not a separate mode
    }
)

MODE_NAMES: Final[Mapping[FlightMode, str]] = MappingProxyType(
    {
        FlightMode.STABILIZED: "STABILIZE",
        FlightMode.ACRO: "ACRO",
        FlightMode.ALTITUDE: "ALT_HOLD",
        FlightMode.MISSION: "AUTO",
        FlightMode.GUIDED: "GUIDED",
        FlightMode.HOLD: "LOITER",
        FlightMode.RETURN: "RTL",
        FlightMode.CIRCLE: "CIRCLE",
        FlightMode.LAND: "LAND",
        FlightMode.DRIFT: "DRIFT",
        FlightMode.POSHOLD: "POSHOLD",
        FlightMode.BRAKE: "BRAKE",
        FlightMode.THROW: "THROW",
        FlightMode.AVOID: "AVOID_ADSB",
        FlightMode.GUIDED_NOGPS: "GUIDED_NOGPS",
        FlightMode.SMART_RETURN: "SMART_RTL",
        FlightMode.FOLLOW: "FOLLOW",
        FlightMode.ZIGZAG: "ZIGZAG",
        FlightMode.AUTO_RETURN: "AUTO RTL",
        FlightMode.TERMINATION: "STABILIZE",
    }
)

REFUSED_NAMES: Final[Mapping[int, str]] = MappingProxyType(
    {
        14: "FLIP",
        15: "AUTOTUNE",
        22: "FLOWHOLD",
        25: "SYSTEMID",
        27: "AUTO RTL",
        28: "TURTLE",
    }
)
"""Known numbers that the firmware refuses on a copter: "Mode change to X failed", not "No such mode N"."""

_MANUAL_MODES: Final = frozenset(
    {FlightMode.STABILIZED, FlightMode.ACRO, FlightMode.ALTITUDE, FlightMode.DRIFT, FlightMode.TERMINATION}
)


def commanded_mode(number: int) -> FlightMode | None:
    """The mode of a custom_mode number that a client may select, or None."""
    mode = _BY_NUMBER.get(number)
    return None if mode is FlightMode.AUTO_RETURN else mode


def base_mode(display: ModeDisplay) -> int:
    """HEARTBEAT.base_mode: GUIDED is shown while the horizontal position controller works."""
    bits = _CUSTOM | _STABILIZE | _MANUAL_INPUT | (_ARMED if display.armed else 0)
    return bits | (_GUIDED if _position_controlled(display) else 0)


def _position_controlled(display: ModeDisplay) -> bool:
    if not display.booted:
        return True  # the controller's time stamp is young at boot
    if display.mode in _MANUAL_MODES:
        return False
    if display.mode is FlightMode.RETURN and not display.armed:
        return False
    return not (display.armed and display.mode is FlightMode.GUIDED and display.thrust_setpoints)


_BY_NUMBER: Final = {
    number: mode for mode, number in CUSTOM_MODES.items() if mode is not FlightMode.TERMINATION
}
