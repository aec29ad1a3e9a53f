"""Finds the parts of a mission file that no vehicle could fly, before anything is started."""

import math
from typing import Final

from autopilot_bridge.fence_shapes import (
    CIRCLE_EXCLUSION,
    CIRCLE_INCLUSION,
    POLYGON_EXCLUSION,
    POLYGON_INCLUSION,
)
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.mission_wire import GEODETIC_FRAMES
from missions.errors import PlanError
from missions.plan_files.document import DO_JUMP, LOITERS, NAV_LAND, NAV_TAKEOFF, MissionDocument
from missions.vehicle.items import FLOWN_TO

MAX_ITEMS: Final = 5000
"""More items than any flight controller stores."""

_HIGHEST_M: Final = 50_000.0
_HERE_IF_UNSET: Final = frozenset({NAV_TAKEOFF, NAV_LAND}) | LOITERS
_VTOL: Final = frozenset({84, 85, 3000})


def validated(document: MissionDocument) -> MissionDocument:
    """Return the document if some vehicle can fly it.

    An item that only some autopilots accept is not refused here: the autopilot answers at the upload.

    Raises:
        PlanError: names the file, the item, the value and what is accepted.
    """
    if not document.items:
        raise PlanError(f"{document.path}: the mission has no items; there is nothing to fly")
    if len(document.items) > MAX_ITEMS:
        raise PlanError(f"{document.path}: {len(document.items)} mission items; accepted: up to {MAX_ITEMS}")
    for index in range(len(document.items)):
        _check_item(document, index)
    for what, items in (("geofence", document.fence), ("rally points", document.rally)):
        if len(items) > MAX_ITEMS:
            raise PlanError(f"{document.path}: {len(items)} items of the {what} are more than {MAX_ITEMS}")
        for number, item in enumerate(items, start=1):
            if not _is_place(item) or (item.x == 0.0 and item.y == 0.0):
                raise PlanError(
                    f"{document.path}: {what}, point {number}: {item.x!r}, {item.y!r} is no place; accepted: "
                    "latitude -90..90 and longitude -180..180 degrees"
                )
            if item.command in (CIRCLE_INCLUSION, CIRCLE_EXCLUSION) and not 0.0 < item.param1 < math.inf:
                raise PlanError(
                    f"{document.path}: {what}, circle {number}: radius {item.param1:g} m; accepted: above 0"
                )
            if item.command in (POLYGON_INCLUSION, POLYGON_EXCLUSION) and item.param1 < 3:
                raise PlanError(
                    f"{document.path}: {what}: a polygon of {item.param1:g} points; accepted: 3 or more"
                )
    return document


def _check_item(document: MissionDocument, index: int) -> None:
    item = document.items[index]
    if item.command in _VTOL:
        raise document.refuse(index, "for a VTOL vehicle, which none of the supported autopilots here is")
    if item.command not in dialect.enums["MAV_CMD"]:
        raise document.refuse(index, f"{item.command} is no MAV_CMD")
    for name in ("param1", "param2", "param3", "param4"):
        if math.isinf(getattr(item, name)):
            raise document.refuse(index, f"{name} is infinite; accepted: a number, or not set (NaN)")
    if item.command == DO_JUMP:
        if not (item.param1.is_integer() and 0 <= item.param1 < len(document.items)):
            raise document.refuse(
                index, f"jumps to item {item.param1 + 1:g}, which is not in 1..{len(document.items)}"
            )
        if not (item.param2.is_integer() and item.param2 >= -1):
            raise document.refuse(index, f"repeats {item.param2:g} times; accepted: 0 or more, -1 for ever")
        return
    if item.command not in FLOWN_TO:
        return
    if item.frame not in GEODETIC_FRAMES:
        raise document.refuse(
            index,
            f"frame {item.frame}; accepted: global ones ({', '.join(map(str, sorted(GEODETIC_FRAMES)))})",
        )
    zero_is_here = document.zero_is_here and item.x == item.y == 0.0
    if (item.command in _HERE_IF_UNSET or zero_is_here) and not has_place(item):
        pass
    elif not has_place(item):
        raise document.refuse(index, "has no position")
    elif not _is_place(item):
        raise document.refuse(
            index, f"position {item.x!r}, {item.y!r}; accepted: latitude -90..90, longitude -180..180 degrees"
        )
    if math.isnan(item.z):
        raise document.refuse(index, "has no altitude")
    if not (math.isfinite(item.z) and abs(item.z) <= _HIGHEST_M):
        raise document.refuse(index, f"altitude {item.z:g} m; accepted: a number up to {_HIGHEST_M:g}")


def has_place(item: MissionItem) -> bool:
    """Whether x and y are set: neither NaN nor 0, 0, which both mean "here"."""
    return not (math.isnan(item.x) or math.isnan(item.y) or (item.x == 0.0 and item.y == 0.0))


def _is_place(item: MissionItem) -> bool:
    return abs(item.x) <= 90.0 and abs(item.y) <= 180.0
