"""`flightstack vehicle params`: list, get, set, save, load and compare parameters."""

from pathlib import Path
from typing import Final

import click

from missions.cli.later import body_in
from missions.cli.vehicle_link import CONNECTED

_BODIES: Final = "missions.cli.bodies.vehicle_params"


@click.group()
def params() -> None:
    """Parameters: list, get, set, save, load, compare."""


@params.command("list", params=[*CONNECTED])
@click.argument("pattern", default="*")
@body_in(_BODIES)
def list_() -> None:
    """List all parameters, or those whose names match PATTERN (for example MPC_*)."""


@params.command(params=[*CONNECTED])
@click.argument("names", nargs=-1, required=True)
@body_in(_BODIES)
def get() -> None:
    """Read parameters by name."""


@params.command("set", params=[*CONNECTED])
@click.argument("name")
@click.argument("value", type=float)
@body_in(_BODIES)
def set_() -> None:
    """Set a parameter, and read it back. (A negative value: put -- before it.)"""


@params.command(params=[*CONNECTED])
@click.argument("file", type=click.Path(path_type=Path))
@body_in(_BODIES)
def save() -> None:
    """Save all parameters to FILE: .params (QGroundControl), .parm or .param (ArduPilot, MAVProxy)."""


@params.command(params=[*CONNECTED])
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--yes", is_flag=True, help="No question.")
@body_in(_BODIES)
def load() -> None:
    """Set the parameters in FILE that differ on the vehicle, after asking; each is read back."""


@params.command(params=[*CONNECTED])
@click.argument("other", metavar="FILE|defaults")
@body_in(_BODIES)
def compare() -> None:
    """What differs from FILE, or from the firmware's defaults as PX4 1.16 and ArduPilot 4.6 have them.

    Exit code 1 when something does.
    """
