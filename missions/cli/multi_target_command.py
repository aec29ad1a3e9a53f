"""The command-line options of the search for an unknown number of targets."""

from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli.mission_command import Given, MissionCommand, Scope, option
from missions.cli.options import PLACE, coordinates, degrees, pair

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec


def _world(given: Given, options: Any, world: "WorldSpec") -> "WorldSpec":
    from missions.multi_target.world import TargetField, multi_target_world

    field = TargetField(
        count=given["targets"],
        clusters=min(given["clusters"], given["targets"]),
        cluster_sigma_m=given["cluster_sigma"],
        speed_m_s=given["target_speed"],
    )
    return multi_target_world(
        world, options, field, terrain_relief_m=given["terrain"], scan_period_s=given["scan_period"]
    )


COMMAND: Final = MissionCommand(
    help=(
        "Find an unknown number of targets with a sensor of range and bearing that misses some.\n\n"
        "The vehicle fuses each scan in a PHD filter and flies, step by step, where a scan gives most: "
        "information about targets that it has detected, or area that it has not seen. The vehicles of a "
        "team share the belief and plan in turn. Places are metres from the first vehicle's home."
    ),
    options=(
        option(
            "--area",
            type=coordinates("SOUTH,WEST,NORTH,EAST"),
            default="-30,-30,270,270",
            help="Of the search, m.",
        ),
        option("--start", type=PLACE, default="10,10", help="Place of the first scan, m."),
        option(
            "--planner",
            type=click.Choice(["exploring", "information", "sweep"]),
            default="exploring",
            help="Information and exploration, information alone, or the legs of a parallel sweep.",
        ),
        option("--step", type=float, help="To the next scan, m. [default: 9; an aircraft: 2.5 turn radii]"),
        option("--alpha", type=float, default=0.3, help="Weight of exploration against information, nats."),
        option(
            "--exploration",
            type=click.Choice(["view", "place"]),
            default="view",
            help="Targets that a scan detects for the first time, or the map at its place (the paper's).",
        ),
        option("--horizon", type=int, default=3, help="Steps that are planned; the paper plans 1."),
        option("--beam", type=int, default=6, help="Sequences of steps that are kept at each depth."),
        option("--spacing", type=float, help="Of the sweep's legs, m. [default: one pass in all steps]"),
        option("--steps", type=int, default=240, help="The search ends after so many."),
        option("--search-time", type=float, help="And after this time, s. [default: no limit]"),
        option(
            "--undetected",
            type=float,
            help="And when fewer targets than this are expected to be left. [default: never]",
        ),
        option("--speed", type=float, help="m/s. [default: 4; an aircraft: its own airspeed]"),
        option(
            "--law",
            type=click.Choice(["trajectory", "backstepping"]),
            default="trajectory",
            help="How a multicopter flies a step: a reference within its limits, or a backstepping law.",
        ),
        option("--acceptance", type=float, help="A place is reached within it, m. [default: 2]"),
        option("--rate", type=float, default=25.0, help="Setpoints per vehicle second."),
        option("--altitude", type=float, default=20.0, help="Above home, m. [default for an aircraft: 60]"),
        option("--separation", type=float, default=4.0, help="Between the altitudes of a team, m."),
        option(
            "--belief",
            type=click.Choice(["particles", "gaussians"]),
            default="particles",
            help="How the filter represents the targets.",
        ),
        option("--expected-targets", type=float, default=18.0, help="In the area, before the search."),
        option(
            "--motion",
            type=click.Choice(["static", "random-walk", "constant-velocity"]),
            default="static",
            help="How targets move, as the filter expects.",
        ),
        option("--gain", type=float, default=0.98, help="Probability to detect a target below the vehicle."),
        option(
            "--field-of-view",
            type=pair("FORWARD[,RIGHT]", "x,"),
            default="15",
            help="Scales of the sensor's fall, m.",
        ),
        option("--range-sigma", type=float, default=0.5, help="Noise of the sensor's range, m."),
        option("--bearing-sigma", type=degrees, default=1.7, help="Noise of its bearing, degrees."),
        option("--clutter", type=float, default=0.0, help="False detections per scan, on average."),
        option("--found-width", type=float, default=0.5, help="A found target is narrower, m."),
        option("--found-mass", type=float, default=0.9, help="And has at least this expected number."),
        option("--found-distance", type=float, default=4.0, help="Its measurements lie within, m."),
        option("--sensor-limit", type=float, default=120.0, help="Give up without a scan for so long, s."),
        option("--search-seed", type=int, default=0, help="Of the random numbers of filter and planner."),
        option("--targets", scope=Scope.EMBEDDED, type=int, default=18, help="Number of true targets."),
        option(
            "--clusters",
            scope=Scope.EMBEDDED,
            type=int,
            default=3,
            help="They lie in; 0: uniform over the area.",
        ),
        option("--cluster-sigma", scope=Scope.EMBEDDED, type=float, default=14.0, help="Of a cluster, m."),
        option("--target-speed", scope=Scope.EMBEDDED, type=float, default=0.0, help="Of each target, m/s."),
        option(
            "--terrain",
            scope=Scope.EMBEDDED,
            type=float,
            metavar="RELIEF",
            help="Terrain of this standard deviation, m, hides targets. [default: level ground]",
        ),
        option("--scan-period", scope=Scope.EMBEDDED, type=float, default=1.0, help="Between scans, s."),
    ),
    made=("missions.multi_target.options", "MultiTargetOptions"),
    world=_world,
)
