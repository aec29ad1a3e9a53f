"""Which mission items are acceptable, and how an autopilot stores them: rules of both flavours.

Results are MAV_MISSION_RESULT values. Both firmwares accept some impossible items; here every impossible
value is refused with the result that the MAVLink specification defines for it.
"""

import math
from typing import Final, Protocol

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.mission_wire import GEODETIC_FRAMES

ACCEPTED: Final = dialect.MAV_MISSION_ACCEPTED
INVALID_PARAM: Final = (
    dialect.MAV_MISSION_INVALID_PARAM1,
    dialect.MAV_MISSION_INVALID_PARAM2,
    dialect.MAV_MISSION_INVALID_PARAM3,
    dialect.MAV_MISSION_INVALID_PARAM4,
)
MAX_ALTITUDE_M: Final = 83_000.0  # ArduPilot's LOCATION_ALT_MAX_M

POLYGON_COMMANDS: Final = frozenset(
    (dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION)
)
CIRCLE_COMMANDS: Final = frozenset(
    (dialect.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, dialect.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION)
)
FENCE_COMMANDS: Final = POLYGON_COMMANDS | CIRCLE_COMMANDS | {dialect.MAV_CMD_NAV_FENCE_RETURN_POINT}
RALLY_COMMANDS: Final = frozenset((dialect.MAV_CMD_NAV_RALLY_POINT,))
HERE_COMMANDS: Final = frozenset(
    (
        dialect.MAV_CMD_NAV_TAKEOFF,
        dialect.MAV_CMD_NAV_LAND,
        dialect.MAV_CMD_NAV_LOITER_UNLIM,
        dialect.MAV_CMD_NAV_LOITER_TIME,
        dialect.MAV_CMD_NAV_LOITER_TURNS,
        dialect.MAV_CMD_NAV_LOITER_TO_ALT,
    )
)
"""For these commands, unset latitude and longitude mean the vehicle's current position."""


PLACED_COMMANDS: Final = HERE_COMMANDS | {
    dialect.MAV_CMD_NAV_WAYPOINT,
    dialect.MAV_CMD_NAV_SPLINE_WAYPOINT,
    dialect.MAV_CMD_NAV_VTOL_TAKEOFF,
    dialect.MAV_CMD_NAV_VTOL_LAND,
}
"""Commands that move the vehicle to a position."""


class ItemRules(Protocol):
    """How one firmware checks, stores and reads back mission items."""

    def check(self, item: MissionItem, mission_type: MissionType, seq: int, count: int) -> int:
        """MAV_MISSION_RESULT for one uploaded item of a plan of `count` items; ACCEPTED (0) if valid."""
        ...

    def stored(self, item: MissionItem) -> MissionItem:
        """An accepted item as the firmware stores it."""
        ...

    def read_back(self, item: MissionItem, *, as_int: bool) -> MissionItem:
        """A stored item as the firmware sends it."""
        ...


def check_position(item: MissionItem) -> int:
    """Check latitude, longitude and altitude of an item in a geodetic frame."""
    unset = math.isnan(item.x) and math.isnan(item.y) and item.command in HERE_COMMANDS
    if not unset:
        if not abs(item.x) <= 90.0:
            return int(dialect.MAV_MISSION_INVALID_PARAM5_X)
        if not abs(item.y) <= 180.0:
            return int(dialect.MAV_MISSION_INVALID_PARAM6_Y)
    return check_altitude(item)


def check_altitude(item: MissionItem) -> int:
    if not abs(item.z) <= MAX_ALTITUDE_M:
        return int(dialect.MAV_MISSION_INVALID_PARAM7)
    return int(ACCEPTED)


def check_params(item: MissionItem, *, nan_allowed: tuple[bool, bool, bool, bool]) -> int:
    """Check that param1..param4 are finite; NaN ("not set") where allowed."""
    params = (item.param1, item.param2, item.param3, item.param4)
    for value, may_be_nan, result in zip(params, nan_allowed, INVALID_PARAM, strict=True):
        if math.isinf(value) or (math.isnan(value) and not may_be_nan):
            return int(result)
    return int(ACCEPTED)


