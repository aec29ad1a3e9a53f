"""Identifies the ArduPilot firmware that wrote a log, and the names of its flight modes.

Sources: the banners of Copter 2.9 to 4.6, Plane, Rover, Sub, AntennaTracker and Blimp; `defines.h` of Copter
3.0 and 3.1 for modes whose numbers were reused; ArduPilot's frame classes and `VER.BU` build types.
"""

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from autopilot_bridge.mavlink import dialect

_BANNER: Final = re.compile(
    r"\b((?:APM:|Ardu|APM|Antenna)?(Copter|Plane|Rover2?|Sub|Tracker|Blimp)\s+V(\d+)\.(\d+)\S*)(\s+\([0-9a-f]+\))?",
    re.IGNORECASE,
)
_FRAME: Final = re.compile(r"\bFrame:\s*([A-Z0-9_]+)")
_TYPES: Final = MappingProxyType(
    {
        "copter": dialect.MAV_TYPE_QUADROTOR,
        "plane": dialect.MAV_TYPE_FIXED_WING,
        "rover": dialect.MAV_TYPE_GROUND_ROVER,
        "sub": dialect.MAV_TYPE_SUBMARINE,
        "tracker": dialect.MAV_TYPE_ANTENNA_TRACKER,
        "blimp": dialect.MAV_TYPE_AIRSHIP,
    }
)
_BUILDS: Final = MappingProxyType(
    {1: "rover", 2: "copter", 3: "plane", 4: "tracker", 7: "sub", 12: "blimp", 13: "heli"}
)
"""Vehicle by VER.BU."""
_FRAMES: Final = MappingProxyType(
    {
        "QUAD": dialect.MAV_TYPE_QUADROTOR,
        "HEXA": dialect.MAV_TYPE_HEXAROTOR,
        "Y6": dialect.MAV_TYPE_HEXAROTOR,
        "OCTA": dialect.MAV_TYPE_OCTOROTOR,
        "OCTA_QUAD": dialect.MAV_TYPE_OCTOROTOR,
        "OCTAQUAD": dialect.MAV_TYPE_OCTOROTOR,
        "HELI": dialect.MAV_TYPE_HELICOPTER,
        "HELI_DUAL": dialect.MAV_TYPE_HELICOPTER,
        "TRI": dialect.MAV_TYPE_TRICOPTER,
        "SINGLE": dialect.MAV_TYPE_COAXIAL,
        "COAX": dialect.MAV_TYPE_COAXIAL,
        "DODECA_HEXA": dialect.MAV_TYPE_DODECAROTOR,
        "DODECAHEXA": dialect.MAV_TYPE_DODECAROTOR,
    }
)
"""Vehicle by the word after "Frame:" in the banner."""
_OWN_PARAMETERS: Final = (
    ("sub", ("JS_GAIN_DEFAULT", "SURFACE_DEPTH")),
    ("tracker", ("YAW2SRV_P", "SCAN_SPEED_YAW")),
    ("plane", ("TRIM_ARSPD_CM", "AIRSPEED_CRUISE", "RLL2SRV_P", "RLL_RATE_P")),
    ("rover", ("CRUISE_SPEED", "STEER2SRV_P")),
    ("heli", ("H_COL_MIN", "H_SW_COL_DIR")),
    ("copter", ("RATE_RLL_P", "ATC_RAT_RLL_P", "PILOT_TKOFF_ALT", "STB_RLL_P")),
)
"""Parameters that only one firmware has, in the order in which they are checked."""
_MODES_BEFORE: Final = (("copter", (3, 1), MappingProxyType({11: "TOY_A", 12: "TOY_M"})),)
"""Modes whose number changed its meaning at the given version."""
_COPTERS: Final = frozenset(
    (
        dialect.MAV_TYPE_QUADROTOR,
        dialect.MAV_TYPE_HEXAROTOR,
        dialect.MAV_TYPE_OCTOROTOR,
        dialect.MAV_TYPE_TRICOPTER,
        dialect.MAV_TYPE_HELICOPTER,
        dialect.MAV_TYPE_COAXIAL,
    )
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Firmware:
    """The firmware that wrote a log.

    Attributes:
        text: its banner, "ArduCopter V3.3-dev (82481f30)"; "" when none was found.
        vehicle: "copter", "heli", "plane", "rover", "sub", "tracker", "blimp"; "" when not known.
        version: major and minor; None: not known.
        mav_type: MAV_TYPE.
    """

    text: str
    vehicle: str
    version: tuple[int, int] | None
    mav_type: int


def firmware_of(
    texts: Iterable[str], parameters: Collection[str] = (), builds: Collection[int] = ()
) -> Firmware:
    """Identify the firmware by its banner in the texts; without a banner by its build type, or by parameters
    that only it has.

    Args:
        texts: messages to the ground station, in order.
        parameters: names of the vehicle's parameters.
        builds: values of VER.BU.
    """
    text, vehicle, version, frame = "", "", None, None
    for line in texts:
        if not text and (match := _BANNER.search(line)):
            text = match[0]
            vehicle = match[2].lower().rstrip("2")
            version = int(match[3]), int(match[4])
        if frame is None and (match := _FRAME.search(line)):
            frame = _FRAMES.get(match[1].upper())
    for build in builds:
        vehicle = vehicle or _BUILDS.get(build, "")
    if not vehicle:
        known = frozenset(parameters)
        vehicle = next((name for name, own in _OWN_PARAMETERS if known.intersection(own)), "")
    if vehicle == "heli" or (vehicle == "copter" and "H_COL_MIN" in parameters):
        kind = dialect.MAV_TYPE_HELICOPTER
    else:
        kind = _TYPES.get(vehicle, dialect.MAV_TYPE_GENERIC)
        if vehicle == "copter" and frame is not None:
            kind = frame
    return Firmware(text=text, vehicle=vehicle, version=version, mav_type=kind)


def mode_names(mav_type: int, version: tuple[int, int] | None = None) -> Mapping[int, str]:
    """Names of a firmware's flight modes by number; empty for types that ArduPilot does not use.

    Args:
        mav_type: MAV_TYPE.
        version: version of the firmware; None: the newest.
    """
    from pymavlink import mavutil  # imported here because it is slow

    names = dict(mavutil.mode_mapping_bynumber(mav_type) or {})
    for vehicle, since, before in _MODES_BEFORE:
        if vehicle == "copter" and mav_type in _COPTERS and version is not None and version < since:
            names |= before
    return names


def mode_number(mav_type: int, name: str) -> int | None:
    """Number of a mode by its name, spelled as in text logs ("AltHold", "STABILIZE"); None: unknown."""
    wanted = _bare(name)
    return next((number for number, known in mode_names(mav_type).items() if _bare(known) == wanted), None)


def _bare(name: str) -> str:
    return re.sub(r"[^A-Z0-9]", "", name.upper())
