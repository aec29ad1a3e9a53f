"""The options of all `flightstack vehicle` commands."""

from typing import Final

import click

from missions.cli.declared_options import declared_options
from missions.vehicle_client.options import ConnectionOptions

CONNECTED: Final = (
    click.Option(
        ["--connect"],
        required=True,
        metavar="URL",
        help="Vehicle's link: udpin:0.0.0.0:14550, tcp:HOST:5760, serial:DEVICE:BAUD",
    ),
    *declared_options(ConnectionOptions),
    click.Option(["--json", "as_json"], is_flag=True, help="Output as JSON, for scripts."),
)
"""The options of every command that connects to a vehicle."""
