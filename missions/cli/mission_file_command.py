"""The command-line options of a ground station's mission file."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

import click

from missions.cli.mission_command import Given, MissionCommand, option


def _build(given: Given, common: Mapping[str, Any]) -> Any:
    from missions.plan_files.options import FileOptions, Then

    return FileOptions(
        **common,
        then=None if given["then"] is None else Then(given["then"]),
        time_limit_s=given["time_limit"],
    )


COMMAND: Final = MissionCommand(
    help=(
        "Fly a mission file: QGroundControl's .plan, or QGC WPL 110 (.waypoints, .txt) of Mission Planner "
        "and MAVProxy.\n\n"
        "Fence and rally points of a .plan are uploaded too. The embedded SITL stands where the file's home "
        "is, and has the autopilot and the class of vehicle that the file names, unless --home, --autopilot "
        "and --model say otherwise."
    ),
    options=(
        option(
            "--then",
            type=click.Choice(["return", "land"]),
            help="After a mission that does not land by itself. [default: return; required for aircraft]",
        ),
        option("--time-limit", type=float, help="End the mission after so many seconds, with --then."),
    ),
    build=_build,
    fields=MappingProxyType({}),
)
