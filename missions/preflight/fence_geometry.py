"""Checks whether a path stays inside a geofence."""

import math
from collections.abc import Iterable
from typing import Final

from autopilot_bridge.fence_shapes import FenceShape, Point, outside_shapes

_STEP_M: Final = 5.0


def first_outside(shapes: tuple[FenceShape, ...], way: Iterable[Point], *, join: bool) -> Point | None:
    """The first point of a path (straight between its points) that a fence forbids; None: the whole path is
    inside.

    Args:
        shapes: shapes of the fence, north and east of home.
        way: points of the path, north and east of home, m.
        join: whether being inside one of several inclusion shapes is enough.
    """
    last: Point | None = None
    for point in way:
        start = point if last is None else last
        steps = 1 if last is None else max(1, math.ceil(math.dist(start, point) / _STEP_M))
        for k in range(1, steps + 1):
            f = k / steps
            here = (start[0] + f * (point[0] - start[0]), start[1] + f * (point[1] - start[1]))
            if outside_shapes(shapes, here, join=join):
                return here
        last = point
    return None
