"""ArduPlane modes: custom_mode numbers, names and base_mode (docs/firmware/ardupilot.md, section 1)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.firmware.data import by_member, load_data, modes
from autopilot_bridge.firmware.flavour import ModeDisplay

_CUSTOM: Final = 0x01
_GUIDED: Final = 0x08
_STABILIZE: Final = 0x10
_MANUAL_INPUT: Final = 0x40
_ARMED: Final = 0x80

_DATA: Final = load_data("ardupilot.plane", "modes.toml")
CUSTOM_MODES: Final[Mapping[FlightMode, int]] = by_member(
    FlightMode, {name: mode["number"] for name, mode in _DATA["modes"].items()}
)

MODE_NAMES: Final[Mapping[FlightMode, str]] = by_member(
    FlightMode, {name: mode["name"] for name, mode in _DATA["modes"].items()}
)

NAVIGATING_MODES: Final = modes(_DATA["navigating"])
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
