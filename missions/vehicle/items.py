"""Mission items as users see them: which are flown to, and their names."""

from typing import Final

from autopilot_bridge.mavlink import command_name, dialect

FLOWN_TO: Final = frozenset(
    {
        dialect.MAV_CMD_NAV_WAYPOINT,
        dialect.MAV_CMD_NAV_LOITER_UNLIM,
        dialect.MAV_CMD_NAV_LOITER_TURNS,
        dialect.MAV_CMD_NAV_LOITER_TIME,
        dialect.MAV_CMD_NAV_LAND,
        dialect.MAV_CMD_NAV_TAKEOFF,
        dialect.MAV_CMD_NAV_LOITER_TO_ALT,
        dialect.MAV_CMD_NAV_SPLINE_WAYPOINT,
    }
)
"""Commands that contain a place to fly to."""

WITH_PLACE: Final = FLOWN_TO | {
    dialect.MAV_CMD_NAV_VTOL_TAKEOFF,
    dialect.MAV_CMD_NAV_VTOL_LAND,
    dialect.MAV_CMD_CONDITION_GATE,
    dialect.MAV_CMD_NAV_ROI,
    dialect.MAV_CMD_DO_SET_ROI,
    dialect.MAV_CMD_DO_SET_ROI_LOCATION,
    dialect.MAV_CMD_DO_SET_HOME,
}
"""Commands that contain a place."""


def item_name(index: int, command: int) -> str:
    """Name of an item from its index in the mission (from 0), numbered from 1 as in ground stations: "item 3
    (NAV_WAYPOINT)".
    """
    return f"item {index + 1} ({command_name(command)})"
