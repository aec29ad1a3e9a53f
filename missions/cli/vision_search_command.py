"""The command-line options of the search for a tagged target by cameras."""

import math
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli.mission_command import Given, MissionCommand, Scope, option
from missions.cli.options import PLACE, coordinates, degrees

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec


def _world(given: Given, options: Any, world: "WorldSpec") -> "WorldSpec":
    from missions.vision_search.world import HiddenTag, vision_search_world

    hidden = HiddenTag(
        place_ne_m=given["target"],
        speed_m_s=given["target_speed"],
        misalignment_rad=math.radians(given["misalignment"]),
        film=given["film"],
    )
    return vision_search_world(world, options, hidden)


COMMAND: Final = MissionCommand(
    help=(
        "Find a tagged target in an area with downward cameras, and localize it.\n\n"
        "Each vehicle keeps a belief about the target's place, on a grid or by particles, from what the "
        "cameras of the team detect and do not detect; the vehicles send each other the likelihoods of their "
        "frames. When the belief is narrow, they fly over the target in several directions, or around it. "
        "Places are metres from the first vehicle's home."
    ),
    options=(
        option(
            "--area",
            type=coordinates("SOUTH,WEST,NORTH,EAST"),
            default="-150,-150,150,150",
            help="Of the search, m.",
        ),
        option(
            "--planner",
            type=click.Choice(["sweep", "lissajous", "horizon"]),
            default="sweep",
            help="Legs, a Lissajous curve, or where the next steps detect most probably.",
        ),
        option("--curve", default="L4", help="The Lissajous curve, L1 to L4."),
        option("--spacing", type=float, help="Of the sweep's legs, m. [default: 0.8 of what is seen across]"),
        option(
            "--view", type=degrees, default=70.0, help="Angle across the picture that is expected, degrees."
        ),
        option("--step", type=float, help="Between places, m. [default: 20; an aircraft: 2.5 turn radii]"),
        option("--horizon", type=int, default=4, help="Steps that are planned; 1: greedy."),
        option("--beam", type=int, default=6, help="Sequences of steps that are kept at each depth."),
        option(
            "--localize",
            type=click.Choice(["passes", "orbit"]),
            default="passes",
            help="Over the target in several directions, or around it (multicopters).",
        ),
        option("--localize-sigma", type=float, default=15.0, help="Localize from this sigma on, m."),
        option("--passes", type=int, default=6, help="The search ends after so many, of all vehicles."),
        option("--steps", type=int, default=2000, help="And after so many steps of a vehicle."),
        option("--search-time", type=float, default=1800.0, help="And after this time, s."),
        option("--speed", type=float, help="m/s. [default: 8; an aircraft: its own airspeed]"),
        option(
            "--law",
            type=click.Choice(["trajectory", "backstepping"]),
            default="trajectory",
            help="How a multicopter flies a step.",
        ),
        option("--acceptance", type=float, help="A place is reached within it, m. [default: 0.4 steps]"),
        option("--rate", type=float, default=25.0, help="Setpoints per vehicle second."),
        option("--altitude", type=float, default=60.0, help="Above home, m. [default for an aircraft: 90]"),
        option("--separation", type=float, default=6.0, help="Between the altitudes of a team, m."),
        option("--sensor-limit", type=float, default=60.0, help="Give up without a frame for so long, s."),
        option("--tag-id", type=int, default=0, help="Number of the tag (AprilTag 36h11)."),
        option("--tag-size", type=float, default=2.0, help="Side of its black square, m."),
        option(
            "--belief",
            type=click.Choice(["grid", "particles"]),
            default="grid",
            help="How the belief is represented.",
        ),
        option("--cell", type=float, help="Of the grid, m. [default: 1/400 of the longer side]"),
        option("--particles", type=int, default=6400, help="Number of particles."),
        option("--target-walk", type=float, default=0.0, help="Sigma of the target's walk, m in a second."),
        option("--place-sigma", type=float, default=0.15, help="Error of the vehicles' places, m."),
        option("--height-sigma", type=float, default=0.4, help="Of their heights, m."),
        option("--yaw-sigma", type=degrees, default=0.6, help="Of their yaw, degrees."),
        option("--tilt-sigma", type=degrees, default=0.23, help="Of their roll and pitch, degrees."),
        option("--mount-sigma", type=degrees, default=0.29, help="Of the cameras' mounts, degrees."),
        option("--place-time", type=float, default=60.0, help="Correlation time of the places' errors, s."),
        option("--attitude-time", type=float, default=60.0, help="And of the attitudes' errors, s."),
        option("--link-loss", type=float, default=0.0, help="Share of the likelihoods that are lost."),
        option("--link-delay", type=float, default=0.0, help="Their mean delay, s."),
        option("--link-repeats", type=int, default=1, help="How often each is sent."),
        option("--search-seed", type=int, default=0, help="Of the random numbers of filter and link."),
        option("--target", scope=Scope.EMBEDDED, type=PLACE, help="True place, m. [default: drawn]"),
        option("--target-speed", scope=Scope.EMBEDDED, type=float, default=0.0, help="Of the target, m/s."),
        option(
            "--film",
            scope=Scope.EMBEDDED,
            is_flag=True,
            show_default=False,
            help="Keep each camera's pictures as a lossless video, for `flightstack vision`; slow and large.",
        ),
        option(
            "--misalignment",
            scope=Scope.EMBEDDED,
            type=float,
            default=0.3,
            help="Sigma of the cameras' true angles on their mounts, degrees.",
        ),
    ),
    made=("missions.vision_search.options", "VisionSearchOptions"),
    world=_world,
)
