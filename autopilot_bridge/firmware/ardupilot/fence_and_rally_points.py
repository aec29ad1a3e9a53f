"""Fence and rally points in the messages of old ground stations: FENCE_POINT and RALLY_POINT (ArduPilot).

A parameter sets the number of points (FENCE_TOTAL, RALLY_TOTAL; a smaller number removes points), then every
point is sent, then read back. A fence is its return point and one inclusion polygon, whose first vertex is
repeated at the end. The points are collected outside the plan, which is replaced when all have been received.
Source: ArduPilot 4.6 (AC_PolyFence_loader, GCS_Rally), the last release that accepts them.
"""

import math
from collections.abc import Mapping
from typing import Final, get_args

from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import degrees, e7
from autopilot_bridge.mission_plan import MissionItem, MissionStore, MissionType
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Announce, Source
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.plans.messages import plan_checksum

FENCE_TOTAL: Final = "FENCE_TOTAL"
RALLY_TOTAL: Final = "RALLY_TOTAL"
_LEAST_FENCE: Final = 5  # return point, three vertices, and the first vertex again
_WARNING: Final = dialect.MAV_SEVERITY_WARNING
_INFO: Final = dialect.MAV_SEVERITY_INFO
_OldMessage = (
    dialect.MAVLink_fence_point_message
    | dialect.MAVLink_fence_fetch_point_message
    | dialect.MAVLink_rally_point_message
    | dialect.MAVLink_rally_fetch_point_message
)
_RETURN_POINT: Final = dialect.MAV_CMD_NAV_FENCE_RETURN_POINT
_VERTEX: Final = dialect.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION

LatLon = tuple[float, float]


def old_fence(items: tuple[MissionItem, ...]) -> list[LatLon] | None:
    """A fence as points of the old messages; None for a fence that these messages can't represent."""
    head = [item for item in items if item.command == _RETURN_POINT]
    ring = [item for item in items if item.command == _VERTEX]
    if not ring or len(head) > 1 or len(head) + len(ring) != len(items) or len(ring) != ring[0].param1:
        return None
    back = (head[0].x, head[0].y) if head else (0.0, 0.0)
    vertices = [(item.x, item.y) for item in ring]
    return [back, *vertices, vertices[0]]


