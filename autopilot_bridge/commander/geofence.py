"""The geofence: a cylinder around home, and the polygons and circles of the uploaded fence plan."""

import math

from autopilot_bridge.commander.geofence_parameters import FenceParameters, FenceType
from autopilot_bridge.fence_shapes import (
    RETURN_POINT,
    FenceCircle,
    FenceShape,
    fence_point,
    fence_shapes,
    outside_shapes,
)
from autopilot_bridge.mission_plan import MissionStore
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.geodetic_position import NorthEast
from flightsim.foundation.vectors import Vector


class Geofence:
    """Decides whether a position is outside. Invalid shapes of a plan are ignored one by one.

    Args:
        plan: the store of the uploaded fence.
    """

    def __init__(self, plan: MissionStore) -> None:
        self._plan = plan
        self._version = -1
        self._frame: LocalFrame | None = None
        self._shapes: tuple[FenceShape, ...] = ()
        self._return_point: NorthEast | None = None

    @property
    def uploaded(self) -> bool:
        """There is a fence plan."""
        return bool(self._plan.items)

    @property
    def version(self) -> int:
        """Changes with every upload."""
        return self._plan.version

    def return_point(self, frame: LocalFrame) -> NorthEast | None:
        """ArduPlane's return point: that of the plan, else the centre of its first inclusion."""
        self._compile(frame, unwrapped=False)
        if self._return_point is not None:
            return self._return_point
        for shape in self._shapes:
            if not shape.inclusion:
                continue
            if isinstance(shape, FenceCircle):
                return shape.centre
            count = len(shape.vertices)
            return (
                sum(vertex[0] for vertex in shape.vertices) / count,
                sum(vertex[1] for vertex in shape.vertices) / count,
            )
        return None

    def broken(
        self,
        place_ned_m: Vector,
        home_ned_m: Vector | None,
        frame: LocalFrame | None,
        parameters: FenceParameters,
        walls: FenceType,
    ) -> FenceType:
        """The walls among `walls` that a position is outside of; none for an unknown position.

        A position must be outside every exclusion shape; it must be inside one or inside all of the inclusion
        shapes, as the parameters define.
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
            self._compile(frame, unwrapped=parameters.unwrapped)
            if outside_shapes(self._shapes, (north_m, east_m), join=parameters.inclusions_join):
                broken |= FenceType.SHAPES
        return broken

    def _compile(self, frame: LocalFrame, *, unwrapped: bool) -> None:
        if self._version == self._plan.version and self._frame is frame:
            return
        self._version, self._frame = self._plan.version, frame
        self._shapes = fence_shapes(self._plan.items, frame, unwrapped=unwrapped)
        returns = [item for item in self._plan.items if item.command == RETURN_POINT]
        self._return_point = fence_point(returns[-1], frame) if returns else None
