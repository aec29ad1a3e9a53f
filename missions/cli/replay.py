"""`flightstack replay`: runs an estimator over logs."""

from pathlib import Path
from typing import Final

import click

from estimators.names import ESTIMATORS
from missions.cli.later import body_in
from missions.cli.options import FiniteRange

_BODIES: Final = "missions.cli.bodies.replay"
_SECONDS = FiniteRange(min=0.0, max=1e9)


@click.command()
@click.argument("logs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="LOG...")
@click.option(
    "--estimator",
    required=True,
    metavar="NAME|FILE.py",
    help=f"Estimator: {', '.join(ESTIMATORS)}, or a Python file with an Estimator of your own.",
)
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Parameter of the estimator.")
@click.option(
    "--system-id", type=click.IntRange(1, 255), metavar="N", help="Vehicle. [default: all in a log]"
)
@click.option(
    "--against",
    type=click.Choice(["autopilot", "truth", "both"]),
    default="both",
    show_default=True,
    help="Reference that the estimates are compared with; of both, the autopilot's word leads the summary.",
)
@click.option(
    "--from",
    "from_s",
    type=_SECONDS,
    metavar="S",
    help="Begin at this time, seconds since the vehicle's boot, as log info prints it.",
)
@click.option("--to", "to_s", type=_SECONDS, metavar="S", help="End at this time.")
@click.option(
    "--boot",
    type=click.IntRange(min=0),
    metavar="N",
    help="Boot of the vehicle, as log info numbers them. [default: all]",
)
@click.option(
    "--dialect", metavar="NAME|FILE.xml", help="Dialect of the logs. [default: all of MAVLink's messages]"
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Run folder, or folder of theirs. [default: runs/ESTIMATOR-N]",
)
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
