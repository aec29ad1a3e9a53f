"""`flightstack vehicle return|land|hold|disarm|watch`: act on a vehicle without flying a mission."""

from typing import Final

import click

from missions.cli.later import body_in
from missions.cli.signing import key_option
from missions.cli.vehicle_link import CONNECTED

_BODIES: Final = "missions.cli.bodies.vehicle_actions"


_ACTING: Final = (*CONNECTED, key_option())
"""The options of commands that use this program's own link to the vehicle."""


@click.command(name="return", params=[*_ACTING])
@body_in(_BODIES)
def return_() -> None:
    """Command it to return home and land (RTL), and print what it answers and does."""


@click.command(params=[*_ACTING])
@body_in(_BODIES)
def land() -> None:
    """Command it to land where it is, and print what it answers and does."""


@click.command(params=[*_ACTING])
@body_in(_BODIES)
def hold() -> None:
    """Command it to hold its position (an aircraft circles), and print what it answers and does."""


@click.command(params=[*_ACTING])
@click.option(
    "--force",
    is_flag=True,
    help="Disarming in the air too, after a question: the motors stop, and the vehicle falls.",
)
@click.option("--yes", is_flag=True, help="No question, with --force.")
@body_in(_BODIES)
def disarm() -> None:
    """Disarm it on the ground; in the air it is refused, unless --force is given and confirmed."""


@click.command(params=[*_ACTING])
@body_in(_BODIES)
def watch() -> None:
    """Show mode, height, battery and texts until Ctrl-C; nothing is commanded.

    On a terminal it is one line, in a pipe one line a second. With --json each line is an object.
    """
