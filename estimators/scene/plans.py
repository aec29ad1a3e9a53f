"""Plans and fences as lines of a scene, from the items on their way to a vehicle."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.fence_shapes import FenceCircle, FenceShape, fence_shapes
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.mission_wire import RELATIVE_FRAMES, TERRAIN_FRAMES, is_geodetic, item_from_int
from estimators import wire
from estimators.scene_items import Entry, Line, PointSet, Role
from flightsim.foundation.geodesy import LocalFrame

__all__ = ["ReceivedPlans"]

_MOST_ITEMS: Final = 10_000
_NAV_COMMANDS: Final = range(dialect.MAV_CMD_NAV_WAYPOINT, dialect.MAV_CMD_NAV_LAST)


class ReceivedPlans:
    """Collects the items of each vehicle's plans. A plan has entries when it is complete; where its size was
    not received (MISSION_COUNT), with each item.
    """

    def __init__(self) -> None:
        self._items: dict[tuple[int, int], dict[int, MissionItem]] = {}
        self._counts: dict[tuple[int, int], int] = {}

    def count(self, system_id: int, message: wire.MISSION_COUNT) -> None:
        """A plan of this size follows."""
        self._counts[system_id, message.mission_type] = message.count

    def take(
        self, system_id: int, time_us: int, message: wire.MISSION_ITEM_INT, frame: LocalFrame
    ) -> list[Entry]:
        """Entries of the plan that an item belongs to, as far as its items were received in order.

        Args:
            system_id: of the vehicle.
            time_us: of the entries.
            message: the item.
            frame: of the scene.
        """
        items = self._items.setdefault((system_id, message.mission_type), {})
        if message.seq == 0:
            items.clear()
        if message.seq != len(items) or len(items) >= _MOST_ITEMS:
            return []
        items[message.seq] = item_from_int(message)
        if len(items) < self._counts.get((system_id, message.mission_type), 0):
            return []
        base, known = f"vehicles/{system_id}", list(items.values())
        if message.mission_type == MissionType.MISSION:
            return _plan(base, time_us, known, frame)
        if message.mission_type == MissionType.FENCE:
            return [
                Entry(f"{base}/fence/{number}", time_us, _outline(shape))
                for number, shape in enumerate(fence_shapes(known, frame))
            ]
        return []


def _plan(base: str, time_us: int, items: Sequence[MissionItem], frame: LocalFrame) -> list[Entry]:
    places = []
    for item in items:
        if item.command not in _NAV_COMMANDS or not is_geodetic(item) or (item.x == 0.0 and item.y == 0.0):
            continue
        if not math.isfinite(item.x + item.y + item.z):
            continue
        above_home = item.frame in RELATIVE_FRAMES | TERRAIN_FRAMES
        alt_m = item.z + (frame.origin.alt_m if above_home else 0.0)
        places.append(frame.ned_from_geodetic(item.x, item.y, alt_m))
    if not places:
        return []
    points = np.array(places)
    return [
        Entry(f"{base}/plan", time_us, Line(points_ned_m=points)),
        Entry(f"{base}/waypoints", time_us, PointSet(points_ned_m=points, role=Role.COMMANDED)),
    ]


def _outline(shape: FenceShape) -> Line:
    label = "fence" if shape.inclusion else "fence: keep out"
    if isinstance(shape, FenceCircle):
        north_m, east_m = shape.centre
        return Line.circle((north_m, east_m, 0.0), shape.radius_m, role=Role.FENCE, label=label)
    points = _on_ground(shape.vertices)
    return Line(points_ned_m=points, closed=True, role=Role.FENCE, label=label)


def _on_ground(vertices: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
    return np.array([(north_m, east_m, 0.0) for north_m, east_m in vertices], dtype=np.float64)
