"""`QGC WPL 110`: the waypoint files of Mission Planner and MAVProxy (.waypoints, .txt), read by pymavlink."""

import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.mission_wire import GLOBAL_FRAMES
from flightsim.foundation.file_content import FileError, read_text
from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import PlanError
from missions.plan_files import document as document

HEADER: Final = "QGC WPL 110"


def read_wpl(path: Path) -> document.MissionDocument:
    """Read a waypoint file. If the first row is an absolute waypoint, as ArduPilot's tools write it, it is
    the home.

    Items at 0, 0 stay where the vehicle is.

    Raises:
        PlanError: the file can't be read; the message names the item.
    """
    from pymavlink import mavwp

    loader = mavwp.MAVWPLoader()
    try:
        read_text(path)
    except FileError as error:
        raise PlanError(f"mission file {error}") from None
    try:
        loader.load(str(path))
    except (mavwp.MAVWPError, ValueError, OverflowError) as error:
        raise PlanError(
            f"{path} is not understood after {loader.count()} rows: {str(error)[:100]}; accepted: "
            f"{HEADER!r}, then rows of 12 numbers"
        ) from error
    rows = [loader.wp(index) for index in range(loader.count())]
    for index, row in enumerate(rows):
        if row.frame not in range(256) or row.command not in range(65536):
            raise PlanError(
                f"{path}: row {index}: frame {row.frame}, command {row.command}; accepted: a MAV_FRAME and a "
                "MAV_CMD"
            )
    first = 1 if rows and _is_home(rows[0]) else 0
    return document.MissionDocument(
        path=path,
        items=tuple(_item(row, first) for row in rows[first:]),
        home=_home(rows[0]) if first else None,
        zero_is_here=True,
    )


def _is_home(row: Any) -> bool:
    return (
        row.command == document.NAV_WAYPOINT
        and row.frame in GLOBAL_FRAMES
        and abs(row.x) <= 90.0
        and abs(row.y) <= 180.0
        and math.isfinite(row.z)
    )


def _home(row: Any) -> document.PlannedHome | None:
    """The home in the first row; None: it is all zeros, which ArduPilot's tools write before they know it."""
    if row.x == row.y == 0.0:
        return None
    return document.PlannedHome(lat_deg=row.x, lon_deg=row.y, alt_m=row.z)


def _item(row: Any, first: int) -> MissionItem:
    item = MissionItem(
        command=row.command,
        frame=document.INT_FRAMES.get(row.frame, row.frame),
        param1=row.param1,
        param2=row.param2,
        param3=row.param3,
        param4=row.param4,
        x=row.x,
        y=row.y,
        z=row.z,
        autocontinue=bool(row.autocontinue),
    )
    return replace(item, param1=item.param1 - first) if item.command == document.DO_JUMP else item


def format_wpl(items: Iterable[MissionItem], home: GeodeticPosition) -> str:
    """A mission as the text of a waypoint file: home is the first row, and values that are not set (NaN) are
    0.
    """
    marker = MissionItem(command=document.NAV_WAYPOINT, frame=0, x=home.lat_deg, y=home.lon_deg, z=home.alt_m)
    lines = [HEADER]
    for index, item in enumerate((marker, *items)):
        if item.command == document.DO_JUMP:
            item = replace(item, param1=item.param1 + 1)
        frame = document.PLAIN_FRAMES.get(item.frame, item.frame)
        numbers = (item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z)
        texts = [f"{0.0 if math.isnan(number) else number:.8f}" for number in numbers]
        lines.append("\t".join([str(index), str(int(index == 0)), str(frame), str(item.command), *texts,
                                str(int(item.autocontinue))]))  # fmt: skip
    return "\n".join(lines) + "\n"
