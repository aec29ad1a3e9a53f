"""`flightstack vehicle`: what is connected, its parameters, its logs, its health; and acting on it."""

from pathlib import Path
from typing import Final

import click

from missions.cli.later import body_in
from missions.cli.vehicle_actions import disarm, hold, land, return_, watch
from missions.cli.vehicle_link import CONNECTED
from missions.cli.vehicle_params import params

_BODIES: Final = "missions.cli.bodies.vehicle"


@click.group()
def vehicle() -> None:
    """Talk to a vehicle: what it is, its parameters, its logs, its health (through MAVSDK).

    Act on it, as after a crash of a flight's program: return, land, hold, disarm, watch.
    """


vehicle.add_command(params)


for action in (return_, land, hold, disarm, watch):
    vehicle.add_command(action)


@vehicle.command(params=[*CONNECTED])
@body_in(_BODIES)
def info() -> None:
    """What is connected: autopilot, versions, capabilities, components, position, battery, mode."""


@vehicle.group()
def logs() -> None:
    """Logs on the vehicle: list, download, erase."""


@logs.command("list", params=[*CONNECTED])
@body_in(_BODIES)
def list_logs() -> None:
    """The logs that are there."""


@logs.command(params=[*CONNECTED])
@click.argument("which", metavar="NUMBER|newest|all", default="newest")
@click.option(
    "--to", "folder", type=click.Path(path_type=Path), default=Path("."), show_default=True, help="Folder."
)
@body_in(_BODIES)
def download() -> None:
    """Fetch logs. Those that are in the folder already, whole, are not fetched again."""


@logs.command(params=[*CONNECTED])
@click.option("--yes", is_flag=True, help="No question.")
@body_in(_BODIES)
def erase() -> None:
    """Delete all logs of the vehicle, after asking."""


@vehicle.command(params=[*CONNECTED])
@body_in(_BODIES)
def doctor() -> None:
    """How it is, and what keeps it from arming. Exit code 1 when something stands against a flight."""
