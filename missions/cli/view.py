"""`flightstack view`: runs and logs in a viewer."""

from pathlib import Path
from typing import Final

import click

from estimators.names import ESTIMATORS
from missions.cli.later import body_in
from missions.cli.view_option import VIEW_HELP

_BODIES: Final = "missions.cli.bodies.view"


@click.command()
@click.argument("paths", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RUN|LOG...")
@click.option("--view", "target", metavar="WHERE", help=f"{VIEW_HELP} [default: window]")
@click.option(
    "--estimator",
    metavar="NAME|FILE.py",
    help=f"Estimator that is run over each log and shown, too: {', '.join(ESTIMATORS)}, or a Python file "
    "with an Estimator of your own. [default: what the run has recorded]",
)
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Parameter of the estimator.")
@click.option(
    "--dialect", metavar="NAME|FILE.xml", help="Dialect of the logs. [default: all of MAVLink's messages]"
)
@body_in(_BODIES)
def view() -> None:
    """Show runs and logs in a viewer: vehicles, truth beside estimate, plans, fences, beliefs, errors,
    events.

    RUN is a run folder, LOG a .tlog, an ArduPilot .bin or a PX4 .ulg. Several are shown as recordings that
    can be put side by side.

    Exit codes: 0 done, 1 a log could not be read or the viewer not be opened, 2 usage.
    """
