"""PX4's feasibility check: whether a stored mission may be flown.

An infeasible mission is stored and acknowledged, but mission mode and arming in it are refused. PX4 names the
reason by an EVENT; only of fences also by a text.

The premise of each rule is noted with it. MIS_DIST_1WP (distance to the first waypoint) only warns.

Source: PX4 1.16.1, navigator: MissionFeasibility/FeasibilityChecker.cpp, mission_feasibility_checker.cpp.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.mission_wire import GLOBAL_FRAMES, is_geodetic
from flightsim.foundation.firmware_frames import Px4Frame
from flightsim.foundation.geodesy import GeodeticPosition

PARAMETERS: Final[Mapping[str, float]] = MappingProxyType({"MIS_TKO_LAND_REQ": 0.0, "FW_LND_ANG": 5.0})
"""Parameters that the rules depend on, with the values that count where the vehicle does not have them."""

VTOL_COMMANDS: Final = frozenset(
    (dialect.MAV_CMD_NAV_VTOL_TAKEOFF, dialect.MAV_CMD_NAV_VTOL_LAND, dialect.MAV_CMD_DO_VTOL_TRANSITION)
)
_TAKEOFFS: Final = frozenset((dialect.MAV_CMD_NAV_TAKEOFF, dialect.MAV_CMD_NAV_VTOL_TAKEOFF))
_LANDINGS: Final = frozenset((dialect.MAV_CMD_NAV_LAND, dialect.MAV_CMD_NAV_VTOL_LAND))
_PLACED: Final = frozenset(
    (
        dialect.MAV_CMD_NAV_WAYPOINT,
        dialect.MAV_CMD_NAV_LOITER_UNLIM,
        dialect.MAV_CMD_NAV_LOITER_TIME,
        dialect.MAV_CMD_NAV_LOITER_TO_ALT,
        *_TAKEOFFS,
        *_LANDINGS,
    )
)
"""Items whose position PX4 reads."""
_BEFORE_TAKEOFF: Final = frozenset((dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH, dialect.MAV_CMD_CONDITION_GATE))
"""Items that must not precede a takeoff, besides those with a position."""
_LEAST_HEIGHT_M: Final = 1e-6
_SLOPE_SLACK_RAD: Final = math.radians(0.1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Px4MissionRules:
    """What the rules depend on besides the mission.

    Attributes:
        fixed_wing: the vehicle is a fixed wing; otherwise it is a multicopter.
        required: MIS_TKO_LAND_REQ: 0 nothing, 1 a takeoff, 2 a landing, 3 both, 4 both or neither, 5 as 4 on
            the ground, and a landing in the air. The firmware's default is 0, and 2 for fixed wings.
        landing_angle_rad: steepest approach of a fixed wing (FW_LND_ANG).
    """

    fixed_wing: bool
    required: int = 0
    landing_angle_rad: float = math.radians(5.0)

    @classmethod
    def of(cls, parameters: Mapping[str, float], *, fixed_wing: bool) -> "Px4MissionRules":
        """The rules from the values of `PARAMETERS`."""
        return cls(
            fixed_wing=fixed_wing,
            required=round(parameters["MIS_TKO_LAND_REQ"]),
            landing_angle_rad=math.radians(parameters["FW_LND_ANG"]),
        )


def mission_problems(
    items: Sequence[MissionItem],
    rules: Px4MissionRules,
    *,
    home_alt_m: float | None = None,
    landed: bool = True,
    outside: Callable[[MissionItem], bool] | None = None,
) -> tuple[str, ...]:
    """Why a mission may not be flown, in PX4's words; empty when it may. An empty mission has no problems.

    Args:
        items: the mission.
        rules: the vehicle's kind and parameters.
        home_alt_m: altitude of home above mean sea level; None: not known.
        landed: the vehicle stands on the ground.
        outside: returns whether an item lies outside the geofence; None: there is none.
    """
    problem = _invalid_item(items, landed)
    if problem:  # PX4 then checks nothing else but the fence
        problems = [problem]
    else:
        problems = [
            *_takeoff_problems(items, home_alt_m),
            *(["Mission contains VTOL items but vehicle is not a VTOL"] * _has(items, VTOL_COMMANDS)),
            *(_aircraft_problems(items, rules, home_alt_m) if rules.fixed_wing else ()),
        ]
        if items:
            problems += _missing(items, rules, landed=landed)
    problems = [f"Mission rejected: {problem}" for problem in problems]
    if outside is not None:
        far = next((seq for seq, item in enumerate(items) if _placed(item) and outside(item)), None)
        problems += [] if far is None else [f"Geofence violation for waypoint {far + 1}"]
    return tuple(problems)


def _has(items: Sequence[MissionItem], commands: frozenset[int]) -> bool:
    return any(item.command in commands for item in items)


def _placed(item: MissionItem) -> bool:
    return item.command in _PLACED


def _invalid_item(items: Sequence[MissionItem], landed: bool) -> str:
    """The problem of the first item that is invalid by itself; "": there is none. Unsupported commands are
    refused at the upload.
    """
    if landed and items and items[0].command == dialect.MAV_CMD_NAV_LAND:
        return "starts with landing"
    return ""


def _takeoff_problems(items: Sequence[MissionItem], home_alt_m: float | None) -> list[str]:
    """The first problem of the takeoffs: too low, or behind another item with a place."""
    placed = False
    for item in items:
        if item.command in _TAKEOFFS:
            height_m = _height_m(item, home_alt_m)
            if not height_m > _LEAST_HEIGHT_M:
                return ["Takeoff altitude below home altitude!"]
            if placed:
                return ["takeoff not first waypoint item"]
        placed = placed or _placed(item) or item.command in _BEFORE_TAKEOFF
    return []


def _missing(items: Sequence[MissionItem], rules: Px4MissionRules, *, landed: bool) -> list[str]:
    """The takeoff or landing that MIS_TKO_LAND_REQ asks for. A return is no landing. That of a fixed wing
    counts only behind another item.
    """
    takeoff = _has(items, _TAKEOFFS)
    landing = _has(items[1:] if rules.fixed_wing else items, _LANDINGS)
    required = rules.required
    if required == 5:
        required = 4 if landed else 2
    if required == 1 and not takeoff:
        return ["Takeoff waypoint required"]
    if required == 2 and not landing:
        return ["Landing waypoint/pattern required"]
    if required == 3 and not (takeoff and landing):
        return ["Takeoff or Landing item missing"]
    if required == 4 and takeoff is not landing:
        missing, there = ("Landing", "Takeoff") if takeoff else ("Takeoff", "Landing")
        return [f"Add {missing} item or remove {there}"]
    return []


def _aircraft_problems(
    items: Sequence[MissionItem], rules: Px4MissionRules, home_alt_m: float | None
) -> list[str]:
    """The rules for fixed wings alone: the landing sequence, and the approach of each landing."""
    problem = _sequence_problem(items)
    problems = [problem] if problem else []
    approaches = (
        _approach_problem(before, land, rules, home_alt_m)
        for before, land in pairwise(items)
        if land.command == dialect.MAV_CMD_NAV_LAND
    )
    problems += [problem for problem in approaches if problem][:1]
    return problems


def _sequence_problem(items: Sequence[MissionItem]) -> str:
    """The problem of DO_LAND_START and of what follows it; "": there is none."""
    start = landing = -1
    for seq, item in enumerate(items):
        if item.command == dialect.MAV_CMD_DO_LAND_START:
            if start >= 0:
                return "more than one land start commands"
            start = seq
        elif item.command in _LANDINGS:
            if seq == 0:
                return "starts with landing"
            landing = seq
        elif item.command == dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH and start >= 0:
            return "land start item before RTL item is not possible"
    return "invalid land start" if start >= 0 and start >= landing else ""


def _approach_problem(
    entry: MissionItem, land: MissionItem, rules: Px4MissionRules, home_alt_m: float | None
) -> str:
    """The problem of the approach from the item directly before a landing; "": there is none, or that item
    has no position.
    """
    if not _placed(entry) or not math.isfinite(entry.x + entry.y + land.x + land.y):
        return ""
    descent_m = _height_m(entry, home_alt_m) - _height_m(land, home_alt_m)
    if descent_m < _LEAST_HEIGHT_M:
        return "the approach waypoint must be above the landing point"
    frame = Px4Frame(GeodeticPosition(lat_deg=land.x, lon_deg=land.y, alt_m=0.0))
    distance_m = math.hypot(*frame.ned_from_geodetic(entry.x, entry.y, 0.0)[:2])
    if entry.command == dialect.MAV_CMD_NAV_LOITER_TO_ALT:
        radius_m = abs(entry.param2) if math.isfinite(entry.param2) else 0.0
        if distance_m <= radius_m:
            return "the landing point must be outside the orbit radius"
        distance_m = math.sqrt(distance_m**2 - radius_m**2)  # it leaves the circle along a tangent
    elif entry.command != dialect.MAV_CMD_NAV_WAYPOINT:
        return "unsupported landing approach entrance waypoint type. Only ORBIT_TO_ALT or WAYPOINT allowed"
    if descent_m > distance_m * math.tan(rules.landing_angle_rad + _SLOPE_SLACK_RAD):
        return (
            "the landing glide slope is steeper than the vehicle setting of "
            f"{math.degrees(rules.landing_angle_rad):.1f} degrees"
        )
    return ""


def _height_m(item: MissionItem, home_alt_m: float | None) -> float:
    """Height above home."""
    amsl = is_geodetic(item) and item.frame in GLOBAL_FRAMES
    return item.z - (home_alt_m or 0.0) if amsl else item.z
