"""The class of vehicle that an autopilot flies, from its heartbeat."""

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType
from typing import Final

from autopilot_bridge.mavlink import dialect


class VehicleKind(StrEnum):
    """Classes of vehicles that a mission treats differently."""

    MULTICOPTER = "multicopter"
    FIXED_WING = "fixed_wing"


KIND_OF_TYPE: Final[Mapping[int, VehicleKind]] = MappingProxyType(
    {
        dialect.MAV_TYPE_FIXED_WING: VehicleKind.FIXED_WING,
        dialect.MAV_TYPE_QUADROTOR: VehicleKind.MULTICOPTER,
        dialect.MAV_TYPE_COAXIAL: VehicleKind.MULTICOPTER,
        dialect.MAV_TYPE_HELICOPTER: VehicleKind.MULTICOPTER,
        dialect.MAV_TYPE_HEXAROTOR: VehicleKind.MULTICOPTER,
        dialect.MAV_TYPE_OCTOROTOR: VehicleKind.MULTICOPTER,
        dialect.MAV_TYPE_TRICOPTER: VehicleKind.MULTICOPTER,
        dialect.MAV_TYPE_DODECAROTOR: VehicleKind.MULTICOPTER,
        dialect.MAV_TYPE_DECAROTOR: VehicleKind.MULTICOPTER,
    }
)
"""Class by MAV_TYPE; other types can't be flown."""
