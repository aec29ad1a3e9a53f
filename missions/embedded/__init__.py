"""Embedded worlds: a simulated world in this process that missions are flown in."""

from missions.embedded.sitl import MAX_FLIGHT_S, EmbeddedSitl, alone, model_kind
from missions.embedded.target_fields import TargetField, multi_target_world, terrain_targets_world
from missions.embedded.worlds import (
    CAMERA,
    MAGNETOMETER,
    MotionKind,
    carrying,
    motion_of,
    occupancy_world,
    orbit_world,
)

__all__ = [
    "CAMERA",
    "MAGNETOMETER",
    "MAX_FLIGHT_S",
    "EmbeddedSitl",
    "MotionKind",
    "TargetField",
    "alone",
    "carrying",
    "model_kind",
    "motion_of",
    "multi_target_world",
    "occupancy_world",
    "orbit_world",
    "terrain_targets_world",
]
