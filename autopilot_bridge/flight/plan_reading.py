"""The meaning of a mission item (commands, frames, targets), and the rules of each firmware for a plan."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np

from autopilot_bridge.flight.context import Array, FlightContext
from autopilot_bridge.mission_plan import MissionItem, MissionStore
from autopilot_bridge.navigation import layout as nav_layout


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRules:
    """How one firmware flies a plan.

    Attributes:
        conditions: CONDITION_ items delay the DO_ items after them, during the flight to the next position
            (ArduPilot); else they are skipped (PX4).
        tags: DO_JUMP_TAG jumps to its JUMP_TAG (ArduPilot).
        item_radius: a waypoint's own acceptance radius is used (PX4, ArduPlane; ArduCopter has one for all).
        holds: a waypoint's hold time is flown (PX4, ArduCopter; ArduPlane has none).
        passes_by: a waypoint's param3 is how far beyond it the next leg begins (ArduPlane).
        hurries: loiter times and delays are skipped (a return along the plan).
        silent: the start and end of items are not reported: the plan is not the stored one.
    """

    conditions: bool = False
    tags: bool = False
    item_radius: bool = True
    holds: bool = True
    passes_by: bool = False
    hurries: bool = False
    silent: bool = False


PX4_PLANS = PlanRules()
ARDUCOPTER_PLANS = PlanRules(conditions=True, tags=True, item_radius=False)
ARDUPLANE_PLANS = PlanRules(conditions=True, tags=True, holds=False, passes_by=True)


class Command(IntEnum):
    """MAV_CMD numbers that the mission task executes."""

    NAV_WAYPOINT = 16
    NAV_LOITER_UNLIM = 17
    NAV_LOITER_TURNS = 18
    NAV_LOITER_TIME = 19
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    NAV_CONTINUE_AND_CHANGE_ALT = 30
    NAV_LOITER_TO_ALT = 31
    NAV_ROI = 80
    NAV_SPLINE_WAYPOINT = 82
    NAV_VTOL_TAKEOFF = 84
    NAV_VTOL_LAND = 85
    NAV_DELAY = 93
    NAV_LAST = 95
    CONDITION_DELAY = 112
    CONDITION_DISTANCE = 114
    CONDITION_YAW = 115
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178
    DO_SET_HOME = 179
    DO_RETURN_PATH_START = 188
    DO_LAND_START = 189
    DO_GO_AROUND = 191
    DO_SET_ROI_LOCATION = 195
    DO_SET_ROI_WPNEXT_OFFSET = 196
    DO_SET_ROI_NONE = 197
    DO_SET_ROI = 201
    JUMP_TAG = 600
    DO_JUMP_TAG = 601


_GLOBAL: Final = frozenset({0, 5})  # MAV_FRAME_GLOBAL, _INT: above mean sea level
_RELATIVE: Final = frozenset({3, 6, 10, 11})  # above home; terrain is assumed level with home
_LOCAL_NED: Final = 1
_WAYPOINTS: Final = frozenset({Command.NAV_WAYPOINT, Command.NAV_SPLINE_WAYPOINT})
_NOT_FLOWN: Final = frozenset({Command.NAV_ROI})  # a region of interest in spite of its name
CONDITIONS: Final = frozenset({Command.CONDITION_DELAY, Command.CONDITION_DISTANCE, Command.CONDITION_YAW})
JUMPS: Final = frozenset({Command.DO_JUMP, Command.DO_JUMP_TAG})
MARKERS: Final = frozenset(
    {Command.DO_LAND_START, Command.DO_RETURN_PATH_START, Command.DO_GO_AROUND, Command.JUMP_TAG}
)
"""Items that have no effect in a plan."""


def is_navigation(item: MissionItem) -> bool:
    """The item moves or holds the vehicle (MAV_CMD_NAV_*), so it ends when the manoeuvre ends."""
    return item.command <= Command.NAV_LAST and item.command not in _NOT_FLOWN


def is_waypoint(item: MissionItem) -> bool:
    """The item is a position to fly to or through."""
    return item.command in _WAYPOINTS


def is_passed_through(item: MissionItem) -> bool:
    """The vehicle need not stop there."""
    return is_waypoint(item) and not item.param1 > 0.0 and item.autocontinue


def target_of(item: MissionItem, ctx: FlightContext) -> Array | None:
    """Position of an item in local NED, (3,); None when it is not known (no frame, no home, invalid values).

    Latitude and longitude 0, or NaN, mean the present position, as in autopilots for take-off, land and
    loiter items.
    """
    here = ctx.nav[nav_layout.POS_NED_M]
    if item.frame == _LOCAL_NED:
        target = np.array([item.x, item.y, item.z])
        return np.where(np.isfinite(target), target, here)
    frame = ctx.frame
    if frame is None:
        return None
    home_down = float(ctx.home_ned_m[2])
    if item.frame in _GLOBAL:
        alt_m = item.z
    elif item.frame in _RELATIVE:
        alt_m = frame.origin.alt_m + item.z - (0.0 if math.isnan(home_down) else home_down)
    else:
        return None
    if (item.x == 0.0 and item.y == 0.0) or not (math.isfinite(item.x) and math.isfinite(item.y)):
        north, east = float(here[0]), float(here[1])
        _, _, down = frame.ned_from_geodetic(frame.origin.lat_deg, frame.origin.lon_deg, alt_m)
    else:
        if not (-90.0 <= item.x <= 90.0 and -180.0 <= item.y <= 180.0):
            return None
        north, east, down = frame.ned_from_geodetic(item.x, item.y, alt_m)
    if not math.isfinite(down):
        down = float(here[2])
    return np.array([north, east, down])


def jump_target(item: MissionItem, items: Sequence[MissionItem]) -> int | None:
    """Sequence number of the target of a DO_JUMP or DO_JUMP_TAG; None when there is no such item."""
    if not math.isfinite(item.param1):
        return None
    target = round(item.param1)
    if item.command == Command.DO_JUMP_TAG:
        tags = (seq for seq, each in enumerate(items) if each.command == Command.JUMP_TAG)
        return next((seq for seq in tags if items[seq].param1 == item.param1), None)
    return target if 0 <= target < len(items) else None


def landing_start(items: Sequence[MissionItem]) -> int | None:
    """Sequence number of the first DO_LAND_START; None: the plan has no landing sequence."""
    for seq, item in enumerate(items):
        if item.command == Command.DO_LAND_START:
            return seq
    return None


def in_landing_sequence(missions: MissionStore) -> bool:
    """The current item is part of the landing: after DO_LAND_START, or the landing itself."""
    items, current = missions.items, missions.current
    if not 0 <= current < len(items):
        return False
    start = landing_start(items)
    behind_start = start is not None and current >= start
    return behind_start or items[current].command == Command.NAV_LAND


def ends_in_landing(missions: MissionStore) -> bool:
    """The current item is a landing."""
    items, current = missions.items, missions.current
    landings = (Command.NAV_LAND, Command.NAV_VTOL_LAND)
    return 0 <= current < len(items) and items[current].command in landings
