"""The options of all `flightstack vehicle` commands."""

from collections.abc import Callable
from typing import Any

import click

from missions.cli.options import FiniteRange

_OPTIONS = (
    click.option(
        "--connect",
        required=True,
        metavar="URL",
        help="Vehicle's link: udpin:0.0.0.0:14550, tcp:HOST:5760, serial:DEVICE:BAUD",
    ),
    click.option(
        "--system-id",
        type=click.IntRange(1, 255),
        help="System id of the vehicle, where several are on the link.",
    ),
    click.option(
        "--timeout",
        type=FiniteRange(0.5, 600.0),
        default=10.0,
        show_default=True,
        help="Time for the vehicle's heartbeat, s.",
    ),
    click.option("--json", "as_json", is_flag=True, help="Output as JSON, for scripts."),
)


def connected(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator for the options of every command that connects to a vehicle."""
    for add in reversed(_OPTIONS):
        command = add(command)
    return command
