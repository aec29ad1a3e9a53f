"""The path of an aircraft, for telemetry: the target position, a circle, the line to the position."""

import math
from typing import NamedTuple

from autopilot_bridge.flight.context import Array, FlightContext
from autopilot_bridge.flight.fixed_wing import (
    GuidedTask,
    LandTask,
    LoiterTask,
    MissionTask,
    ReturnTask,
    TakeoffTask,
)
from autopilot_bridge.flight.plan_reading import is_navigation, target_of
from autopilot_bridge.mission_plan import MissionStore


class FlightPath(NamedTuple):
    """The present leg, local NED metres.

    Attributes:
        north_m, east_m, down_m: the target position, or the centre of the circle.
        radius_m: of the circle, negative counter-clockwise; NaN: a position to fly to or past.
        from_north_m, from_east_m: where the line to the position begins; NaN: not known.
    """

    north_m: float
    east_m: float
    down_m: float
    radius_m: float = math.nan
    from_north_m: float = math.nan
    from_east_m: float = math.nan

    @property
    def circles(self) -> bool:
        """The path is a circle."""
        return math.isfinite(self.radius_m)

    def distance_m(self, north_m: float, east_m: float) -> float:
        """Horizontal distance from a position to the target position."""
        return math.hypot(self.north_m - north_m, self.east_m - east_m)

    def bearing_rad(self, north_m: float, east_m: float) -> float:
        """Bearing from a position to the target position, clockwise from north."""
        return math.atan2(self.east_m - east_m, self.north_m - north_m)

    def direction_rad(self, north_m: float, east_m: float) -> float:
        """Direction of the path: the tangent of a circle, else the bearing of the target position;
        -pi..pi.
        """
        bearing = self.bearing_rad(north_m, east_m)
        if not self.circles:
            return bearing
        return math.remainder(bearing - math.copysign(0.5 * math.pi, self.radius_m), 2.0 * math.pi)

    def track_error_m(self, north_m: float, east_m: float) -> float:
        """Distance from the path: from a circle positive outside, from a line positive right of it."""
        if self.circles:
            return self.distance_m(north_m, east_m) - abs(self.radius_m)
        along_north, along_east = self.north_m - self.from_north_m, self.east_m - self.from_east_m
        length_m = math.hypot(along_north, along_east)
        if not length_m > 0.0:
            return 0.0
        off_north, off_east = north_m - self.from_north_m, east_m - self.from_east_m
        return (along_north * off_east - along_east * off_north) / length_m

    def nearest_point(self, north_m: float, east_m: float) -> tuple[float, float]:
        """(north, east) of the path's point nearest to a position; the target position if the line is not
        known.
        """
        if self.circles:
            away_m = self.distance_m(north_m, east_m)
            if away_m == 0.0:
                return self.north_m, self.east_m
            share = abs(self.radius_m) / away_m
            return (
                self.north_m + (north_m - self.north_m) * share,
                self.east_m + (east_m - self.east_m) * share,
            )
        along_north, along_east = self.north_m - self.from_north_m, self.east_m - self.from_east_m
        square = along_north**2 + along_east**2
        if not square > 0.0:
            return self.north_m, self.east_m
        dot = (north_m - self.from_north_m) * along_north + (east_m - self.from_east_m) * along_east
        part = min(1.0, max(0.0, dot / square))
        return self.from_north_m + part * along_north, self.from_east_m + part * along_east


def flight_path(task: object, context: FlightContext, missions: MissionStore | None) -> FlightPath | None:
    """The path of a flight task; None for one without positions (sticks, attitudes, headings)."""
    # many times a second: `isinstance` of an abstract class takes longer
    while (type(task) is MissionTask or type(task) is ReturnTask) and task.sub_task is not None:
        task = task.sub_task
    if type(task) is MissionTask:
        return None if missions is None else _leg(context, missions)
    if isinstance(task, GuidedTask):
        task = task.circle
    if isinstance(task, LoiterTask):
        return _path(task.centre_ned_m, task.radius_m)
    if isinstance(task, TakeoffTask):
        return _path(task.place_ned_m)
    if isinstance(task, LandTask) and task.approach is not None:
        approach = task.approach
        entry_north_m, entry_east_m, _ = approach.entry_ned_m
        return FlightPath(
            approach.north_m,
            approach.east_m,
            approach.down_m,
            from_north_m=entry_north_m,
            from_east_m=entry_east_m,
        )
    return None


def _leg(context: FlightContext, missions: MissionStore) -> FlightPath | None:
    """The leg of a plan to its current item, from the last item with a position before it."""
    items, current = missions.items, missions.current
    if not 0 <= current < len(items):
        return None
    target = target_of(items[current], context)
    if target is None:
        return None
    for item in reversed(items[:current]):
        before = target_of(item, context) if is_navigation(item) else None
        if before is not None:
            north_m, east_m, _ = before.tolist()
            if math.isfinite(north_m) and math.isfinite(east_m):
                return _path(target, start=(north_m, east_m))
    return _path(target)


def _path(
    place: Array, radius_m: float = math.nan, start: tuple[float, float] = (math.nan, math.nan)
) -> FlightPath | None:
    north_m, east_m, down_m = place.tolist()
    if not (math.isfinite(north_m) and math.isfinite(east_m) and math.isfinite(down_m)):
        return None
    return FlightPath(north_m, east_m, down_m, radius_m, *start)
