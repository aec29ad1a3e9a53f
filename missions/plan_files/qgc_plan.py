"""QGroundControl's `.plan` (JSON, version 1): mission, geofence, rally points, home and speeds."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from autopilot_bridge.fence_shapes import (
    CIRCLE_EXCLUSION,
    CIRCLE_INCLUSION,
    POLYGON_EXCLUSION,
    POLYGON_INCLUSION,
    RETURN_POINT,
)
from autopilot_bridge.mavlink import dialect, enum_name
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.documents import read_json
from flightsim.foundation.file_content import FileError
from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import PlanError
from missions.kind import KIND_OF_TYPE, VehicleKind
from missions.plan_files.complex_items import landing_items, simple_items
from missions.plan_files.document import DO_JUMP, INT_FRAMES, PLAIN_FRAMES, MissionDocument, PlannedHome
from missions.plan_files.json_values import (
    Refuse,
    entries,
    flag,
    is_number,
    mapping,
    number,
    numbers,
    shown,
    whole,
)

_PX4: Final = 12
_ARDUPILOT: Final = 3
_FIRMWARE: Final = {_PX4: "px4", _ARDUPILOT: "ardupilot"}
_ABOVE_TERRAIN: Final = 3  # AltitudeMode: the ground station adds the terrain's height to the altitude
_RALLY: Final = 5100  # NAV_RALLY_POINT


def read_plan(path: Path) -> MissionDocument:
    """Read a plan file.

    Raises:
        PlanError: the file can't be read or is not a plan; the message names the place in the file.
    """

    def refuse(where: str, why: str) -> PlanError:
        return PlanError(f"{path}: {where}: {why}")

    plan = mapping(_load(path), "the file", refuse)
    if plan.get("fileType") != "Plan":
        raise PlanError(
            f"{path}: fileType is {shown(plan.get('fileType'))}; accepted: 'Plan', of QGroundControl"
        )
    if plan.get("version") != 1:
        raise PlanError(f"{path}: version {shown(plan.get('version'))} of the format; accepted: 1")
    mission = mapping(plan.get("mission"), "mission", refuse)
    if mission.get("version") != 2:
        raise PlanError(f"{path}: version {shown(mission.get('version'))} of its mission; accepted: 2")
    firmware_type = _firmware_type(mission, refuse)
    return MissionDocument(
        path=path,
        items=_mission_items(mission, refuse),
        fence=_fence_items(mapping(plan.get("geoFence", {}), "geoFence", refuse), refuse),
        rally=_rally_items(mapping(plan.get("rallyPoints", {}), "rallyPoints", refuse), refuse),
        home=_home(mission, refuse),
        zero_is_here=firmware_type == _ARDUPILOT,
        kind=_kind(mission, path),
        firmware=_FIRMWARE.get(firmware_type),
        cruise_speed_m_s=_speed(mission, "cruiseSpeed", refuse),
        hover_speed_m_s=_speed(mission, "hoverSpeed", refuse),
    )


def _home(mission: Mapping[str, Any], refuse: Refuse) -> PlannedHome | None:
    """The planned home; None where there is none, or zeros or null stand for an unknown place. The altitude
    is null where the ground station knows no terrain.
    """
    where = "plannedHomePosition"
    values = mission.get(where)
    if values is None:
        return None
    if isinstance(values, list) and len(values) == 3 and values[2] is None:
        if values[:2] == [None, None]:
            return None
        (lat, lon), alt = numbers(values[:2], 2, where, refuse), None
    else:
        lat, lon, alt = numbers(values, 3, where, refuse)
    if not (abs(lat) <= 90.0 and abs(lon) <= 180.0 and (alt is None or math.isfinite(alt))):
        raise refuse(where, f"{lat!r}, {lon!r}, {alt!r} is no place")
    return None if lat == lon == 0.0 else PlannedHome(lat_deg=lat, lon_deg=lon, alt_m=alt)


def _load(path: Path) -> Any:
    try:
        return read_json(path)
    except FileError as error:
        raise PlanError(f"mission file {error}") from None


def _firmware_type(mission: Mapping[str, Any], refuse: Refuse) -> int:
    """MAV_AUTOPILOT; 0: any."""
    if mission.get("firmwareType") is None:
        return 0
    return whole(mission, "firmwareType", "mission", refuse)


def _kind(mission: Mapping[str, Any], path: Path) -> VehicleKind | None:
    type_ = mission.get("vehicleType")
    if type_ is None or type_ == 0:
        return None
    kind = KIND_OF_TYPE.get(type_) if isinstance(type_, int) else None
    if kind is None:
        name = enum_name("MAV_TYPE", type_) if isinstance(type_, int) else None
        raise PlanError(
            f"{path}: vehicleType {shown(type_)}{f' (MAV_TYPE_{name})' if name else ''} can't be flown; "
            "accepted: multicopters and fixed wings"
        )
    return kind


def _speed(mission: Mapping[str, Any], name: str, refuse: Refuse) -> float | None:
    if mission.get(name) is None:
        return None
    speed_m_s = number(mission, name, "mission", refuse)
    return speed_m_s if 0.0 < speed_m_s < math.inf else None


def _mission_items(mission: Mapping[str, Any], refuse: Refuse) -> tuple[MissionItem, ...]:
    items: list[MissionItem] = []
    index_of_id: dict[int, int] = {}
    for place, raw in enumerate(entries(mission.get("items"), "mission.items", refuse), start=1):
        where = f"item {place} of the plan"
        entry = mapping(raw, where, refuse)
        if entry.get("type") == "SimpleItem":
            _note_id(entry, len(items), index_of_id)
            items.append(_simple(entry, where, refuse))
        elif entry.get("type") != "ComplexItem":
            raise refuse(where, f"type {shown(entry.get('type'))}; accepted: SimpleItem and ComplexItem")
        elif entry.get("complexItemType") == "fwLandingPattern":
            items += landing_items(entry, where, refuse)
        elif entry.get("complexItemType") == "vtolLandingPattern":
            raise refuse(where, "a landing pattern for a VTOL vehicle, which can't be flown here")
        else:
            for inner_where, inner in simple_items(entry, where, refuse):
                _note_id(inner, len(items), index_of_id)
                items.append(_simple(inner, inner_where, refuse))
    return tuple(_with_index(item, index_of_id, k, refuse) for k, item in enumerate(items))


def _note_id(entry: Mapping[str, Any], index: int, index_of_id: dict[int, int]) -> None:
    jump_id = entry.get("doJumpId")
    if isinstance(jump_id, int):
        index_of_id.setdefault(jump_id, index)


def _with_index(item: MissionItem, index_of_id: Mapping[int, int], index: int, refuse: Refuse) -> MissionItem:
    """A jump whose target is an index instead of a doJumpId."""
    if item.command != DO_JUMP:
        return item
    target = index_of_id.get(int(item.param1)) if math.isfinite(item.param1) else None
    if target is None:
        raise refuse(f"item {index + 1} (DO_JUMP)", f"there is no item with doJumpId {item.param1:g}")
    return replace(item, param1=float(target))


def _simple(entry: Mapping[str, Any], where: str, refuse: Refuse) -> MissionItem:
    params = entry.get("params")
    if not (isinstance(params, list) and len(params) == 7):
        raise refuse(where, "params is not an array of 7 values")
    values = []
    for name, value in zip(("1", "2", "3", "4", "5", "6", "7"), params, strict=True):
        if value is not None and not is_number(value):
            raise refuse(where, f"params[{name}] = {shown(value)} is neither a number nor null")
        values.append(math.nan if value is None else float(value))
    if params[6] is None:
        values[6] = _altitude_m(entry, where, refuse)
    frame = whole(entry, "frame", where, refuse)
    command = whole(entry, "command", where, refuse)
    if frame > 255 or command > 65535:
        raise refuse(where, f"frame {frame}, command {command}; accepted: a MAV_FRAME and a MAV_CMD")
    return MissionItem(
        command=command,
        frame=INT_FRAMES.get(frame, frame),
        param1=values[0],
        param2=values[1],
        param3=values[2],
        param4=values[3],
        x=values[4],
        y=values[5],
        z=values[6],
        autocontinue=flag(entry, "autoContinue", True, where, refuse),
    )


def _altitude_m(entry: Mapping[str, Any], where: str, refuse: Refuse) -> float:
    """The altitude of an item without one in its params: what the user has set, in the item's frame; NaN: it
    has none. An altitude above a terrain that the ground station did not know is refused.
    """
    altitude_m = entry.get("Altitude")
    if not is_number(altitude_m):
        return math.nan
    if entry.get("AltitudeMode") == _ABOVE_TERRAIN:
        raise refuse(
            where,
            f"altitude {altitude_m:g} m above a terrain that the ground station did not know (AltitudeMode "
            f"{_ABOVE_TERRAIN}, params[7] null); open and save the plan where it has terrain data, or choose "
            "altitudes above home",
        )
    return number(entry, "Altitude", where, refuse)


def _fence_items(fence: Mapping[str, Any], refuse: Refuse) -> tuple[MissionItem, ...]:
    items: list[MissionItem] = []
    for number_, raw in enumerate(entries(fence.get("polygons", []), "geoFence.polygons", refuse), start=1):
        where = f"geoFence, polygon {number_}"
        polygon = mapping(raw, where, refuse)
        points = [numbers(p, 2, where, refuse) for p in entries(polygon.get("polygon"), where, refuse)]
        command = POLYGON_INCLUSION if flag(polygon, "inclusion", True, where, refuse) else POLYGON_EXCLUSION
        items += [
            MissionItem(command=command, frame=0, param1=float(len(points)), x=lat, y=lon)
            for lat, lon in points
        ]
    for number_, raw in enumerate(entries(fence.get("circles", []), "geoFence.circles", refuse), start=1):
        where = f"geoFence, circle {number_}"
        entry = mapping(raw, where, refuse)
        circle = mapping(entry.get("circle"), where, refuse)
        lat, lon = numbers(circle.get("center"), 2, f"{where}, center", refuse)
        command = CIRCLE_INCLUSION if flag(entry, "inclusion", True, where, refuse) else CIRCLE_EXCLUSION
        radius_m = number(circle, "radius", where, refuse)
        items.append(MissionItem(command=command, frame=0, param1=radius_m, x=lat, y=lon))
    if fence.get("breachReturn"):
        lat, lon, alt = numbers(fence["breachReturn"], 3, "geoFence.breachReturn", refuse)
        items.append(MissionItem(command=RETURN_POINT, frame=3, x=lat, y=lon, z=alt))
    return tuple(items)


def _rally_items(rally: Mapping[str, Any], refuse: Refuse) -> tuple[MissionItem, ...]:
    items = []
    for number_, point in enumerate(entries(rally.get("points", []), "rallyPoints.points", refuse), start=1):
        lat, lon, alt = numbers(point, 3, f"rallyPoints, point {number_}", refuse)
        items.append(MissionItem(command=_RALLY, frame=3, x=lat, y=lon, z=alt))
    return tuple(items)


def format_plan(
    items: tuple[MissionItem, ...],
    home: GeodeticPosition,
    *,
    firmware: str,
    kind: VehicleKind,
    speed_m_s: float,
) -> str:
    """A mission as the text of a plan file."""
    wings = kind is VehicleKind.FIXED_WING
    simple = [_simple_entry(index, item) for index, item in enumerate(items)]
    plan = {
        "fileType": "Plan",
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "groundStation": "QGroundControl",
        "mission": {
            "cruiseSpeed": speed_m_s if wings else 15,
            "firmwareType": {name: number_ for number_, name in _FIRMWARE.items()}[firmware],
            "globalPlanAltitudeMode": 1,
            "hoverSpeed": 5 if wings else speed_m_s,
            "items": simple,
            "plannedHomePosition": [home.lat_deg, home.lon_deg, home.alt_m],
            "vehicleType": dialect.MAV_TYPE_FIXED_WING if wings else dialect.MAV_TYPE_QUADROTOR,
            "version": 2,
        },
        "rallyPoints": {"points": [], "version": 2},
        "version": 1,
    }
    return json.dumps(plan, indent=4, allow_nan=False) + "\n"


def _simple_entry(index: int, item: MissionItem) -> dict[str, Any]:
    if item.command == DO_JUMP:
        item = replace(item, param1=item.param1 + 1)
    numbers_ = (item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z)
    return {
        "autoContinue": item.autocontinue,
        "command": item.command,
        "doJumpId": index + 1,
        "frame": PLAIN_FRAMES.get(item.frame, item.frame),
        "params": [None if math.isnan(n) else n for n in numbers_],
        "type": "SimpleItem",
    }
