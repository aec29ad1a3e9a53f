"""The form of the filter that is used for each type of vehicle."""

from types import MappingProxyType
from typing import Final

from autopilot_bridge.mavlink import dialect
from estimators.attitude import layout as at
from estimators.attitude.parameters import VehicleKind

_WINGED: Final = (
    "FIXED_WING",
    "FLAPPING_WING",
    "VTOL_DUOROTOR",  # tail-sitters are not fixed wings while they hover; the airspeed shows the difference
    "VTOL_QUADROTOR",
    "VTOL_TILTROTOR",
    "VTOL_RESERVED2",
    "VTOL_RESERVED3",
    "VTOL_RESERVED4",
    "VTOL_RESERVED5",
)
_ROTORS: Final = (
    "QUADROTOR",
    "COAXIAL",
    "HELICOPTER",
    "HEXAROTOR",
    "OCTOROTOR",
    "TRICOPTER",
    "DODECAROTOR",
    "DECAROTOR",
    "GENERIC_MULTIROTOR",
)
_OTHERS: Final = (
    "GENERIC",
    "AIRSHIP",
    "FREE_BALLOON",
    "ROCKET",
    "GROUND_ROVER",
    "SURFACE_BOAT",
    "SUBMARINE",
    "ANTENNA_TRACKER",
    "GROUND_QUADRUPED",
)


def _types(names: tuple[str, ...], form: int) -> dict[int, int]:
    # Older dialects lack the newest types.
    values = (getattr(dialect, f"MAV_TYPE_{name}", None) for name in names)
    return {value: form for value in values if value is not None}


FORM_OF_TYPE: Final = MappingProxyType(
    {**_types(_WINGED, at.WING), **_types(_ROTORS, at.ROTOR), **_types(_OTHERS, at.STILL)}
)
"""Form by MAV_TYPE. Types that are not vehicles (a ground station, a gimbal) are not in it."""

FORM_OF_KIND: Final = MappingProxyType({VehicleKind.FIXED_WING: at.WING, VehicleKind.MULTIROTOR: at.ROTOR})
FORM_NAMES: Final = MappingProxyType({at.STILL: "still", at.WING: "fixed wing", at.ROTOR: "multirotor"})
