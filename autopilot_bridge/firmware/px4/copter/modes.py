"""PX4 multicopter modes: custom_mode numbers, names and base_mode (docs/firmware/px4.md, section 4)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander.modes import STICK_MODES, FlightMode
from autopilot_bridge.firmware.data import by_member, load_data, modes
from autopilot_bridge.firmware.flavour import ModeDisplay
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.commands.available_modes import ListedMode

MAIN_MANUAL: Final = 1
MAIN_ALTITUDE: Final = 2
MAIN_POSITION: Final = 3
MAIN_AUTO: Final = 4
MAIN_ACRO: Final = 5
MAIN_OFFBOARD: Final = 6
MAIN_STABILIZED: Final = 7
MAIN_TERMINATION: Final = 10

_CUSTOM: Final = 0x01
_AUTO: Final = 0x04
_GUIDED: Final = 0x08
_STABILIZE: Final = 0x10
_MANUAL_INPUT: Final = 0x40
_ARMED: Final = 0x80


def custom_mode(main: int, sub: int = 0) -> int:
    """HEARTBEAT.custom_mode of a PX4 main and sub mode."""
    return main << 16 | sub << 24


_DATA: Final = load_data("px4.copter", "modes.toml")
CUSTOM_MODES: Final[Mapping[FlightMode, int]] = by_member(
    FlightMode, {name: custom_mode(mode["main"], mode["sub"]) for name, mode in _DATA["modes"].items()}
)

MODE_NAMES: Final[Mapping[FlightMode, str]] = by_member(
    FlightMode, {name: mode["name"] for name, mode in _DATA["modes"].items()}
)

_ADVANCED: Final = dialect.MAV_MODE_PROPERTY_ADVANCED
_NOT_SELECTABLE: Final = dialect.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE


def _own(name: str, main: int, sub: int = 0, properties: int = _ADVANCED) -> ListedMode:
    return ListedMode(custom_mode(main, sub), name, 0, properties)


def _standard(standard_mode: int, main: int, sub: int = 0, properties: int = _ADVANCED) -> ListedMode:
    return ListedMode(custom_mode(main, sub), "", standard_mode, properties)


LISTED_MODES: Final = (
    _own("Manual", MAIN_MANUAL),
    _standard(dialect.MAV_STANDARD_MODE_ALTITUDE_HOLD, MAIN_ALTITUDE, properties=0),
    _standard(dialect.MAV_STANDARD_MODE_POSITION_HOLD, MAIN_POSITION, properties=0),
    _standard(dialect.MAV_STANDARD_MODE_MISSION, MAIN_AUTO, 4),
    _own("Hold", MAIN_AUTO, 3),
    _standard(dialect.MAV_STANDARD_MODE_SAFE_RECOVERY, MAIN_AUTO, 5),
    _own("Position Slow", MAIN_POSITION, 2),
    _own("Acro", MAIN_ACRO),
    _own("Termination", MAIN_TERMINATION, properties=_ADVANCED | _NOT_SELECTABLE),
    _own("Offboard", MAIN_OFFBOARD),
    _own("Stabilized", MAIN_STABILIZED),
    _standard(dialect.MAV_STANDARD_MODE_TAKEOFF, MAIN_AUTO, 2),
    _standard(dialect.MAV_STANDARD_MODE_LAND, MAIN_AUTO, 6),
    _own("Follow Target", MAIN_AUTO, 8),
    _own("Precision Landing", MAIN_AUTO, 9),
    _standard(dialect.MAV_STANDARD_MODE_ORBIT, MAIN_POSITION, 1),
    _own("VTOL Takeoff", MAIN_AUTO, 10),
    *(_own("(Mode not available)", MAIN_AUTO, sub, _NOT_SELECTABLE) for sub in range(11, 19)),
)
"""AVAILABLE_MODES of a multicopter, as PX4 1.16.1 sends it; the last eight are for external modes."""

_COMMANDED: Final[Mapping[tuple[int, int], FlightMode]] = MappingProxyType(
    {
        (_DATA["modes"][mode.name]["main"], _DATA["modes"][mode.name]["sub"]): mode
        for mode in modes(_DATA["selectable"])
    }
)


def commanded_mode(main: int, sub: int) -> FlightMode | None:
    """The mode that DO_SET_MODE or SET_MODE requests; None when no mode has these numbers.

    Orbit is entered by DO_ORBIT only: its sub mode selects plain Position. Termination can't be commanded.
    """
    if main == MAIN_AUTO:
        return FlightMode.MISSION if sub == 0 else _COMMANDED.get((main, sub))
    if main == MAIN_POSITION:
        return FlightMode.POSITION_SLOW if sub == 2 else FlightMode.POSITION
    return _COMMANDED.get((main, 0))


def base_mode(display: ModeDisplay) -> int:
    """HEARTBEAT.base_mode."""
    bits = _CUSTOM | (_ARMED if display.armed else 0)
    mode = display.mode
    if mode is FlightMode.ACRO:
        return bits | _MANUAL_INPUT
    if mode in STICK_MODES:
        return bits | _MANUAL_INPUT | _STABILIZE
    if mode is FlightMode.OFFBOARD:
        return bits | (_STABILIZE if display.attitude_setpoints else 0)
    if mode in (FlightMode.ORBIT, FlightMode.FOLLOW):
        return bits | _STABILIZE
    if mode is FlightMode.TERMINATION:
        return bits
    return bits | _STABILIZE | _GUIDED | _AUTO
