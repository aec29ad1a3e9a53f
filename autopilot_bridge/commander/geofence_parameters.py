"""What a pilot may tune about the geofence, in neutral names."""

from dataclasses import dataclass, field
from enum import IntEnum, IntFlag
from typing import Final

from autopilot_bridge.commander.events import FailsafeAction
from flightsim.checks import check_fields, require_finite


class FenceType(IntFlag):
    """Walls of the geofence; the values are ArduPilot's FENCE_TYPE."""

    HEIGHT_MAX = 1
    CIRCLE = 2  # around home
    SHAPES = 4  # uploaded polygons and circles
    HEIGHT_MIN = 8


ALL_FENCES: Final = FenceType.HEIGHT_MAX | FenceType.CIRCLE | FenceType.SHAPES | FenceType.HEIGHT_MIN


class AutoEnable(IntEnum):
    """FENCE_AUTOENABLE: when the fence switches itself on and off."""

    OFF = 0
    ON_TAKEOFF = 1
    ON_TAKEOFF_KEPT = 2  # only the floor goes off for a landing
    WHEN_ARMED = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class FenceParameters:
    """The geofence.

    Attributes:
        enabled: it counts.
        action: what a breach does.
        radius_m, height_max_m: cylinder around home; 0 switches that wall off.
        floor: there is a smallest height, once the vehicle was above it, until it lands.
        height_min_m: that height over home.
        shapes: uploaded polygons and circles count.
        margin_m: kept from the height limits by returns.
        inclusions_join: one inclusion shape is enough (PX4; FENCE_OPTIONS bit 1); else all must be kept.
        predicts: a breach that can't be avoided any more is one (PX4 GF_PREDICT).
        by_gps: the receiver's position counts, not the filter's (PX4 GF_SOURCE).
        locks_mode: no other mode while what a breach has begun is flown (FENCE_OPTIONS bit 0).
        auto_enable: when it switches itself.
        give_up_m: farther outside the vehicle lands at once (ArduCopter); 0: never.
        backup_radius_m, backup_height_m: so much farther out a wall counts as broken once more
            (ArduPilot); 0: once is enough.
        return_to_rally: the action FENCE_POINT goes to a rally point (FENCE_RET_RALLY).
        return_height_m: at this height over home; 0: between the height limits (FENCE_RET_ALT).
        counts_breaches: breaches are told wall by wall (ArduPilot).
        walls: those that are set up, whether or not the fence is on.
        has_cylinder: there are some besides the uploaded shapes.
    """

    enabled: bool = False
    action: FailsafeAction = FailsafeAction.NONE
    radius_m: float = 0.0
    height_max_m: float = 0.0
    floor: bool = False
    height_min_m: float = 0.0
    shapes: bool = True
    margin_m: float = 0.0
    inclusions_join: bool = True
    predicts: bool = False
    by_gps: bool = False
    locks_mode: bool = False
    auto_enable: AutoEnable = AutoEnable.OFF
    give_up_m: float = 0.0
    backup_radius_m: float = 0.0
    backup_height_m: float = 0.0
    return_to_rally: bool = False
    return_height_m: float = 0.0
    counts_breaches: bool = False
    walls: FenceType = field(init=False)
    has_cylinder: bool = field(init=False)

    def __post_init__(self) -> None:
        check_fields(self, require_finite)
        walls = FenceType(0)
        for there, wall in (
            (self.height_max_m > 0.0, FenceType.HEIGHT_MAX),
            (self.radius_m > 0.0, FenceType.CIRCLE),
            (self.shapes, FenceType.SHAPES),
            (self.floor, FenceType.HEIGHT_MIN),
        ):
            if there:
                walls |= wall
        # asked for ten times a second
        object.__setattr__(self, "walls", walls)
        object.__setattr__(self, "has_cylinder", bool(walls & ~FenceType.SHAPES))

    @property
    def bounds_targets(self) -> bool:
        """Places to fly to must lie inside: always (ArduPilot), or where a breach does something (PX4)."""
        return self.counts_breaches or self.action > FailsafeAction.WARN