class OldPoints(Microservice):
    """FENCE_POINT, FENCE_FETCH_POINT, RALLY_POINT and RALLY_FETCH_POINT.

    Args:
        parameters: contain the totals.
        stores: the plans.
        announce: sends a STATUSTEXT.
    """

    coarse_timers = True

    def __init__(
        self, parameters: ParameterStore, stores: Mapping[MissionType, MissionStore], announce: Announce
    ) -> None:
        self._parameters = parameters
        self._fence = stores[MissionType.FENCE]
        self._rally = stores[MissionType.RALLY]
        self._announce = announce
        self._fence_points: dict[int, LatLon] = {}
        self._rally_points: dict[int, MissionItem] = {}
        self._warned: set[str] = set()
        self._versions = [0, 0]
        parameters.subscribe(self._on_parameter)

    @receives(*get_args(_OldMessage))
    def _on_point(self, message: _OldMessage, source: Source, time_us: int) -> None:
        name = message.get_type()
        if name not in self._warned:
            self._warned.add(name)
            self._announce(_INFO, f"Received message ({name}) is deprecated")
        match message:
            case dialect.MAVLink_fence_point_message():
                self._take_fence_point(message)
            case dialect.MAVLink_fence_fetch_point_message():
                self._send_fence_point(message.idx, source)
            case dialect.MAVLink_rally_point_message():
                self._take_rally_point(message)
            case dialect.MAVLink_rally_fetch_point_message():
                self._send_rally_point(message.idx, source)

    def tick(self, time_us: int) -> None:
        """Update the totals after an upload by the mission protocol."""
        versions = [self._fence.version, self._rally.version]
        if versions == self._versions:
            return
        self._versions = versions
        points = old_fence(self._fence.items)
        fence = len(self._fence.items) if points is None else len(points)
        for name, count in ((FENCE_TOTAL, fence), (RALLY_TOTAL, len(self._rally.items))):
            if name in self._parameters:
                self._parameters.set(name, min(count, 127), check_range=False)

    def _total(self, name: str) -> int:
        return int(self._parameters.get(name)) if name in self._parameters else 0

    def _on_parameter(self, name: str, value: float) -> None:
        """A smaller total: a ground station removes points before it sends others."""
        if name == FENCE_TOTAL:
            self._fence_points.clear()
            if value == 0.0 and self._fence.items:
                self._store(self._fence, MissionType.FENCE, ())
        elif name == RALLY_TOTAL:
            self._rally_points.clear()
            if 0.0 <= value < min(len(self._rally.items), 127):
                self._store(self._rally, MissionType.RALLY, self._rally.items[: int(value)])

    # fence

    def _take_fence_point(self, message: dialect.MAVLink_fence_point_message) -> None:
        total = self._total(FENCE_TOTAL)
        if 0 < total < _LEAST_FENCE:
            self._announce(_WARNING, "Invalid FENCE_TOTAL")
        elif message.count != total:
            self._announce(_WARNING, f"Invalid fence point, bad count ({message.count} vs {total})")
        elif message.idx >= total:
            self._announce(_WARNING, f"Invalid fence point, index past total ({message.idx} >= {total})")
        elif not (abs(message.lat) <= 90.0 and abs(message.lng) <= 180.0):
            self._announce(_WARNING, "Invalid fence point, bad lat or lng")
        else:
            self._fence_points[message.idx] = (float(message.lat), float(message.lng))
            if len(self._fence_points) == total:
                self._finish_fence([self._fence_points[k] for k in range(total)])

    def _finish_fence(self, points: list[LatLon]) -> None:
        self._fence_points.clear()
        ring = points[1:-1]
        if points[-1] != points[1]:
            self._announce(_WARNING, "Invalid fence point, the polygon is not closed")
            return
        back = points[0]
        items = [
            MissionItem(command=_VERTEX, frame=0, param1=float(len(ring)), x=lat, y=lon) for lat, lon in ring
        ]
        if back != (0.0, 0.0):
            items.insert(0, MissionItem(command=_RETURN_POINT, frame=0, x=back[0], y=back[1]))
        self._store(self._fence, MissionType.FENCE, tuple(items))

    def _send_fence_point(self, index: int, source: Source) -> None:
        points = old_fence(self._fence.items) if self._fence.items else []
        if points is None:
            self._announce(_WARNING, "Vehicle contains advanced fences")
        elif index >= len(points):
            self._announce(_WARNING, f"Invalid fence point, index past total({index} >= {len(points)})")
        else:
            lat, lon = points[index]
            source.channel.send(
                dialect.MAVLink_fence_point_message(
                    source.system_id, source.component_id, index, len(points), lat, lon
                )
            )

    # rally points

    def _take_rally_point(self, message: dialect.MAVLink_rally_point_message) -> None:
        total = self._total(RALLY_TOTAL)
        lat, lon = degrees(message.lat), degrees(message.lng)
        if message.idx >= total:
            self._announce(_WARNING, "Bad rally point message ID")
        elif message.count != total:
            self._announce(_WARNING, "Bad rally point message count")
        elif not (abs(lat) <= 90.0 and abs(lon) <= 180.0):
            self._announce(_WARNING, "Bad rally point message lat or lng")
        else:
            self._rally_points[message.idx] = MissionItem(
                command=dialect.MAV_CMD_NAV_RALLY_POINT, frame=3, x=lat, y=lon, z=float(message.alt)
            )
            if len(self._rally_points) == total:
                items = tuple(self._rally_points[k] for k in range(total))
                self._rally_points.clear()
                self._store(self._rally, MissionType.RALLY, items)

    def _send_rally_point(self, index: int, source: Source) -> None:
        items = self._rally.items
        if index >= len(items):
            self._announce(_WARNING, "Bad rally point ID")
            return
        item = items[index]
        source.channel.send(
            dialect.MAVLink_rally_point_message(
                source.system_id,
                source.component_id,
                index,
                min(len(items), 255),
                e7(item.x),
                e7(item.y),
                max(-32768, min(32767, round(item.z))) if math.isfinite(item.z) else 0,
                0,
                0,
                0,
            )
        )

    def _store(self, store: MissionStore, kind: MissionType, items: tuple[MissionItem, ...]) -> None:
        store.replace(items, plan_checksum(items, kind))
