"""`flightstack study sweep`: any mission over values of its options, flight by flight as `flightstack
fly`.
"""

from typing import Final

import click

from missions.cli.declared_options import declared_options
from missions.cli.later import later
from missions.cli.study_command import StudyCommand
from missions.studies.options import SweepOptions


class _SweepCommand(click.Command):
    """`sweep`: options of the mission follow after --."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            raise click.UsageError(
                f"no option {error.option_name} of sweep; options of the mission follow after --, for "
                "example: "
                "flightstack study sweep lissajous --vary wind-speed=0,4,8 -- --via setpoints"
            ) from error


SWEEP: Final = StudyCommand(
    help=(
        "Fly MISSION many times over values of its options, each value with the same seeds.\n\n"
        "MISSION and its options, after --, are those of `flightstack fly`. --vary NAME=VALUE,VALUE,... "
        "makes a "
        "grid of all combinations; values that have commas are separated by semicolons. --vary "
        "NAME=LOW..HIGH "
        "draws a value for each run. wind-speed and wind-from vary the parts of --wind. Each row has the "
        "command "
        "that flies its flight again."
    ),
    options=(
        click.Argument(["mission"], required=False),
        click.Argument(["words"], nargs=-1, type=click.UNPROCESSED, metavar="[-- OPTIONS OF THE MISSION]"),
        click.Option(["--vary"], multiple=True, metavar="NAME=VALUES", help="Option and its values; repeat."),
        *declared_options(SweepOptions),
    ),
    build=later("missions.cli.bodies.sweep", "build"),
    kind=_SweepCommand,
)
