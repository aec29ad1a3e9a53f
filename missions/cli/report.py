"""`flightstack report`: pages of runs and logs, and the results of a program that was killed."""

from pathlib import Path
from typing import Final

import click

from missions.cli.later import body_in

_BODIES: Final = "missions.cli.bodies.report"


@click.command()
@click.argument("paths", nargs=-1, required=True, metavar="RUN|LOG...", type=click.Path(path_type=Path))
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Folder for the results of a LOG, or of a comparison. [default: runs/LOG-N, runs/report-N]",
)
@click.option("--no-picture", is_flag=True, help="Summary only: no picture track.png, and no page.")
@body_in(_BODIES)
def report() -> None:
    """Make the page report.html of a run or a log (.tlog, .bin, .ulg), or one that compares several.

    A run folder whose program has crashed or was killed gets its summary.json and track.png, too, and so does
    a telemetry log. Only the page replaces an earlier one.
    """
