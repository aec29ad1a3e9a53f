"""The command-line options of the search with an occupancy map."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli.mission_command import Given, MissionCommand, Scope, option
from missions.cli.options import PLACE, SIDES

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec

_BY_CLASSES: Final = ("identify", ("trace", "bayes"))
_NO_CLASS: Final = "none"


def _values(given: Given) -> Mapping[str, Any]:
    if given["connect"] and given["map"] is None:
        raise click.UsageError(
            "a search needs the published magnetic map of its place; give it with --map FILE "
            "(numpy .npz, format flightstack-magnetic-map-1)"
        )
    return {"false_anomalies": ()} if given["false_class"] == (_NO_CLASS,) else {}


def _world(given: Given, options: Any, world: "WorldSpec") -> "WorldSpec":
    from missions.occupancy.world import occupancy_world

    along_m, across_m = given["sigma"]
    return occupancy_world(
        world,
        options,
        target_ne_m=given["target"],
        amplitude_nt=given["amplitude"],
        sigma_along_m=along_m,
        sigma_across_m=across_m,
        moment_a_m2=given["moment"],
        depth_m=given["depth"],
        false_count=given["false_anomalies"],
    )


COMMAND: Final = MissionCommand(
    help=(
        "Search a magnetic map for a target, as a team with one occupancy map.\n\n"
        "Each vehicle carries a survey magnetometer, flies headings from cell to cell in its own layer of "
        "altitude, and all return when the target is found or the search time is over. Places are metres "
        "from the map's home."
    ),
    options=(
        option(
            "--size",
            type=SIDES,
            metavar="SIDE|WIDTHxHEIGHT",
            default="2400",
            help="Of the searched area, m: SIDE or WIDTHxHEIGHT (east x north).",
        ),
        option("--area", type=PLACE, help="Centre of the area, m. [default: the map's home]"),
        option("--cell", type=float, default=200.0, help="Side of a cell, m."),
        option("--neighbourhood", type=int, default=1, help="Cells a decision looks at, in each direction."),
        option(
            "--heading-penalty",
            type=float,
            help="For a turn by 180 degrees, in mean prior scores. [default: 0.2; multicopters: 0.05]",
        ),
        option(
            "--detection-probability",
            type=float,
            default=0.95,
            help="Probability that a pass right over a target detects it.",
        ),
        option(
            "--detection-range",
            type=float,
            default=80.0,
            help="Distance over which that probability falls off to the sides, one sigma, m.",
        ),
        option("--threshold", type=float, default=3.0, help="Reading less map beyond it is an anomaly, nT."),
        option("--noise", type=float, default=0.5, help="Of reading less map, one sigma, nT."),
        option(
            "--map-error",
            type=float,
            help="Of the published map, one sigma, nT. [default: as the map states it, else 1]",
        ),
        option(
            "--confirmations",
            needs=("identify", ("threshold",)),
            type=int,
            default=2,
            help="Passes that must detect an anomaly at one place, with --identify threshold.",
        ),
        option("--raise-radius", type=float, default=300.0, help="Scores are raised around anomalies, m."),
        option(
            "--identify",
            type=click.Choice(["threshold", "trace", "bayes"]),
            default="threshold",
            help="The target is named by passes that detect an anomaly at one place (threshold), by a "
            "classifier on the trace of the paper's confidence (trace), or by the evidence of the classes "
            "(bayes).",
        ),
        option(
            "--class",
            sets="targets",
            needs=_BY_CLASSES,
            multiple=True,
            metavar="NAME:FORM:...",
            help="Class that is sought, with --identify trace or bayes: NAME:gaussian:NT:ALONG:ACROSS or "
            "NAME:dipole:NT:LEAST:MOST. [default: target:gaussian:30:80:60]",
        ),
        option(
            "--false-class",
            sets="false_anomalies",
            needs=_BY_CLASSES,
            multiple=True,
            metavar="NAME:FORM:...",
            help="Known class that is not sought; none: there is none. [default: boat:dipole:15:50:150]",
        ),
        option(
            "--particles",
            needs=_BY_CLASSES,
            type=int,
            default=4000,
            help="Particles of each class, with --identify trace or bayes.",
        ),
        option("--search-time", type=float, default=900.0, help="Give up after so many seconds."),
        option("--altitude", type=float, default=80.0, help="Of the lowest layer, above home, m."),
        option("--separation", type=float, default=15.0, help="Between the layers of a team, m."),
        option(
            "--speed",
            type=float,
            help="Airspeed of an aircraft, ground speed of a multicopter, m/s. [default: its own; 10]",
        ),
        option("--rate", type=float, default=25.0, help="Setpoints per second of a multicopter."),
        option(
            "--map",
            metavar="FILE",
            help="Published magnetic map (.npz). [default: the embedded world makes one from --seed]",
        ),
        option(
            "--target",
            scope=Scope.EMBEDDED,
            type=PLACE,
            help="Where the embedded world's target is, m. [default: drawn from --seed]",
        ),
        option(
            "--amplitude",
            scope=Scope.EMBEDDED,
            type=float,
            default=30.0,
            help="Amplitude of that target's Gaussian anomaly, nT.",
        ),
        option(
            "--sigma",
            type=SIDES,
            scope=Scope.EMBEDDED,
            default="80x60",
            help="Extent of that target's Gaussian anomaly, one sigma along x across, m.",
        ),
        option(
            "--moment",
            scope=Scope.EMBEDDED,
            replaces=("amplitude", "sigma"),
            type=float,
            help="Dipole moment of that target, A m2, along the Earth's field, in place of a Gaussian.",
        ),
        option(
            "--depth",
            scope=Scope.EMBEDDED,
            type=float,
            default=10.0,
            needs=("moment", ()),
            help="Depth of a target with a moment, below home, m.",
        ),
        option(
            "--false-anomalies",
            scope=Scope.EMBEDDED,
            type=click.IntRange(0, 100),
            default=0,
            help="Boats and wrecks in the embedded world, drawn from --seed.",
        ),
    ),
    made=("missions.occupancy.options", "OccupancyOptions"),
    values=_values,
    world=_world,
)
