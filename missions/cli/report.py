"""`flightstack report`: summary and picture of a flight from the log that is left."""

from pathlib import Path
from typing import Final

import click

from missions.cli.later import body_in

_BODIES: Final = "missions.cli.bodies.report"


@click.command()
@click.argument("path", metavar="FOLDER|LOG", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Folder for the results of a LOG. [default: runs/LOG-N]",
)
@click.option("--no-picture", is_flag=True, help="No picture track.png.")
@body_in(_BODIES)
def report() -> None:
    """Make summary.json and track.png of a flight whose program has crashed or was killed.

    FOLDER is its run folder, which is completed; LOG is a telemetry log. Nothing is overwritten.
    """
