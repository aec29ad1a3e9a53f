"""The polygons and circles of a geofence plan, and whether positions are inside.

Plan items as in the MAVLink mission protocol (MAV_MISSION_TYPE_FENCE): vertices of one polygon follow each
other and carry their number in param1; circles carry the radius in param1.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.geodetic_position import NorthEast

RETURN_POINT: Final = 5000
POLYGON_INCLUSION: Final = 5001
POLYGON_EXCLUSION: Final = 5002
CIRCLE_INCLUSION: Final = 5003
CIRCLE_EXCLUSION: Final = 5004
"""MAV_CMD_NAV_FENCE_*."""


@dataclass(frozen=True, slots=True)
class FencePolygon:
    """A polygon to stay in (`inclusion`), or out of."""

    vertices: tuple[NorthEast, ...]
    inclusion: bool

    def allows(self, point: NorthEast) -> bool:
        """The shape allows a point."""
        return inside_polygon(point, self.vertices) == self.inclusion


@dataclass(frozen=True, slots=True)
class UnwrappedPolygon(FencePolygon):
    """A polygon across 180 degrees of longitude for an autopilot that compares longitudes without wrap: it
    covers the other way round the earth.

    Source: PX4 1.16.1, navigator/geofence.cpp, insidePolygon.
    """

    vertices_deg: tuple[tuple[float, float], ...]
    frame: LocalFrame

    def allows(self, point: NorthEast) -> bool:
        """The shape allows a point."""
        lat_deg, lon_deg, _ = self.frame.geodetic_from_ned(*point, 0.0)
        return inside_polygon((lat_deg, lon_deg), self.vertices_deg) == self.inclusion


@dataclass(frozen=True, slots=True)
class FenceCircle:
    """A circle to stay in (`inclusion`), or out of. Nothing is inside of a circle of radius 0."""

    centre: NorthEast
    radius_m: float
    inclusion: bool

    def allows(self, point: NorthEast) -> bool:
        """The shape allows a point."""
        return (math.dist(point, self.centre) < self.radius_m) == self.inclusion


FenceShape = FencePolygon | FenceCircle


def fence_shapes(
    items: Iterable[MissionItem], frame: LocalFrame, *, unwrapped: bool = False
) -> tuple[FenceShape, ...]:
    """The shapes that fence items describe; invalid shapes are left out one by one.

    Args:
        items: items of a fence plan.
        frame: of the points that are tested.
        unwrapped: the autopilot compares the longitudes of polygons without wrap (PX4).
    """
    shapes: list[FenceShape] = []
    pending: list[MissionItem] = []
    for item in items:
        if item.command in (CIRCLE_INCLUSION, CIRCLE_EXCLUSION):
            if math.isfinite(item.param1) and item.param1 >= 0.0:
                shapes.append(
                    FenceCircle(fence_point(item, frame), item.param1, item.command == CIRCLE_INCLUSION)
                )
        elif item.command in (POLYGON_INCLUSION, POLYGON_EXCLUSION):
            if pending and (item.command, item.param1) != (pending[0].command, pending[0].param1):
                pending = []
            pending.append(item)
            if len(pending) >= 3 and len(pending) == item.param1:
                shapes.append(_polygon(pending, frame, unwrapped=unwrapped))
                pending = []
    return tuple(shapes)


def _polygon(items: Sequence[MissionItem], frame: LocalFrame, *, unwrapped: bool) -> FencePolygon:
    vertices = tuple(fence_point(item, frame) for item in items)
    inclusion = items[0].command == POLYGON_INCLUSION
    lons_deg = [item.y for item in items]
    if not unwrapped or max(lons_deg) - min(lons_deg) <= 180.0:
        return FencePolygon(vertices, inclusion)
    return UnwrappedPolygon(vertices, inclusion, tuple((item.x, item.y) for item in items), frame)


def fence_point(item: MissionItem, frame: LocalFrame) -> NorthEast:
    """Position of a fence item."""
    north_m, east_m, _ = frame.ned_from_geodetic(item.x, item.y, frame.origin.alt_m)
    return north_m, east_m


def outside_shapes(shapes: tuple[FenceShape, ...], point: NorthEast, *, join: bool) -> bool:
    """Whether the shapes forbid a point.

    A point must be outside every exclusion shape.

    Args:
        join: being inside one inclusion shape is enough (PX4); else inside all (ArduPilot).
    """
    if not shapes:
        return False
    kept = [shape.allows(point) for shape in shapes if shape.inclusion]
    if kept and not (any(kept) if join else all(kept)):
        return True
    return any(not shape.allows(point) for shape in shapes if not shape.inclusion)


def inside_polygon(point: NorthEast, vertices: tuple[NorthEast, ...]) -> bool:
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
