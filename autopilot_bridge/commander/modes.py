"""Flight modes, flavour-neutral, and the requirements of each mode.

Both firmwares name and number their modes differently, but fly almost the same in them. A flavour maps its
`custom_mode` numbers to these.
"""

from collections.abc import Mapping
from enum import Enum, Flag, auto
from types import MappingProxyType
from typing import Final


class FlightMode(Enum):
    """The mode that the vehicle flies, or that is commanded."""

    MANUAL = "manual"  # PX4 MANUAL; on a multicopter flown like STABILIZED
    STABILIZED = "stabilized"  # PX4 STABILIZED, ArduPilot STABILIZE
    ACRO = "acro"
    ALTITUDE = "altitude"  # PX4 ALTCTL, ArduPilot ALT_HOLD
    POSITION = "position"  # PX4 POSCTL
    POSITION_SLOW = "position_slow"
    POSHOLD = "poshold"
    HOLD = "hold"  # PX4 AUTO.LOITER, ArduPilot LOITER
    TAKEOFF = "takeoff"
    MISSION = "mission"  # PX4 AUTO.MISSION, ArduPilot AUTO
    OFFBOARD = "offboard"
    GUIDED = "guided"
    GUIDED_NOGPS = "guided_nogps"
    RETURN = "return"
    SMART_RETURN = "smart_return"
    AUTO_RETURN = "auto_return"
    LAND = "land"
    PRECISION_LAND = "precision_land"
    DESCEND = "descend"  # PX4's failsafe landing without a position
    ORBIT = "orbit"
    CIRCLE = "circle"
    BRAKE = "brake"
    FOLLOW = "follow"
    AVOID = "avoid"
    DRIFT = "drift"
    THROW = "throw"
    ZIGZAG = "zigzag"
    FBWA = "fbwa"  # ArduPlane: bank and pitch by stick, limited; throttle by stick
    FBWB = "fbwb"  # ArduPlane: bank by stick, height and airspeed held
    CRUISE = "cruise"  # ArduPlane: FBWB that holds a course while the sticks are centred
    TRAINING = "training"  # ArduPlane: MANUAL within the limits of FBWA
    AUTOTUNE = "autotune"  # ArduPlane; flown like FBWA
    INITIALISING = "initialising"  # ArduPlane until it has booted
    TERMINATION = "termination"


class Need(Flag):
    """A requirement of a mode."""

    NONE = 0
    ATTITUDE = auto()
    ALTITUDE = auto()
    POSITION = auto()
    HOME = auto()
    MANUAL_CONTROL = auto()
    MISSION = auto()
    SETPOINTS = auto()


_HEIGHT: Final = Need.ATTITUDE | Need.ALTITUDE
_PLACE: Final = _HEIGHT | Need.POSITION

MODE_NEEDS: Final[Mapping[FlightMode, Need]] = MappingProxyType(
    {
        FlightMode.MANUAL: Need.ATTITUDE | Need.MANUAL_CONTROL,
        FlightMode.STABILIZED: Need.ATTITUDE | Need.MANUAL_CONTROL,
        FlightMode.ACRO: Need.MANUAL_CONTROL,
        FlightMode.ALTITUDE: _HEIGHT | Need.MANUAL_CONTROL,
        FlightMode.POSITION: _PLACE | Need.MANUAL_CONTROL,
        FlightMode.POSITION_SLOW: _PLACE | Need.MANUAL_CONTROL,
        FlightMode.POSHOLD: _PLACE | Need.MANUAL_CONTROL,
        FlightMode.HOLD: _PLACE,
        FlightMode.TAKEOFF: _PLACE,
        FlightMode.MISSION: _PLACE | Need.MISSION,
        FlightMode.OFFBOARD: Need.ATTITUDE | Need.SETPOINTS,
        FlightMode.GUIDED: _PLACE,
        FlightMode.GUIDED_NOGPS: _HEIGHT,
        FlightMode.RETURN: _PLACE | Need.HOME,
        FlightMode.SMART_RETURN: _PLACE | Need.HOME,
        FlightMode.AUTO_RETURN: _PLACE | Need.HOME | Need.MISSION,
        FlightMode.LAND: _HEIGHT,
        FlightMode.PRECISION_LAND: _PLACE,
        FlightMode.DESCEND: _HEIGHT,
        FlightMode.ORBIT: _PLACE,
        FlightMode.CIRCLE: _PLACE,
        FlightMode.BRAKE: _PLACE,
        FlightMode.FOLLOW: _PLACE,
        FlightMode.AVOID: _PLACE,
        FlightMode.DRIFT: Need.ATTITUDE | Need.MANUAL_CONTROL,
        FlightMode.THROW: _HEIGHT,
        FlightMode.ZIGZAG: _PLACE | Need.MANUAL_CONTROL,
        FlightMode.TERMINATION: Need.NONE,
        FlightMode.FBWA: Need.ATTITUDE | Need.MANUAL_CONTROL,
        FlightMode.FBWB: _HEIGHT | Need.MANUAL_CONTROL,
        FlightMode.CRUISE: _HEIGHT | Need.MANUAL_CONTROL,
        FlightMode.TRAINING: Need.ATTITUDE | Need.MANUAL_CONTROL,
        FlightMode.AUTOTUNE: Need.ATTITUDE | Need.MANUAL_CONTROL,
        FlightMode.INITIALISING: Need.NONE,
    }
)

STICK_MODES: Final = frozenset(
    {
        FlightMode.MANUAL,
        FlightMode.STABILIZED,
        FlightMode.ACRO,
        FlightMode.ALTITUDE,
        FlightMode.POSITION,
        FlightMode.POSITION_SLOW,
        FlightMode.POSHOLD,
        FlightMode.FBWA,
        FlightMode.FBWB,
        FlightMode.CRUISE,
        FlightMode.TRAINING,
        FlightMode.AUTOTUNE,
    }
)
"""Modes flown by the pilot's sticks."""

GUIDED_MODES: Final = frozenset({FlightMode.OFFBOARD, FlightMode.GUIDED, FlightMode.GUIDED_NOGPS})
"""Modes that follow streamed setpoints."""

LANDING_MODES: Final = frozenset({FlightMode.LAND, FlightMode.PRECISION_LAND, FlightMode.DESCEND})
"""Modes that end on the ground below the vehicle."""
