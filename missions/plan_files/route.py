"""The route of a mission's items: places in the order in which they are flown."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.mission_wire import GLOBAL_FRAMES
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.plan_files.document import (
    DO_CHANGE_SPEED,
    LOITERS,
    NAV_DELAY,
    NAV_LAND,
    NAV_LOITER_TIME,
    NAV_LOITER_TURNS,
    NAV_SPLINE_WAYPOINT,
    NAV_TAKEOFF,
    NAV_WAYPOINT,
    MissionDocument,
)
from missions.plan_files.validation import has_place
from missions.vehicle.item_tracker import FlownOrder
from missions.vehicle.items import FLOWN_TO

_PATH_STEP_M: Final = 1.0
_LOITER_RADIUS_M: Final = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """One place of the route.

    Attributes:
        index: index of the mission item.
        command: MAV_CMD of the item.
        position_ned_m: position from home.
        speed_m_s: speed commanded for the leg to it; None: the vehicle's default.
        stay_s: time spent there, as far as the item specifies it.
    """

    index: int
    command: int
    position_ned_m: tuple[float, float, float]
    speed_m_s: float | None
    stay_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """All places in the flown order.

    Attributes:
        stops: places in the flown order; jumps repeat them.
        endless: whether a jump repeats forever (or more often than is followed).
    """

    stops: tuple[Stop, ...]
    endless: bool

    @property
    def length_m(self) -> float:
        """Length from the first place to the last."""
        return sum(math.dist(a.position_ned_m, b.position_ned_m) for a, b in pairwise(self.stops))

    def duration_s(self, own_speed_m_s: float) -> float:
        """Time for all legs and stays, without takeoff and landing."""
        legs = pairwise(self.stops)
        flown_s = sum(
            math.dist(a.position_ned_m, b.position_ned_m) / (b.speed_m_s or own_speed_m_s) for a, b in legs
        )
        return flown_s + sum(stop.stay_s for stop in self.stops)


def placed(items: Sequence[MissionItem], home: GeodeticPosition, unset: float) -> list[MissionItem]:
    """The items as sent to a vehicle: "here" is replaced by a place, and unset values by `unset`."""
    given: list[MissionItem] = []
    last = (home.lat_deg, home.lon_deg)
    for item in items:
        if item.command in FLOWN_TO:
            if not has_place(item):
                item = replace(item, x=last[0], y=last[1])
            last = (item.x, item.y)
        values: dict[str, Any] = {
            name: unset
            for name in ("param1", "param2", "param3", "param4", "z")
            if math.isnan(getattr(item, name))
        }
        given.append(replace(item, **values) if values else item)
    return given


def route_of(document: MissionDocument, home: GeodeticPosition) -> Route:
    """The route of the mission from a home. Jumps are followed as often as they specify."""
    items = placed(document.items, home, 0.0)
    frame = LocalFrame(home)
    order = FlownOrder.of(items)
    stops: list[Stop] = []
    speed_m_s: float | None = None
    for index in order.indices:
        item = items[index]
        if item.command == DO_CHANGE_SPEED and item.param2 > 0.0:
            speed_m_s = item.param2
        elif item.command == NAV_DELAY and stops:
            stops[-1] = replace(stops[-1], stay_s=stops[-1].stay_s + max(0.0, item.param1))
        elif item.command in FLOWN_TO:
            north, east, _ = frame.ned_from_geodetic(item.x, item.y, home.alt_m)
            height_m = item.z - home.alt_m if item.frame in GLOBAL_FRAMES else item.z
            stops.append(
                Stop(
                    index=index,
                    command=item.command,
                    position_ned_m=(north, east, -height_m),
                    speed_m_s=speed_m_s,
                    stay_s=_stay_s(item, speed_m_s),
                )
            )
    return Route(stops=tuple(stops), endless=order.endless)


def _stay_s(item: MissionItem, speed_m_s: float | None) -> float:
    if item.command in (NAV_WAYPOINT, NAV_LOITER_TIME):
        return min(max(0.0, item.param1), 86_400.0)
    if item.command == NAV_LOITER_TURNS:
        around_m = math.tau * (abs(item.param3) or _LOITER_RADIUS_M)
        return max(0.0, item.param1) * around_m / (speed_m_s or 10.0)
    return 0.0


def scored_stops(route: Route, *, with_takeoff: bool) -> tuple[Stop, ...]:
    """Places with which a track is compared: without landings, and without takeoffs along a runway."""
    left_out = {NAV_LAND} if with_takeoff else {NAV_LAND, NAV_TAKEOFF}
    return tuple(stop for stop in route.stops if stop.command not in left_out)


def straight(a: Stop, b: Stop) -> bool:
    """Whether the path from one place to the next is a line, not a circle or a spline."""
    return not {a.command, b.command} & LOITERS and b.command != NAV_SPLINE_WAYPOINT


def has_curves(stops: Sequence[Stop]) -> bool:
    """Whether the path between the first and the last place contains a circle or a spline."""
    splines = any(stop.command == NAV_SPLINE_WAYPOINT for stop in stops[1:])
    return splines or any(stop.command in LOITERS for stop in stops[:-1])


def path_ned_m(stops: Sequence[Stop]) -> NDArray[np.float64]:
    """The straight legs between places as points (n, 3), a metre apart."""
    points: list[NDArray[np.float64]] = []
    for a, b in pairwise(stops):
        start, stop = np.array(a.position_ned_m), np.array(b.position_ned_m)
        count = max(1, math.ceil(float(np.linalg.norm(stop - start)) / _PATH_STEP_M))
        points.append(start + np.arange(count)[:, None] / count * (stop - start))
    points.append(np.array([s.position_ned_m for s in stops[-1:]]).reshape(-1, 3))
    return np.concatenate(points)
