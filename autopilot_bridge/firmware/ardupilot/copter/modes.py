"""ArduCopter modes: custom_mode numbers, names and base_mode (docs/firmware/ardupilot.md, section 1)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.firmware.data import by_member, load_data
from autopilot_bridge.firmware.flavour import ModeDisplay

_CUSTOM: Final = 0x01
_GUIDED: Final = 0x08
_STABILIZE: Final = 0x10
_MANUAL_INPUT: Final = 0x40
_ARMED: Final = 0x80

_DATA: Final = load_data("ardupilot.copter", "modes.toml")
CUSTOM_MODES: Final[Mapping[FlightMode, int]] = by_member(
    FlightMode, {name: mode["number"] for name, mode in _DATA["modes"].items()}
)

MODE_NAMES: Final[Mapping[FlightMode, str]] = by_member(
    FlightMode, {name: mode["name"] for name, mode in _DATA["modes"].items()}
)

REFUSED_NAMES: Final[Mapping[int, str]] = MappingProxyType(
    {14: "FLIP", 15: "AUTOTUNE", 22: "FLOWHOLD", 25: "SYSTEMID", 27: "AUTO RTL", 28: "TURTLE"}
)
"""Known numbers that the firmware refuses on a copter: "Mode change to X failed", not "No such mode N"."""

REFUSED_WHY: Final[Mapping[int, tuple[str, str]]] = MappingProxyType(
    {
        25: ("No axis selected, SID_AXIS = 0", "init failed"),
        27: ("Unable to start landing sequence", "No return path or landing sequence found"),
    }
)
"""A text before the refusal, and its reason, where that is not "init failed" alone."""

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
