"""`flightstack estimate`: an estimator on a live link, in its own process."""

from pathlib import Path
from typing import Final

import click

from estimators.names import ESTIMATORS
from missions.cli.declared_options import declared_options
from missions.cli.later import body_in
from missions.cli.signing import key_option
from missions.cli.view_option import view_option
from missions.estimation.options import LiveOptions

_BODIES: Final = "missions.cli.bodies.estimate"
_HELP: Final = f"""Run an estimator on a live link: {", ".join(ESTIMATORS)}, or a Python file.

It receives a vehicle's messages, sends its estimates from its own component id, and logs everything: a
replay of flight.tlog in the run folder gives the same estimates.

Exit codes: 0 done, 1 the link was silent or lacks messages that the estimator needs (the data received
are kept), 2 usage, 130 interrupted before --duration was over.
"""


@click.command(help=_HELP, params=[*declared_options(LiveOptions), key_option()])
@click.argument("name", metavar="NAME|FILE.py")
@click.option(
    "--connect", required=True, metavar="URL", help="Vehicle's link: udpin:0.0.0.0:14550, serial:..."
)
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Parameter of the estimator.")
@click.option("--publish/--no-publish", default=True, show_default=True, help="Send estimates on the link.")
@click.option("--no-request", is_flag=True, help="No requests of the rates that are needed.")
@click.option("--out", type=click.Path(path_type=Path), help="Run folder. [default: runs/ESTIMATOR-N]")
@view_option()
@click.option("--no-picture", is_flag=True, help="No picture errors.png.")
@body_in(_BODIES)
def estimate() -> None: ...