def check_special(item: MissionItem, seq: int, count: int) -> int:
    """Check the commands whose parameters can be impossible: jumps, speeds, delays."""
    match item.command:
        case dialect.MAV_CMD_DO_JUMP:
            target = item.param1
            if not 0 <= target < count or target != int(target) or target == seq:
                return int(dialect.MAV_MISSION_INVALID_PARAM1)
            if not -1.0 <= item.param2 <= 65535.0:
                return int(dialect.MAV_MISSION_INVALID_PARAM2)
        case dialect.MAV_CMD_DO_JUMP_TAG:
            if not -1.0 <= item.param2 <= 65535.0:
                return int(dialect.MAV_MISSION_INVALID_PARAM2)
        case dialect.MAV_CMD_DO_CHANGE_SPEED:
            # -1 keeps the speed, -2 returns to the default one.
            if not (item.param2 >= 0.0 or item.param2 in (-1.0, -2.0)):
                return int(dialect.MAV_MISSION_INVALID_PARAM2)
        case (
            dialect.MAV_CMD_NAV_WAYPOINT
            | dialect.MAV_CMD_NAV_SPLINE_WAYPOINT
            | dialect.MAV_CMD_NAV_LOITER_TIME
            | dialect.MAV_CMD_NAV_DELAY  # not delayed until a time of day
            | dialect.MAV_CMD_CONDITION_DELAY
            | dialect.MAV_CMD_CONDITION_DISTANCE
        ):
            if item.param1 < 0.0:
                return int(dialect.MAV_MISSION_INVALID_PARAM1)
    return int(ACCEPTED)


def check_fence(item: MissionItem, *, empty_circles: bool = False) -> int:
    """Check one item of a fence plan.

    Args:
        empty_circles: circles of radius 0 are accepted (PX4); nothing is inside of them.
    """
    if item.command not in FENCE_COMMANDS:
        return int(dialect.MAV_MISSION_UNSUPPORTED)
    if item.frame not in GEODETIC_FRAMES:
        return int(dialect.MAV_MISSION_UNSUPPORTED_FRAME)
    if item.command in POLYGON_COMMANDS and not 3.0 <= item.param1 <= 65535.0:
        return int(dialect.MAV_MISSION_INVALID_PARAM1)
    if item.command in CIRCLE_COMMANDS:
        radius_m = item.param1
        positive = radius_m > 0.0 or (empty_circles and radius_m == 0.0)
        if not (positive and math.isfinite(radius_m)):
            return int(dialect.MAV_MISSION_INVALID_PARAM1)
    return check_horizontal(item) or check_finite(item)


def check_rally(item: MissionItem) -> int:
    """Check one item of a rally plan."""
    if item.command not in RALLY_COMMANDS:
        return int(dialect.MAV_MISSION_UNSUPPORTED)
    if item.frame not in GEODETIC_FRAMES:
        return int(dialect.MAV_MISSION_UNSUPPORTED_FRAME)
    return check_horizontal(item) or check_altitude(item) or check_finite(item)


def check_finite(item: MissionItem) -> int:
    """Check that no value is infinite: for items whose values are plain numbers."""
    for value, result in (
        (item.x, dialect.MAV_MISSION_INVALID_PARAM5_X),
        (item.y, dialect.MAV_MISSION_INVALID_PARAM6_Y),
        (item.z, dialect.MAV_MISSION_INVALID_PARAM7),
    ):
        if math.isinf(value):
            return int(result)
    return check_params(item, nan_allowed=(True, True, True, True))


def check_horizontal(item: MissionItem) -> int:
    if not abs(item.x) <= 90.0:
        return int(dialect.MAV_MISSION_INVALID_PARAM5_X)
    if not abs(item.y) <= 180.0:
        return int(dialect.MAV_MISSION_INVALID_PARAM6_Y)
    return int(ACCEPTED)


def check_fence_polygons(items: tuple[MissionItem, ...]) -> int:
    """Check a whole fence plan: each polygon has as many vertices as each vertex states."""
    left = 0
    size = 0
    command = 0
    for item in items:
        if item.command not in POLYGON_COMMANDS:
            if left:
                return int(dialect.MAV_MISSION_INVALID_PARAM1)
            continue
        if left == 0:
            size = left = round(item.param1)
            command = item.command
        if item.command != command or round(item.param1) != size:
            return int(dialect.MAV_MISSION_INVALID_PARAM1)
        left -= 1
    return int(dialect.MAV_MISSION_INVALID_PARAM1) if left else int(ACCEPTED)


def fence_excludes(items: tuple[MissionItem, ...], lat_deg: float, lon_deg: float) -> bool:
    """True when a point lies outside every inclusion polygon of a fence plan that has any (even-odd rule)."""
    polygons: list[list[tuple[float, float]]] = []
    left = 0
    for item in items:
        if item.command != dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION:
            continue
        if left == 0:
            polygons.append([])
            left = round(item.param1)
        polygons[-1].append((item.x, item.y))
        left -= 1
    return bool(polygons) and not any(_inside(polygon, lat_deg, lon_deg) for polygon in polygons)


def _inside(polygon: list[tuple[float, float]], x: float, y: float) -> bool:
    inside = False
    x1, y1 = polygon[-1]
    for x2, y2 in polygon:
        if (y1 > y) != (y2 > y) and x < (x2 - x1) * (y - y1) / (y2 - y1) + x1:
            inside = not inside
        x1, y1 = x2, y2
    return inside
