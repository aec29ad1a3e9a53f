"""Converts QGroundControl's complex items to simple ones: items that the file stores expanded, and the
landing pattern.

Surveys and corridor scans are stored with the items they expand to (`TransectStyleComplexItem.Items`). A
fixed-wing landing pattern is stored by its two points and radius; its items are those that the ground
station uploads for it. A structure scan is stored by its outline only.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

from autopilot_bridge.mission_plan import MissionItem
from missions.plan_files import document as document
from missions.plan_files.json_values import Refuse, entries, flag, mapping, number, numbers, shown

_RELATIVE: Final = 6
_ABSOLUTE: Final = 5
_STOP_PHOTOS: Final = 2001
_STOP_VIDEO: Final = 2501


def simple_items(
    entry: Mapping[str, Any], where: str, refuse: Refuse
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """The simple items that are stored in a complex item, and the place of each in the file."""
    inner = entry.get("TransectStyleComplexItem", entry)
    if not isinstance(inner, Mapping) or "Items" not in inner:
        raise refuse(
            where,
            f"a complex item {shown(entry.get('complexItemType'))} is not stored expanded; use a survey or a "
            "corridor scan, or upload the mission with the ground station",
        )
    for number_, item in enumerate(entries(inner["Items"], where, refuse), start=1):
        yield f"{where}, its item {number_}", mapping(item, where, refuse)


def landing_items(entry: Mapping[str, Any], where: str, refuse: Refuse) -> list[MissionItem]:
    """Items of a fixed-wing landing pattern: DO_LAND_START, the circle (or point) of the descent, and the
    landing.
    """
    frame = _RELATIVE if flag(entry, "altitudesAreRelative", True, where, refuse) else _ABSOLUTE
    approach_name = next(
        (n for n in ("landingApproachCoordinate", "loiterCoordinate") if n in entry),
        "landingApproachCoordinate",
    )
    approach = numbers(entry.get(approach_name), 3, f"{where}, {approach_name}", refuse)
    land = numbers(entry.get("landCoordinate"), 3, f"{where}, landCoordinate", refuse)
    items = [MissionItem(command=document.DO_LAND_START, frame=2)]
    if flag(entry, "useLoiterToAlt", True, where, refuse):
        radius_m = number(entry, "loiterRadius", where, refuse)
        clockwise = flag(entry, "loiterClockwise", True, where, refuse)
        items.append(
            MissionItem(
                command=document.NAV_LOITER_TO_ALT,
                frame=frame,
                param1=1.0,  # leave the circle only in the direction of the landing
                param2=radius_m if clockwise else -radius_m,
                param4=1.0,  # the line to the landing begins where the circle is left
                x=approach[0],
                y=approach[1],
                z=approach[2],
            )
        )
    else:
        items.append(
            MissionItem(
                command=document.NAV_WAYPOINT,
                frame=frame,
                param4=math.nan,
                x=approach[0],
                y=approach[1],
                z=approach[2],
            )
        )
    if flag(entry, "stopTakingPhotos", False, where, refuse):
        items.append(MissionItem(command=_STOP_PHOTOS, frame=2))
    if flag(entry, "stopVideoPhotos", False, where, refuse):
        items.append(MissionItem(command=_STOP_VIDEO, frame=2))
    items.append(
        MissionItem(command=document.NAV_LAND, frame=frame, param4=math.nan, x=land[0], y=land[1], z=land[2])
    )
    return items
