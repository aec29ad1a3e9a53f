"""The missions on the command line: a text, and the classes whose fields are their options."""

from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import Any, Final

import click

from missions.catalogue import PATTERNS
from missions.cli.declared_options import Given
from missions.cli.mission_command import MissionCommand, option
from missions.cli.option_classes import MISSION_FILE, OPTIONS, PARTS, PATTERN
from missions.errors import PlanError

_OF_LISSAJOUS: Final = ("pattern", "ratio", "phase", "period")
_PATTERN_HAS_NOT: Final = ("allow-below-home",)
_WANDERING: Final = ("circle", "random-walk")


def _sides(given: Given, _: Collection[str]) -> Mapping[str, Any]:
    halves = {"width_m": given["amplitude_x"], "height_m": given["amplitude_y"]}
    return {side: 2.0 * half for side, half in halves.items() if half is not None}


def _pattern(help_text: str, *without: str) -> MissionCommand:
    return MissionCommand(
        help=help_text,
        made=OPTIONS[PATTERN],
        without=(*without, *_PATTERN_HAS_NOT),
        further=(
            option(
                "--amplitude-x",
                sets="width_m",
                type=float,
                replaces=("size",),
                help="Half the width, m (east), in place of --size.",
            ),
            option(
                "--amplitude-y",
                sets="height_m",
                type=float,
                replaces=("size",),
                help="Half the height, m (north), in place of --size.",
            ),
        ),
        world=("missions.pattern_search.world", "tag_search_world"),
        part=PARTS[PATTERN],
        values=_sides,
    )


def _of_orbit(given: Given, _: Collection[str]) -> Mapping[str, Any]:
    return {"target_wanders": given["target_motion"] in _WANDERING}


def _of_handoff(given: Given, chosen: Collection[str]) -> Mapping[str, Any]:
    # with real aircraft a person confirms, or the user allows it
    return {"confirm_after_s": 0.0} if given["connect"] and "confirm_after" not in chosen else {}


def _of_occupancy(given: Given, chosen: Collection[str]) -> Mapping[str, Any]:
    if given["connect"] and "map" not in chosen:
        raise click.UsageError(
            "a search needs the published magnetic map of its place; give it with --map FILE "
            "(numpy .npz, format flightstack-magnetic-map-1)"
        )
    return {}


def arguments_of(pairs: tuple[str, ...]) -> dict[str, str]:
    """Values by name of repeated `--arg NAME=VALUE`.

    Raises:
        PlanError: one is not of this form.
    """

    values = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not (name and equals):
            raise PlanError(f"--arg {pair!r} is not NAME=VALUE")
        values[name] = value
    return values


COMMANDS: Final[Mapping[str, MissionCommand]] = MappingProxyType(
    {
        **{name: _pattern(entry.help, *entry.without) for name, entry in PATTERNS.items()},
        "orbit": MissionCommand(
            help=(
                "Circle a target on the ground without GPS, by roll commands from what a gimballed camera "
                "sees.\n\n"
                "An aircraft takes off, flies to the entry with GPS, loses it there "
                "(MAV_CMD_INJECT_FAILURE), orbits, gets GPS back and lands."
            ),
            made=OPTIONS["orbit"],
            without=("rate", "allow-below-home"),
            world=("missions.orbit.world", "orbit_world"),
            part=PARTS["orbit"],
            values=_of_orbit,
        ),
        "occupancy": MissionCommand(
            help=(
                "Search a magnetic map for a target, as a team with one occupancy map.\n\n"
                "Each vehicle carries a survey magnetometer, flies headings from cell to cell in its own "
                "layer of altitude, and all return when the target is found or the search time is over. "
                "Places are metres from the map's home."
            ),
            made=OPTIONS["occupancy"],
            without=("allow-below-home",),
            world=("missions.occupancy.world", "occupancy_world"),
            part=PARTS["occupancy"],
            values=_of_occupancy,
        ),
        "multi-target": MissionCommand(
            help=(
                "Find an unknown number of targets with a sensor of range and bearing that misses some.\n\n"
                "The vehicle fuses each scan in a PHD filter and flies, step by step, where a scan gives "
                "most: information about targets that it has detected, or area that it has not seen. The "
                "vehicles of a team share the belief and plan in turn. Places are metres from the first "
                "vehicle's home."
            ),
            made=OPTIONS["multi-target"],
            without=("allow-below-home",),
            world=("missions.multi_target.world", "multi_target_world"),
            part=PARTS["multi-target"],
        ),
        "handoff": MissionCommand(
            help=(
                "Hand a moving target over from one aircraft to another that has no GPS "
                "(--vehicles 2).\n\n"
                "The second aircraft orbits the target. The first arrives, loses GPS, finds by range radio "
                "where the other is, tracks what moves on the ground, decides which of its tracks is the "
                "target, and takes it over. The second goes home when it has received the decision."
            ),
            made=OPTIONS["handoff"],
            without=("rate", "allow-below-home"),
            world=("missions.handoff.world", "handoff_world"),
            part=PARTS["handoff"],
            values=_of_handoff,
        ),
        "survey": MissionCommand(
            help=(
                "Measure the magnetic field along parallel lines and tie lines with an aircraft.\n\n"
                "Afterwards the lines are levelled, compared with the published map and gridded: "
                "line_data.csv and .xyz, lines.csv, anomalies.csv, survey_map.npz. With --calibrate it flies "
                "rolls, pitches and yaws on four headings instead, and writes the compensation of the "
                "aircraft. Places are metres from the map's home."
            ),
            made=OPTIONS["survey"],
            without=("rate", "allow-below-home"),
            world=("missions.survey.world", "survey_world"),
            part=PARTS["survey"],
        ),
        "vision-search": MissionCommand(
            help=(
                "Find a tagged target in an area with downward cameras, and localize it.\n\n"
                "Each vehicle keeps a belief about the target's place, on a grid or by particles, from what "
                "the cameras of the team detect and do not detect; the vehicles send each other the "
                "likelihoods of their frames. When the belief is narrow, they fly over the target in several "
                "directions, or around it. Places are metres from the first vehicle's home."
            ),
            made=OPTIONS["vision-search"],
            without=("allow-below-home",),
            world=("missions.vision_search.world", "vision_search_world"),
            part=PARTS["vision-search"],
        ),
    }
)
"""The missions of this package, by name."""

OWN: Final = MissionCommand(
    help=(
        "Fly a mission of your own: a Python file with `async def fly(vehicle, options)`.\n\n"
        "It finds these in its `options` (altitude_m, speed_m_s, rate_hz, ...), and what --arg NAME=VALUE "
        "gives in `options.arguments`; what of it it goes by is its own affair."
    ),
    made=OPTIONS[PATTERN],
    without=(
        *(*_OF_LISSAJOUS, "size", "spacing", "heading", "periods", "search-time"),
        *("via", "acceptance", "search", "tag-id"),
    ),
    further=(option("--arg", multiple=True, metavar="NAME=VALUE", help="Argument of your own; repeat."),),
    values=lambda given, _: {"arguments": arguments_of(given["arg"])},
)

FILE: Final = MissionCommand(
    help=(
        "Fly a mission file: QGroundControl's .plan, or QGC WPL 110 (.waypoints, .txt) of Mission Planner "
        "and MAVProxy.\n\n"
        "Fence and rally points of a .plan are uploaded too. The embedded SITL stands where the file's home "
        "is, and has the autopilot and the class of vehicle that the file names, unless --home, --autopilot "
        "and --model say otherwise."
    ),
    made=OPTIONS[MISSION_FILE],
    without=("altitude", "separation", "rate"),
)
