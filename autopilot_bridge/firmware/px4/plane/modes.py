"""PX4 fixed-wing modes: custom_mode numbers, names and base_mode (docs/firmware/px4.md, section 4)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.firmware.flavour import ModeDisplay
from autopilot_bridge.firmware.px4.copter import modes as px4_modes
from autopilot_bridge.mavlink import dialect

_STABILIZE: Final = 0x10
MULTICOPTER_ONLY: Final = frozenset({FlightMode.ORBIT, FlightMode.POSITION_SLOW, FlightMode.PRECISION_LAND})

CUSTOM_MODES: Final[Mapping[FlightMode, int]] = MappingProxyType(
    {mode: number for mode, number in px4_modes.CUSTOM_MODES.items() if mode not in MULTICOPTER_ONLY}
)
MODE_NAMES: Final[Mapping[FlightMode, str]] = MappingProxyType(
    {mode: name for mode, name in px4_modes.MODE_NAMES.items() if mode not in MULTICOPTER_ONLY}
)

LISTED_MODES: Final = tuple(
    mode._replace(standard_mode=dialect.MAV_STANDARD_MODE_CRUISE)
    if mode.standard_mode == dialect.MAV_STANDARD_MODE_POSITION_HOLD
    else mode
    for mode in px4_modes.LISTED_MODES
)
"""AVAILABLE_MODES of an aircraft, as PX4 1.16.1 was seen to send it: a multicopter's modes too."""


def base_mode(display: ModeDisplay) -> int:
    """HEARTBEAT.base_mode: as a multicopter's, but MANUAL drives the surfaces directly."""
    bits = px4_modes.base_mode(display)
    return bits & ~_STABILIZE if display.mode is FlightMode.MANUAL else bits
