"""PX4's rules for a fixed wing's mission: take-off and landing items, and a flyable approach.

Source: PX4 1.16 navigator, FeasibilityChecker (checkTakeoffLandAvailable, the fixed-wing landing checks); the
slope as it was seen (docs/firmware/px4.md, section 10).
"""

import math
from dataclasses import dataclass
from typing import Final

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware.mapping import clamp, integer
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.mission_wire import GLOBAL_FRAMES, is_geodetic
from autopilot_bridge.parameters import ParameterStore
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

_PLACES: Final = frozenset(
    (
        mavlink.MAV_CMD_NAV_WAYPOINT,
        mavlink.MAV_CMD_NAV_LOITER_UNLIM,
        mavlink.MAV_CMD_NAV_LOITER_TIME,
        mavlink.MAV_CMD_NAV_LOITER_TO_ALT,
        mavlink.MAV_CMD_NAV_TAKEOFF,
    )
)
_LEAST_HEIGHT_M: Final = 1e-3
_SLOPE_ROUNDING: Final = 1.001  # places and heights come in whole 1e-7 degrees and single precision


@dataclass(frozen=True, slots=True, kw_only=True)
class AircraftRules:
    """Limits of a fixed wing's mission.

    Attributes:
        landing_angle_rad: steepest approach (FW_LND_ANG).
        loiter_radius_m: of circles without a radius of their own (NAV_LOITER_RAD).
        required: MIS_TKO_LAND_REQ: 0 nothing, 1 a take-off, 2 a landing, 3 both, 4 both or neither.
    """

    landing_angle_rad: float
    loiter_radius_m: float
    required: int

    @classmethod
    def of(cls, store: ParameterStore) -> "AircraftRules":
        """The rules from a vehicle's parameters."""
        return cls(
            landing_angle_rad=math.radians(clamp(store.get("FW_LND_ANG"), 1.0, 15.0)),
            loiter_radius_m=clamp(store.get("NAV_LOITER_RAD"), 1.0, 1e4),
            required=integer(store, "MIS_TKO_LAND_REQ"),
        )


def aircraft_problems(
    items: tuple[MissionItem, ...], rules: AircraftRules, *, home_alt_m: float | None
) -> list[str]:
    """Why an aircraft may not fly a mission, in PX4's words; empty when it may."""
    takeoff = any(item.command == mavlink.MAV_CMD_NAV_TAKEOFF for item in items)
    landings = [seq for seq, item in enumerate(items) if item.command == mavlink.MAV_CMD_NAV_LAND]
    problems = _missing(takeoff, bool(landings), rules.required)
    starts = [seq for seq, item in enumerate(items) if item.command == mavlink.MAV_CMD_DO_LAND_START]
    if len(starts) > 1:
        problems.append("Mission rejected: more than one land start commands")
    if starts and not any(seq > starts[0] for seq in landings):
        problems.append("Mission rejected: invalid land start")
    for seq in landings:
        problem = _approach_problem(items, seq, rules, home_alt_m)
        if problem is not None:
            problems.append(f"Mission rejected: {problem}")
    return problems


def _missing(takeoff: bool, landing: bool, required: int) -> list[str]:
    if required in (1, 3) and not takeoff:
        return ["Mission rejected: Takeoff waypoint required"]
    if required in (2, 3) and not landing:
        return ["Mission rejected: Landing waypoint/pattern required"]
    if required == 4 and takeoff is not landing:
        missing, there = ("Landing", "Takeoff") if takeoff else ("Takeoff", "Landing")
        return [f"Mission rejected: Add {missing} item or remove {there}"]
    return []


def _approach_problem(
    items: tuple[MissionItem, ...], seq: int, rules: AircraftRules, home_alt_m: float | None
) -> str | None:
    """The problem of the approach from the item before a landing to the landing; None: no problem."""
    land = items[seq]
    places = [item for item in items[:seq] if item.command in _PLACES and math.isfinite(item.x + item.y)]
    if seq == 0 or not math.isfinite(land.x + land.y):
        return None  # it lands at its position
    if not places:
        return "need landing approach"
    entry = places[-1]
    if entry.command == mavlink.MAV_CMD_NAV_TAKEOFF:
        return "need landing approach"
    frame = LocalFrame(GeodeticPosition(lat_deg=land.x, lon_deg=land.y, alt_m=0.0))
    north_m, east_m, _ = frame.ned_from_geodetic(entry.x, entry.y, 0.0)
    distance_m = math.hypot(north_m, east_m)
    if entry.command == mavlink.MAV_CMD_NAV_LOITER_TO_ALT:
        radius_m = (
            abs(entry.param2) if math.isfinite(entry.param2) and entry.param2 else rules.loiter_radius_m
        )
        if distance_m <= radius_m:
            return "landing point is within the loiter radius"
        distance_m = math.sqrt(distance_m**2 - radius_m**2)  # it leaves the circle along a tangent
    descent_m = _altitude_m(entry, home_alt_m) - _altitude_m(land, home_alt_m)
    if descent_m < _LEAST_HEIGHT_M:
        return "the approach waypoint must be above the landing point"
    if descent_m > distance_m * math.tan(rules.landing_angle_rad) * _SLOPE_ROUNDING:
        return "the landing approach is too steep"
    return None


def _altitude_m(item: MissionItem, home_alt_m: float | None) -> float:
    """Altitude over home."""
    amsl = is_geodetic(item) and item.frame in GLOBAL_FRAMES
    return item.z - (home_alt_m or 0.0) if amsl else item.z
