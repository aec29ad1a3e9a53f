"""The planned path and duration of a mission, as far as they are known before the flight."""

from dataclasses import dataclass

from autopilot_bridge.geodesy import GeodeticPosition
from autopilot_bridge.mission_plan import MissionItem


@dataclass(frozen=True, slots=True, kw_only=True)
class Outline:
    """What is looked at before a flight.

    Attributes:
        points_ned_m: places it flies through, from home.
        duration_s: of the flight without takeoff and landing; None: not known.
        plan_home: where the plan begins; None: wherever the vehicle stands.
        fence: that the mission uploads; empty: the vehicle keeps its own.
    """

    points_ned_m: tuple[tuple[float, float, float], ...] = ()
    duration_s: float | None = None
    plan_home: GeodeticPosition | None = None
    fence: tuple[MissionItem, ...] = ()
