"""Plan files made here, as QGroundControl writes them."""

import copy
import json
from pathlib import Path
from typing import Any

LAT, LON, ALT = 47.39774, 8.54559, 489.4


def simple(jump_id: int, command: int, params: list[float | None], frame: int = 3) -> dict[str, Any]:
    return {
        "autoContinue": True,
        "command": command,
        "doJumpId": jump_id,
        "frame": frame,
        "params": params,
        "type": "SimpleItem",
    }


def waypoint(jump_id: int, north: float, east: float, height_m: float) -> dict[str, Any]:
    return simple(jump_id, 16, [0, 0, 0, None, LAT + north, LON + east, height_m])


SURVEY = {
    "type": "ComplexItem",
    "complexItemType": "survey",
    "version": 5,
    "TransectStyleComplexItem": {
        "version": 2,
        "Items": [
            waypoint(4, 0.0, 6e-4, 20),
            simple(5, 206, [25, 0, 1, 0, 0, 0, 0], 2),
            waypoint(6, 0.0, 0.0, 20),
        ],
    },
}
LANDING = {
    "type": "ComplexItem",
    "complexItemType": "fwLandingPattern",
    "version": 2,
    "altitudesAreRelative": True,
    "landCoordinate": [LAT, LON, 0],
    "landingApproachCoordinate": [LAT - 0.0065, LON, 40],
    "loiterRadius": 80,
    "loiterClockwise": False,
    "useLoiterToAlt": True,
    "stopTakingPhotos": True,
    "stopVideoPhotos": False,
}
PLAN: dict[str, Any] = {
    "fileType": "Plan",
    "version": 1,
    "groundStation": "QGroundControl",
    "geoFence": {
        "version": 2,
        "circles": [{"circle": {"center": [LAT, LON], "radius": 300}, "inclusion": True, "version": 1}],
        "polygons": [
            {
                "polygon": [[LAT + 0.01, LON], [LAT + 0.011, LON], [LAT + 0.011, LON + 0.001]],
                "inclusion": False,
                "version": 1,
            }
        ],
    },
    "rallyPoints": {"version": 2, "points": [[LAT + 2e-4, LON, 20]]},
    "mission": {
        "version": 2,
        "cruiseSpeed": 15,
        "hoverSpeed": 5,
        "firmwareType": 12,
        "vehicleType": 2,
        "plannedHomePosition": [LAT, LON, ALT],
        "items": [
            simple(1, 22, [0, 0, 0, None, LAT, LON, 15]),
            waypoint(2, 5e-4, 0.0, 15),
            waypoint(3, 5e-4, 6e-4, 15),
            SURVEY,
            simple(7, 177, [3, 1, 0, 0, 0, 0, 0], 2),
            simple(8, 20, [0] * 7, 2),
        ],
    },
}


def write(folder: Path, plan: dict[str, Any] = PLAN, name: str = "a.plan") -> Path:
    path = folder / name
    path.write_text(json.dumps(plan))
    return path


def changed(*keys: str | int, to: Any) -> dict[str, Any]:
    """The plan with one value changed."""
    plan = copy.deepcopy(PLAN)
    inner: Any = plan
    for key in keys[:-1]:
        inner = inner[key]
    inner[keys[-1]] = to
    return plan
