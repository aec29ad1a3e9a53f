"""The geofence parameters of a pilot, in neutral names."""

from dataclasses import dataclass, field
from enum import IntEnum, IntFlag
from typing import Final

from autopilot_bridge.commander.events import FailsafeAction
from flightsim.foundation.options import Options


class FenceType(IntFlag):
    """Walls of the geofence; the values are ArduPilot's FENCE_TYPE."""

    HEIGHT_MAX = 1
    CIRCLE = 2  # around home
    SHAPES = 4  # uploaded polygons and circles
    HEIGHT_MIN = 8


ALL_FENCES: Final = FenceType.HEIGHT_MAX | FenceType.CIRCLE | FenceType.SHAPES | FenceType.HEIGHT_MIN


class AutoEnable(IntEnum):
    """FENCE_AUTOENABLE: when the fence is switched automatically."""

    OFF = 0
    ON_TAKEOFF = 1
    ON_TAKEOFF_KEPT = 2  # for a landing only the floor is switched off
    WHEN_ARMED = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class FenceParameters(Options):
    """The geofence.

    Attributes:
        enabled: the geofence is enabled.
        action: the action of a breach.
        radius_m, height_max_m: cylinder around home; 0 disables that wall.
        floor: there is a minimum height, from the time when the vehicle was above it until it lands.
        height_min_m: that height over home.
        shapes: uploaded polygons and circles are used.
        margin_m: distance that returns keep from the height limits.
        inclusions_join: being inside one inclusion shape is enough (PX4; FENCE_OPTIONS bit 1); else inside
            all.
        unwrapped: longitudes of polygons are compared without wrap (PX4).
        predicts: a breach that can't be avoided any more counts as a breach (PX4 GF_PREDICT).
        by_gps: the receiver's position is checked, not the filter's (PX4 GF_SOURCE).
        locks_mode: no other mode is accepted while the action of a breach is flown (FENCE_OPTIONS bit 0).
        auto_enable: when it is switched automatically.
        give_up_m: farther outside the vehicle lands at once (ArduCopter); 0: never.
        backup_radius_m, backup_height_m: distance farther out at which a wall counts as breached again
            (ArduPilot); 0: only once.
        return_to_rally: the action FENCE_POINT goes to a rally point (FENCE_RET_RALLY).
        return_height_m: height of the action FENCE_POINT over home; 0: between the height limits
            (FENCE_RET_ALT).
        counts_breaches: breaches are reported for each wall (ArduPilot).
        walls: the walls that are set up, whether or not the fence is enabled.
        has_cylinder: there are walls besides the uploaded shapes.
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
    unwrapped: bool = False
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

    def check_together(self) -> None:
        walls = FenceType(0)
        for there, wall in (
            (self.height_max_m > 0.0, FenceType.HEIGHT_MAX),
            (self.radius_m > 0.0, FenceType.CIRCLE),
            (self.shapes, FenceType.SHAPES),
            (self.floor, FenceType.HEIGHT_MIN),
        ):
            if there:
                walls |= wall
        object.__setattr__(self, "walls", walls)
        object.__setattr__(self, "has_cylinder", bool(walls & ~FenceType.SHAPES))

    @property
    def bounds_targets(self) -> bool:
        """Target positions must be inside: always (ArduPilot), or if a breach has an action (PX4)."""
        return self.counts_breaches or self.action > FailsafeAction.WARN
