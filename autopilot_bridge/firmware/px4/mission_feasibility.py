"""PX4's feasibility check: whether a stored mission may be flown.

An infeasible mission is stored and acknowledged, but mission mode and arming in it are refused. Source: PX4
1.16 navigator, MissionFeasibility/FeasibilityChecker. The checks for fixed wings are in
`mission_feasibility_aircraft`.
"""

from collections.abc import Callable
from typing import Final

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware.px4.plane.mission_feasibility import AircraftRules, aircraft_problems
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.mission_wire import GLOBAL_FRAMES, is_geodetic

VTOL_COMMANDS: Final = frozenset(
    (mavlink.MAV_CMD_NAV_VTOL_TAKEOFF, mavlink.MAV_CMD_NAV_VTOL_LAND, mavlink.MAV_CMD_DO_VTOL_TRANSITION)
)
_TAKEOFFS: Final = frozenset((mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_VTOL_TAKEOFF))
_POSITION_COMMANDS: Final = frozenset(
    (
        mavlink.MAV_CMD_NAV_WAYPOINT,
        mavlink.MAV_CMD_NAV_LOITER_UNLIM,
        mavlink.MAV_CMD_NAV_LOITER_TIME,
        mavlink.MAV_CMD_NAV_LOITER_TO_ALT,
        mavlink.MAV_CMD_NAV_LAND,
        mavlink.MAV_CMD_NAV_TAKEOFF,
        mavlink.MAV_CMD_NAV_VTOL_TAKEOFF,
        mavlink.MAV_CMD_NAV_VTOL_LAND,
        mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH,
        mavlink.MAV_CMD_CONDITION_GATE,
    )
)


def mission_problems(
    items: tuple[MissionItem, ...],
    *,
    home_alt_m: float | None = None,
    landed: bool = True,
    aircraft: AircraftRules | None = None,
    outside: Callable[[MissionItem], bool] | None = None,
) -> tuple[str, ...]:
    """Why a mission may not be flown, in PX4's words; empty when it may. An empty mission has no problems.

    Args:
        items: the stored mission.
        home_alt_m: home altitude above mean sea level, for takeoffs given in AMSL; None: not known.
        landed: the vehicle stands on the ground.
        aircraft: the rules for a fixed wing; None: the vehicle is no fixed wing.
        outside: returns whether an item lies outside the geofence; None: there is none.
    """
    problems: list[str] = []
    placed = False
    for seq, item in enumerate(items):
        if item.command in VTOL_COMMANDS:
            problems.append(f"Mission rejected: item {seq + 1}: unsupported command: {item.command}")
        if item.command in _TAKEOFFS:
            height_m = item.z
            if is_geodetic(item) and item.frame in GLOBAL_FRAMES:
                height_m -= home_alt_m or 0.0
            if not height_m > 1e-6:
                problems.append("Mission rejected: Takeoff altitude below home altitude!")
            if placed:
                problems.append("Mission rejected: takeoff not first waypoint item")
        if not placed and landed and item.command == mavlink.MAV_CMD_NAV_LAND:
            problems.append("Mission rejected: starts with landing")
        if outside is not None and outside(item):
            problems.append(f"Mission rejected: Geofence violation for waypoint {seq + 1}")
        placed = placed or item.command in _POSITION_COMMANDS
    if aircraft is not None and items:
        problems += aircraft_problems(items, aircraft, home_alt_m=home_alt_m)
    return tuple(dict.fromkeys(problems))
