"""Whether places lie inside a geofence."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from autopilot_bridge.geodesy import GeodeticPosition, LocalFrame
from autopilot_bridge.mission_plan import MissionItem

_VERTEX_IN, _VERTEX_OUT, _CIRCLE_IN, _CIRCLE_OUT = 5001, 5002, 5003, 5004
_STEP_M: Final = 5.0

Point = tuple[float, float]
"""North and east of home, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Area:
    """A polygon, or a circle around its only corner.

    Attributes:
        corners: of a polygon; or the centre.
        radius_m: of a circle; 0: a polygon.
        inclusion: to stay in, not out of.
    """

    corners: tuple[Point, ...]
    radius_m: float
    inclusion: bool

    def contains(self, point: Point) -> bool:
        """Whether a point is in it."""
        if self.radius_m > 0.0:
            return math.dist(point, self.corners[0]) <= self.radius_m
        inside = False
        for (n1, e1), (n2, e2) in pairwise((*self.corners, self.corners[0])):
            if (e1 > point[1]) != (e2 > point[1]):
                crossing = n1 + (point[1] - e1) / (e2 - e1) * (n2 - n1)
                inside ^= point[0] < crossing
        return inside


def areas(items: Sequence[MissionItem], home: GeodeticPosition) -> list[Area]:
    """The areas that fence items describe; what is none is left out."""
    frame = LocalFrame(home)
    found: list[Area] = []
    k = 0
    while k < len(items):
        item = items[k]
        count = 1
        if item.command in (_VERTEX_IN, _VERTEX_OUT):
            count = max(1, int(item.param1))
            corners = tuple(_point(frame, home, i) for i in items[k : k + count])
            if len(corners) >= 3:
                inclusion = item.command == _VERTEX_IN
                found.append(Area(corners=corners, radius_m=0.0, inclusion=inclusion))
        elif item.command in (_CIRCLE_IN, _CIRCLE_OUT):
            found.append(
                Area(
                    corners=(_point(frame, home, item),),
                    radius_m=item.param1,
                    inclusion=item.command == _CIRCLE_IN,
                )
            )
        k += count
    return found


def _point(frame: LocalFrame, home: GeodeticPosition, item: MissionItem) -> Point:
    north, east, _ = frame.ned_from_geodetic(item.x, item.y, home.alt_m)
    return north, east


def first_outside(fence: Sequence[Area], way: Iterable[Point]) -> Point | None:
    """The first point of a way (straight between its points) that a fence forbids; None: it is all inside.

    Inside means: in all areas to stay in, and in none to stay out of.
    """
    last: Point | None = None
    for point in way:
        steps = 1 if last is None else max(1, math.ceil(math.dist(last, point) / _STEP_M))
        for k in range(1, steps + 1):
            f = k / steps
            here = point if last is None else (
                last[0] + f * (point[0] - last[0]), last[1] + f * (point[1] - last[1])
            )  # fmt: skip
            if any(area.contains(here) != area.inclusion for area in fence):
                return here
        last = point
    return None
