"""The geofence: a cylinder around home, and the polygons and circles of the uploaded fence plan.

Plan items as in the MAVLink mission protocol (MAV_MISSION_TYPE_FENCE): vertices of one polygon follow each
other and carry their number in param1; circles carry the radius in param1.
"""

import math
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.geodesy import LocalFrame
from autopilot_bridge.mission_plan import MissionItem, MissionStore

POLYGON_INCLUSION: Final = 5001
POLYGON_EXCLUSION: Final = 5002
CIRCLE_INCLUSION: Final = 5003
CIRCLE_EXCLUSION: Final = 5004

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class _Polygon:
    vertices: tuple[Point, ...]
    inclusion: bool

    def allows(self, point: Point) -> bool:
        return inside_polygon(point, self.vertices) == self.inclusion


@dataclass(frozen=True, slots=True)
class _Circle:
    centre: Point
    radius_m: float
    inclusion: bool

    def allows(self, point: Point) -> bool:
        return (math.dist(point, self.centre) <= self.radius_m) == self.inclusion


class Geofence:
    """Says whether a place is outside. Plans that make no sense are ignored, shape by shape.

    Args:
        plan: the store of the uploaded fence.
    """

    __slots__ = ("_frame", "_plan", "_shapes", "_version")

    def __init__(self, plan: MissionStore) -> None:
        self._plan = plan
        self._version = -1
        self._frame: LocalFrame | None = None
        self._shapes: tuple[_Polygon | _Circle, ...] = ()

    def breached(
        self,
        position_ned_m: tuple[float, float, float],
        home_ned_m: tuple[float, float, float] | None,
        frame: LocalFrame | None,
        parameters: CommanderParameters,
    ) -> bool:
        """True when the position is outside of what the parameters and the plan allow.

        An exclusion shape and the cylinder must each be kept; of several inclusion shapes one is enough.
        """
        north_m, east_m, down_m = position_ned_m
        if not (math.isfinite(north_m) and math.isfinite(east_m) and math.isfinite(down_m)):
            return False
        if home_ned_m is not None:
            distance_m = math.hypot(north_m - home_ned_m[0], east_m - home_ned_m[1])
            if 0.0 < parameters.fence_radius_m < distance_m:
                return True
            if 0.0 < parameters.fence_height_max_m < home_ned_m[2] - down_m:
                return True
        if not parameters.fence_polygons or frame is None:
            return False
        self._compile(frame)
        if not self._shapes:
            return False
        point = (north_m, east_m)
        inclusions = [shape for shape in self._shapes if shape.inclusion]
        if inclusions and not any(shape.allows(point) for shape in inclusions):
            return True
        return any(not shape.allows(point) for shape in self._shapes if not shape.inclusion)

    def _compile(self, frame: LocalFrame) -> None:
        if self._version == self._plan.version and self._frame is frame:
            return
        self._version, self._frame = self._plan.version, frame
        shapes: list[_Polygon | _Circle] = []
        pending: list[MissionItem] = []
        for item in self._plan.items:
            if item.command in (CIRCLE_INCLUSION, CIRCLE_EXCLUSION):
                if math.isfinite(item.param1) and item.param1 > 0.0:
                    shapes.append(_Circle(_local(item, frame), item.param1, item.command == CIRCLE_INCLUSION))
            elif item.command in (POLYGON_INCLUSION, POLYGON_EXCLUSION):
                if pending and (item.command, item.param1) != (pending[0].command, pending[0].param1):
                    pending = []
                pending.append(item)
                if len(pending) >= 3 and len(pending) == item.param1:
                    vertices = tuple(_local(vertex, frame) for vertex in pending)
                    shapes.append(_Polygon(vertices, item.command == POLYGON_INCLUSION))
                    pending = []
        self._shapes = tuple(shapes)


def inside_polygon(point: Point, vertices: tuple[Point, ...]) -> bool:
    """Even-odd rule: does a ray from the point cross an odd number of edges?"""
    north, east = point
    inside = False
    previous = vertices[-1]
    for vertex in vertices:
        if (vertex[0] > north) != (previous[0] > north):
            crossing = vertex[1] + (north - vertex[0]) * (previous[1] - vertex[1]) / (previous[0] - vertex[0])
            if east < crossing:
                inside = not inside
        previous = vertex
    return inside


def _local(item: MissionItem, frame: LocalFrame) -> Point:
    north_m, east_m, _ = frame.ned_from_geodetic(item.x, item.y, frame.origin.alt_m)
    return north_m, east_m
