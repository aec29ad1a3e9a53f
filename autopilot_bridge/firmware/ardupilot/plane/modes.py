"""ArduPlane modes: custom_mode numbers, names and base_mode (docs/firmware/ardupilot.md, section 1)."""

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
        FlightMode.MANUAL: 0,
        FlightMode.CIRCLE: 1,
        FlightMode.STABILIZED: 2,
        FlightMode.TRAINING: 3,
        FlightMode.ACRO: 4,
        FlightMode.FBWA: 5,
        FlightMode.FBWB: 6,
        FlightMode.CRUISE: 7,
        FlightMode.AUTOTUNE: 8,
        FlightMode.MISSION: 10,
        FlightMode.RETURN: 11,
        FlightMode.HOLD: 12,
        FlightMode.TAKEOFF: 13,
        FlightMode.AVOID: 14,
        FlightMode.GUIDED: 15,
        FlightMode.INITIALISING: 16,
        FlightMode.TERMINATION: 0,  # not a separate mode: shown as the mode in which it ends
    }
)

MODE_NAMES: Final[Mapping[FlightMode, str]] = MappingProxyType(
    {
        FlightMode.MANUAL: "MANUAL",
        FlightMode.CIRCLE: "CIRCLE",
        FlightMode.STABILIZED: "STABILIZE",
        FlightMode.TRAINING: "TRAINING",
        FlightMode.ACRO: "ACRO",
        FlightMode.FBWA: "FBWA",
        FlightMode.FBWB: "FBWB",
        FlightMode.CRUISE: "CRUISE",
        FlightMode.AUTOTUNE: "AUTOTUNE",
        FlightMode.MISSION: "AUTO",
        FlightMode.RETURN: "RTL",
        FlightMode.HOLD: "LOITER",
        FlightMode.TAKEOFF: "TAKEOFF",
        FlightMode.AVOID: "AVOID_ADSB",
        FlightMode.GUIDED: "GUIDED",
        FlightMode.INITIALISING: "INITIALISING",
        FlightMode.TERMINATION: "MANUAL",
    }
)

NAVIGATING_MODES: Final = frozenset(
    {
        FlightMode.MISSION,
        FlightMode.RETURN,
        FlightMode.HOLD,
        FlightMode.CIRCLE,
        FlightMode.TAKEOFF,
        FlightMode.AVOID,
        FlightMode.GUIDED,
    }
)
"""Modes that the autopilot flies by itself; HEARTBEAT shows GUIDED, NAV_CONTROLLER_OUTPUT is sent."""

REFUSED_TEXTS: Final[Mapping[int, str]] = MappingProxyType(
    {
        16: "Flight mode change failed",
        24: "Flight mode change failed",
        **{number: "Q_ENABLE 0" for number in (17, 18, 19, 20, 21, 22, 23, 25)},
    }
)
"""Known numbers that the firmware refuses on this vehicle, and its texts; others are "No such mode N"."""


def commanded_mode(number: int) -> FlightMode | None:
    """The mode of a custom_mode number that a client may select, or None."""
    return _BY_NUMBER.get(number)


def base_mode(display: ModeDisplay) -> int:
    """HEARTBEAT.base_mode."""
    bits = _CUSTOM | _STABILIZE | (_ARMED if display.armed else 0)
    if display.mode is FlightMode.INITIALISING:
        return bits
    bits |= _MANUAL_INPUT
    return bits | _GUIDED if display.mode in NAVIGATING_MODES else bits


_BY_NUMBER: Final = {
    number: mode
    for mode, number in CUSTOM_MODES.items()
    if mode not in (FlightMode.INITIALISING, FlightMode.TERMINATION)
}
