"""The geofence: a cylinder around home, and the polygons and circles of the uploaded fence plan.

Plan items as in the MAVLink mission protocol (MAV_MISSION_TYPE_FENCE): vertices of one polygon follow each
other and carry their number in param1; circles carry the radius in param1.
"""

import math
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.commander.geofence_parameters import FenceParameters, FenceType
from autopilot_bridge.geodesy import LocalFrame
from autopilot_bridge.mission_plan import MissionItem, MissionStore

RETURN_POINT: Final = 5000
POLYGON_INCLUSION: Final = 5001
POLYGON_EXCLUSION: Final = 5002
CIRCLE_INCLUSION: Final = 5003
CIRCLE_EXCLUSION: Final = 5004

Point = tuple[float, float]
Place = tuple[float, float, float]


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

    __slots__ = ("_frame", "_plan", "_return_point", "_shapes", "_version")

    def __init__(self, plan: MissionStore) -> None:
        self._plan = plan
        self._version = -1
        self._frame: LocalFrame | None = None
        self._shapes: tuple[_Polygon | _Circle, ...] = ()
        self._return_point: Point | None = None

    @property
    def uploaded(self) -> bool:
        """There is a fence plan."""
        return bool(self._plan.items)

    @property
    def version(self) -> int:
        """Changes with every upload."""
        return self._plan.version

    def return_point(self, frame: LocalFrame) -> Point | None:
        """Where ArduPlane goes back to: the plan's return point, else the middle of its first inclusion."""
        self._compile(frame)
        if self._return_point is not None:
            return self._return_point
        for shape in self._shapes:
            if not shape.inclusion:
                continue
            if isinstance(shape, _Circle):
                return shape.centre
            count = len(shape.vertices)
            return (
                sum(vertex[0] for vertex in shape.vertices) / count,
                sum(vertex[1] for vertex in shape.vertices) / count,
            )
        return None

    def broken(
        self,
        place_ned_m: Place,
        home_ned_m: Place | None,
        frame: LocalFrame | None,
        parameters: FenceParameters,
        walls: FenceType,
    ) -> FenceType:
        """Which of `walls` a place is outside of; none for a place that is not known.

        Every exclusion shape must be kept out of; of several inclusion shapes one is enough, or all must be
        kept, as the parameters say.
        """
        north_m, east_m, down_m = place_ned_m
        broken = FenceType(0)
        if not (math.isfinite(north_m) and math.isfinite(east_m) and math.isfinite(down_m)):
            return broken
        if home_ned_m is not None:
            height_m = home_ned_m[2] - down_m
            distance_m = math.hypot(north_m - home_ned_m[0], east_m - home_ned_m[1])
            if FenceType.CIRCLE in walls and 0.0 < parameters.radius_m < distance_m:
                broken |= FenceType.CIRCLE
            if FenceType.HEIGHT_MAX in walls and 0.0 < parameters.height_max_m < height_m:
                broken |= FenceType.HEIGHT_MAX
            if FenceType.HEIGHT_MIN in walls and parameters.floor and height_m < parameters.height_min_m:
                broken |= FenceType.HEIGHT_MIN
        if FenceType.SHAPES in walls and parameters.shapes and frame is not None:
            self._compile(frame)
            if self._outside_shapes((north_m, east_m), join=parameters.inclusions_join):
                broken |= FenceType.SHAPES
        return broken

    def _outside_shapes(self, point: Point, *, join: bool) -> bool:
        if not self._shapes:
            return False
        kept = [shape.allows(point) for shape in self._shapes if shape.inclusion]
        if kept and not (any(kept) if join else all(kept)):
            return True
        return any(not shape.allows(point) for shape in self._shapes if not shape.inclusion)

    def _compile(self, frame: LocalFrame) -> None:
        if self._version == self._plan.version and self._frame is frame:
            return
        self._version, self._frame = self._plan.version, frame
        self._return_point = None
        shapes: list[_Polygon | _Circle] = []
        pending: list[MissionItem] = []
        for item in self._plan.items:
            if item.command == RETURN_POINT:
                self._return_point = _local(item, frame)
            elif item.command in (CIRCLE_INCLUSION, CIRCLE_EXCLUSION):
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
