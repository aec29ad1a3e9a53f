"""The landing sequence of a plan, as ArduPlane's arming checks and DO_LAND_START see it."""

from collections.abc import Sequence

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mission_plan import MissionItem, MissionStore


def landing_start(items: Sequence[MissionItem]) -> int | None:
    """Sequence number of the first DO_LAND_START; None: the plan has no landing sequence."""
    return next((i for i, item in enumerate(items) if item.command == mavlink.MAV_CMD_DO_LAND_START), None)


def in_landing_sequence(missions: MissionStore) -> bool:
    """The current item is part of the landing: behind DO_LAND_START, or the landing itself."""
    items, current = missions.items, missions.current
    if not 0 <= current < len(items):
        return False
    start = landing_start(items)
    behind_start = start is not None and current >= start
    return behind_start or items[current].command == mavlink.MAV_CMD_NAV_LAND
