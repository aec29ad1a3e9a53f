"""`flightstack check`: logs and runs against limits."""

from pathlib import Path
from typing import Final

import click

from missions.cli.later import body_in

_BODIES: Final = "missions.cli.bodies.check"
_PATH: Final = click.Path(path_type=Path)


@click.command()
@click.argument("paths", nargs=-1, required=True, metavar="RUN|LOG...", type=_PATH)
@click.option("--limits", required=True, metavar="FILE.toml", type=_PATH, help="File with the limits.")
@click.option("--against", metavar="RUN|LOG", type=_PATH, help="Golden run, for limits that compare.")
@click.option("--junit", metavar="FILE.xml", type=_PATH, help="Report for continuous integration.")
@body_in(_BODIES)
def check() -> None:
    """Check runs and logs against limits, and against a golden run.

    A quantity that was not measured fails its check.

    Exit codes: 0 all checks passed, 1 a check failed or a log can't be read, 2 usage.
    """
