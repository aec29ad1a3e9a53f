"""`flightstack estimate`: an estimator on a live link, in its own process."""

from pathlib import Path
from typing import Final

import click

from estimators.names import ESTIMATORS
from missions.cli.later import body_in
from missions.cli.options import FiniteRange
from missions.cli.signing import key_option

_BODIES: Final = "missions.cli.bodies.estimate"
_SECONDS = FiniteRange(min=0.0, min_open=True, max=1e9)
_HELP: Final = f"""Run an estimator on a live link: {", ".join(ESTIMATORS)}, or a Python file.

It receives a vehicle's messages, sends its estimates from its own component id, and logs everything: a
replay of flight.tlog in the run folder gives the same estimates.

Exit codes: 0 done, 1 the link was silent or lacks messages that the estimator needs (the data received
are kept), 2 usage, 130 interrupted before --duration was over.
"""


@click.command(help=_HELP)
@click.argument("name", metavar="NAME|FILE.py")
@click.option(
    "--connect", required=True, metavar="URL", help="Vehicle's link: udpin:0.0.0.0:14550, serial:..."
)
@click.option("--duration", type=_SECONDS, metavar="S", help="Vehicle time. [default: until Ctrl-C]")
@click.option(
    "--system-id", type=click.IntRange(1, 255), metavar="N", help="Vehicle. [default: the first one received]"
)
@click.option(
    "--component-id",
    type=click.IntRange(191, 194),
    default=191,
    show_default=True,
    help="Component id of the estimator.",
)
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Parameter of the estimator.")
@click.option("--publish/--no-publish", default=True, show_default=True, help="Send estimates on the link.")
@click.option("--no-request", is_flag=True, help="No requests of the rates that are needed.")
@click.option(
    "--silence", type=_SECONDS, default=10.0, show_default=True, metavar="S",
    help="End when nothing was received from the vehicle for so long, wall seconds.",
)  # fmt: skip
@click.option(
    "--against", type=click.Choice(["autopilot", "truth", "both"]), default="both", show_default=True,
    help="Reference that the estimates are compared with afterwards.",
)  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), help="Run folder. [default: runs/ESTIMATOR-N]")
@click.option("--no-picture", is_flag=True, help="No picture errors.png.")
@key_option()
@body_in(_BODIES)
def estimate() -> None: ...
