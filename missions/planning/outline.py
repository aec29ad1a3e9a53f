"""The planned path and duration of a mission, as far as they are known before the flight."""

from dataclasses import dataclass

from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition


@dataclass(frozen=True, slots=True, kw_only=True)
class Outline:
    """The planned flight, for the checks before it.

    Attributes:
        points_ned_m: places on its path, from home.
        duration_s: duration of the flight without takeoff and landing; None: not known.
        plan_home: home of the plan; None: the vehicle's place.
        fence: geofence that the mission uploads; empty: the vehicle keeps its own.
    """

    points_ned_m: tuple[tuple[float, float, float], ...] = ()
    duration_s: float | None = None
    plan_home: GeodeticPosition | None = None
    fence: tuple[MissionItem, ...] = ()
