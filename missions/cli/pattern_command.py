"""The command-line options of the search patterns."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli.mission_command import FlightOption, Given, MissionCommand, Scope, option
from missions.cli.options import SIDES, degrees, pair

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec

SEARCH_LIMIT_S: Final = 1800.0
_WINGS: Final = " Aircraft: {}."


def _values(given: Given) -> Mapping[str, Any]:
    values: dict[str, Any] = {}
    if given.get("phase") is not None:
        values["phase_x_rad"], values["phase_y_rad"] = map(math.radians, given["phase"])
    for half, side in (("amplitude_x", "width_m"), ("amplitude_y", "height_m")):
        if given[half] is not None:
            values[side] = 2.0 * given[half]
    if given["search_time"] is None and given["search"]:
        values["search_time_s"] = SEARCH_LIMIT_S
    return values


def _world(given: Given, options: Any, world: "WorldSpec") -> "WorldSpec":
    if not options.search:
        return world
    from missions.pattern_search.world import TagTarget, tag_search_world

    target = TagTarget(speed_m_s=given["target_speed"], size_m=given["tag_size"])
    return tag_search_world(world, options, target)


_LISSAJOUS: Final = (
    option(
        "--pattern", default="L3", help="Lissajous pattern: L1 (circle), L2, L3, L4." + _WINGS.format("L2")
    ),
    option(
        "--ratio",
        type=pair("X:Y", ":/,", second=1.0),
        replaces=("pattern",),
        help="Frequencies X:Y of a Lissajous pattern of your own, e.g. 3:4 or 1.4.",
    ),
    option(
        "--phase", type=pair("X,Y", ",", second=0.0), help="Phases of x and y, degrees, or their difference."
    ),
    option("--period", type=float, replaces=("speed",), help="Seconds once round, in place of --speed."),
)
_HEADING: Final = (option("--heading", type=degrees, default=0.0, help="First leg, degrees."),)
_SPACING: Final = (
    option(
        "--spacing", type=float, default=10.0, help="Track spacing, m." + _WINGS.format("what its turns need")
    ),
)
_EVERY: Final = (
    option(
        "--size",
        type=SIDES,
        metavar="SIDE|WIDTHxHEIGHT",
        default="100",
        help="Size of the pattern, m: SIDE or WIDTHxHEIGHT (east x north)."
        + _WINGS.format("1000 or more, as its turns need"),
    ),
    option(
        "--amplitude-x",
        sets="width_m",
        type=float,
        replaces=("size",),
        help="Half the width, m (east), in place of --size.",
    ),
    option(
        "--amplitude-y", sets="height_m", type=float, replaces=("size",), help="Half the height, m (north)."
    ),
    option("--altitude", type=float, default=10.0, help="Above home, m." + _WINGS.format("100")),
    option(
        "--speed",
        type=float,
        default=5.0,
        help="Ground speed, m/s; of an aircraft, airspeed." + _WINGS.format("its own"),
    ),
    option("--periods", type=float, default=1.0, help="Times round."),
    option(
        "--search-time",
        type=float,
        replaces=("periods",),
        help="Repeat the pattern for so many seconds, in place of --periods.",
    ),
    option(
        "--via",
        type=click.Choice(["waypoints", "setpoints"]),
        default="waypoints",
        help="By an uploaded mission, or by streamed setpoints."
        + _WINGS.format("setpoints, which follow the curve more closely"),
    ),
    option(
        "--acceptance",
        type=float,
        default=2.0,
        help="Waypoint acceptance radius, m." + _WINGS.format("by its speed"),
    ),
    option("--rate", type=float, default=25.0, help="Setpoints per second."),
    option(
        "--search",
        is_flag=True,
        show_default=False,
        help="Fly until the camera has detected a tag; --search-time is the limit, 1800 s if not given.",
    ),
    option(
        "--tag-id", type=int, default=0, help="Number of the tag (AprilTag 36h11) that --search looks for."
    ),
    option(
        "--target-speed",
        scope=Scope.EMBEDDED,
        type=float,
        default=0.3,
        help="Speed of the target's random walk, m/s; 0: it stays where it is.",
    ),
    option(
        "--tag-size", scope=Scope.EMBEDDED, type=float, default=0.3, help="Side of the tag's black square, m."
    ),
    option(
        "--separation",
        type=float,
        default=4.0,
        help="Between the altitudes of a team, m." + _WINGS.format("20"),
    ),
)


def _pattern(help_text: str, own: tuple[FlightOption, ...]) -> MissionCommand:
    return MissionCommand(
        help=help_text,
        options=(*own, *_EVERY),
        made=("missions.base.options", "FlightOptions"),
        values=_values,
        world=_world,
    )


LISSAJOUS: Final = _pattern(
    "Fly a Lissajous pattern, east by one frequency and north by another.", _LISSAJOUS
)
SECTOR: Final = _pattern("Fly a sector search (IAMSAR) around a point.", _HEADING)
PARALLEL_SWEEP: Final = _pattern("Fly a parallel sweep search (IAMSAR).", _HEADING + _SPACING)
EXPANDING_SQUARE: Final = _pattern("Fly an expanding square search (IAMSAR).", _HEADING + _SPACING)
