"""`flightstack study show` and `compare`: the results of studies that were run."""

from typing import Final

import click

from missions.cli.later import body_in

_BODIES: Final = "missions.cli.bodies.study_results"


@click.command(context_settings={"show_default": True})
@click.argument("folder", metavar="DIR|URI")
@click.option("--failed", is_flag=True, help="List the trials without success, with the command of each.")
@click.option("--json", "as_json", is_flag=True, help="Summary as JSON.")
@body_in(_BODIES)
def show() -> None:
    """Print the table of a study, complete or not.

    Figures, intervals and notes are computed again from its rows. The studies of this program print their own
    tables; one of a Python file prints the table of every study.
    """


@click.command()
@click.argument("first", metavar="DIR|URI")
@click.argument("second", metavar="DIR|URI")
@click.option("--json", "as_json", is_flag=True, help="Differences as JSON.")
@body_in(_BODIES)
def compare() -> None:
    """Compare two studies: the differences second - first in cells with the same parameters.

    Trials with equal seeds and parameters are compared in pairs. Where the studies have none, their means are
    compared without pairs.
    """
