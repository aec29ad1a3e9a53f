"""The region of interest set by a plan or a command (MAV_CMD_DO_SET_ROI and related commands)."""

import math
from typing import Final

import numpy as np

from autopilot_bridge.flight.context import Array, FlightContext, RegionOfInterest, RoiMode
from autopilot_bridge.flight.plan_reading import Command, target_of
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.navigation import layout as nav_layout
from flightsim.foundation.vectors import wrap_pi

_NEAREST_M: Final = 0.5  # within this distance, right above or below it, the heading is not defined


_BY_COMMAND: Final = {
    Command.DO_SET_ROI_LOCATION: RoiMode.LOCATION,
    Command.DO_SET_ROI_WPNEXT_OFFSET: RoiMode.NEXT_WAYPOINT,
    Command.DO_SET_ROI_NONE: RoiMode.NONE,
}
ROI_COMMANDS: Final = frozenset({*_BY_COMMAND, Command.DO_SET_ROI, Command.NAV_ROI})


def roi_of(item: MissionItem, ctx: FlightContext) -> RegionOfInterest | None:
    """The region of interest of an item of `ROI_COMMANDS`; None: the item ends it.

    DO_SET_ROI and NAV_ROI carry their kind in param1 (PX4); ArduPilot's DO_SET_ROI is always a location,
    and an all-zero position ends it.
    """
    mode = _BY_COMMAND.get(Command(item.command))
    if mode is None:
        number = round(item.param1) if math.isfinite(item.param1) else 0
        placed = item.x != 0.0 or item.y != 0.0
        known = number in (RoiMode.NEXT_WAYPOINT, RoiMode.WAYPOINT)
        mode = RoiMode(number) if known else RoiMode.LOCATION if placed else RoiMode.NONE
    if mode is RoiMode.NONE:
        return None
    if mode is RoiMode.LOCATION:
        place = target_of(item, ctx)
        return None if place is None else RegionOfInterest(mode=mode, place_ned_m=place)
    index = round(item.param2) if math.isfinite(item.param2) else -1
    offset = item.z if mode is RoiMode.NEXT_WAYPOINT and math.isfinite(item.z) else 0.0
    return RegionOfInterest(mode=mode, index=index, yaw_offset_rad=math.radians(offset))


def roi_heading(ctx: FlightContext) -> float:
    """Heading to a region of interest that is a position; NaN if there is none."""
    roi = ctx.roi
    return math.nan if roi is None else heading_to(ctx, roi.place_ned_m, roi.yaw_offset_rad)


def heading_to(ctx: FlightContext, place_ned_m: Array | None, offset_rad: float = 0.0) -> float:
    """Heading from the vehicle to a position; NaN if there is none."""
    if place_ned_m is None or not ctx.position_valid:
        return math.nan
    here = ctx.nav[nav_layout.POS_NED_M]
    north, east = (float(value) for value in np.subtract(place_ned_m, here)[0:2])
    if math.hypot(north, east) < _NEAREST_M:
        return math.nan
    return wrap_pi(math.atan2(east, north) + offset_rad)
