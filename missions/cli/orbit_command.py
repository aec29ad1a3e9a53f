"""The command-line options of the orbit."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli.mission_command import Given, MissionCommand, Scope, option
from missions.cli.options import PLACE, degrees

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec


def _values(given: Given) -> Mapping[str, Any]:
    return {
        "direction": 1 if given["direction"] == "cw" else -1,
        "target_wanders": given["target_motion"] in ("circle", "random-walk"),
        "gps_fault": not given["no_gps_fault"],
    }


def _world(given: Given, options: Any, world: "WorldSpec") -> "WorldSpec":
    from missions.orbit.world import orbit_world
    from missions.worlds.motions import MotionKind

    motion = given["target_motion"]
    return orbit_world(world, options, motion=None if motion is None else MotionKind(motion))


COMMAND: Final = MissionCommand(
    help=(
        "Circle a target on the ground without GPS, by roll commands from what a gimballed camera sees.\n\n"
        "An aircraft takes off, flies to the entry with GPS, loses it there (MAV_CMD_INJECT_FAILURE), "
        "orbits, gets "
        "GPS back and lands."
    ),
    options=(
        option("--radius", type=float, default=150.0, help="Of the orbit, m, horizontal."),
        option("--direction", type=click.Choice(["cw", "ccw"]), default="cw", help="Seen from above."),
        option("--duration", type=float, default=600.0, help="On the orbit, s."),
        option("--altitude", type=float, default=100.0, help="Above home, m."),
        option("--airspeed", type=float, help="m/s. [default: the aircraft's own]"),
        option(
            "--target",
            type=PLACE,
            default="500,300",
            help="Where the target is at the beginning, m from home, as reported before the flight.",
        ),
        option("--target-speed", type=float, default=0.0, help="Of the target, m/s."),
        option("--target-heading", type=degrees, default=0.0, help="It moves there, degrees."),
        option(
            "--target-motion",
            scope=Scope.EMBEDDED,
            type=click.Choice(["static", "straight", "circle", "random-walk"]),
            help="How it moves: one that wanders stays within 100 m. [default: straight on, or static]",
        ),
        option("--target-ground", type=float, default=0.0, help="Height of its ground above home, m."),
        option(
            "--entry-bearing",
            type=degrees,
            default=180.0,
            help="GPS is lost there: from the target, degrees.",
        ),
        option("--entry-distance", type=float, default=400.0, help="And so far from it, m."),
        option(
            "--entry-heading", type=degrees, help="Of the nose there, degrees. [default: towards the target]"
        ),
        option("--no-gps-fault", is_flag=True, help="Leave GPS on; the orbit doesn't use it."),
        option(
            "--gps-off",
            type=click.Choice(["auto", "failure", "parameter"]),
            default="auto",
            help="How GPS is switched off: by MAV_CMD_INJECT_FAILURE, by a parameter that is restored "
            "afterwards, or by what a simulator takes.",
        ),
        option(
            "--lost-limit", type=float, default=30.0, help="Give up when the target is unseen so long, s."
        ),
        option(
            "--attitude",
            type=click.Choice(["autopilot", "filter"]),
            default="autopilot",
            help="Roll and pitch to fly with: the autopilot's, or our own filter's (docs/attitude.md).",
        ),
        option("--separation", type=float, default=20.0, help="Between the altitudes of a team, m."),
    ),
    made=("missions.orbit.options", "OrbitOptions"),
    values=_values,
    world=_world,
)
