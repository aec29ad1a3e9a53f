"""The command-line options of the handoff."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli.mission_command import Given, MissionCommand, Scope, option
from missions.cli.options import PLACE, degrees

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec


def _values(given: Given) -> Mapping[str, Any]:
    values: dict[str, Any] = {"gps_fault": not given["no_gps_fault"]}
    if given["connect"] and given["confirm_after"] is None:
        values["confirm_after_s"] = 0.0  # with real aircraft a person confirms, or the user allows it
    return values


def _world(given: Given, options: Any, world: "WorldSpec") -> "WorldSpec":
    from missions.handoff.world import WalkingTargets, handoff_world

    walking = WalkingTargets(count=given["targets"], pixels=given["camera"] == "pixels", film=given["film"])
    return handoff_world(world, options, walking)


COMMAND: Final = MissionCommand(
    help=(
        "Hand a moving target over from one aircraft to another that has no GPS "
        "(--vehicles 2).\n\n"
        "The second aircraft orbits the target. The first arrives, loses GPS, finds by range radio where the "
        "other is, tracks what moves on the ground, decides which of its tracks is the target, and takes it "
        "over. The second goes home when it has received the decision."
    ),
    options=(
        option(
            "--target",
            type=PLACE,
            default="900,200",
            help="Where the operator has seen the target, m from home; the nearest track is designated.",
        ),
        option(
            "--radius",
            type=float,
            default=150.0,
            help="Of the first aircraft's orbit, m; the tracker's is 1.25 times as wide.",
        ),
        option("--altitude", type=float, default=95.0, help="Of the first aircraft, above home, m."),
        option("--separation", type=float, default=20.0, help="The second flies so much higher, m."),
        option("--airspeed", type=float, help="m/s. [default: the aircraft's own]"),
        option("--start-distance", type=float, default=700.0, help="GPS is lost so far from the target, m."),
        option("--start-bearing", type=degrees, default=180.0, help="And there: from the target, degrees."),
        option("--no-gps-fault", is_flag=True, help="Leave GPS on; the handoff doesn't use it."),
        option(
            "--gps-off",
            type=click.Choice(["auto", "failure", "parameter"]),
            default="auto",
            help="How GPS is switched off, as for the mission orbit.",
        ),
        option("--timeout", type=float, default=900.0, help="Without a decision the flight fails, s."),
        option("--takeover", type=float, default=60.0, help="Follow the target alone for so long, s."),
        option(
            "--belief",
            type=click.Choice(["particles", "gaussians"]),
            default="gaussians",
            help="What estimates the relative pose.",
        ),
        option("--decision", type=float, default=0.99, help="Probability of a track that is decided for."),
        option(
            "--confirm-after",
            type=float,
            help=(
                "The tracker's operator confirms a doubtful target after so long, s; 0: never. "
                "[default: 5; with --connect: 0]"
            ),
        ),
        option("--link-loss", type=float, default=0.02, help="Share of the messages that are lost."),
        option("--link-delay", type=float, default=0.05, help="Their mean delay, s."),
        option("--estimator-seed", type=int, default=0, help="Of the random numbers of filters and link."),
        option("--targets", scope=Scope.EMBEDDED, type=int, default=5, help="Number of walking targets."),
        option(
            "--camera",
            scope=Scope.EMBEDDED,
            type=click.Choice(["points", "pixels"]),
            default="points",
            help="Moving points by a model, or found in rendered pictures of both cameras; slow.",
        ),
        option(
            "--film",
            scope=Scope.EMBEDDED,
            is_flag=True,
            show_default=False,
            help="Keep the pictures as lossless videos, for `flightstack vision`; large.",
        ),
    ),
    made=("missions.handoff.options", "HandoffOptions"),
    values=_values,
    world=_world,
)
