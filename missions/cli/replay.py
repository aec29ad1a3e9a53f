"""`flightstack replay`: runs an estimator over logs."""

from pathlib import Path
from typing import Final

import click

from estimators.names import ESTIMATORS
from missions.cli.declared_options import declared_options
from missions.cli.later import body_in
from missions.cli.view_option import view_option
from missions.estimation.options import ReplayOptions

_BODIES: Final = "missions.cli.bodies.replay"


@click.command(params=[*declared_options(ReplayOptions)])
@click.argument("logs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="LOG...")
@click.option(
    "--estimator",
    required=True,
    metavar="NAME|FILE.py",
    help=f"Estimator: {', '.join(ESTIMATORS)}, or a Python file with an Estimator of your own.",
)
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Parameter of the estimator.")
@click.option(
    "--dialect", metavar="NAME|FILE.xml", help="Dialect of the logs. [default: all of MAVLink's messages]"
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Run folder, or folder of theirs. [default: runs/ESTIMATOR-N]",
)
@view_option()
@click.option("--vector", is_flag=True, help="Pictures also as SVG and PDF.")
@click.option("--no-picture", is_flag=True, help="No picture errors.png.")
@body_in(_BODIES)
def replay() -> None:
    """Run an estimator over each LOG and compare it with the autopilot and, where the log has it, the truth.

    Each log gets a run folder: summary.json, estimates.npz, estimates.csv, errors.png. Errors are those of
    the part in the air. For an estimator of a team (magnetic-identification, multi-target, target-fusion,
    vision-search)
    the logs are those of one team.

    Exit codes: 0 done, 1 a log could not be read or lacks what the estimator needs, 2 usage.
    """
