"""Common parts of all `flightstack vehicle` commands: the link, one-line errors, JSON, the confirmation."""

import asyncio
import json
from collections.abc import Callable, Coroutine, Mapping
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click

from autopilot_bridge.errors import AddressError, BridgeError
from autopilot_bridge.parameters import ParameterError
from missions.cli.confirm import YES_WORDS, ask, can_ask, is_yes
from missions.cli.options import FiniteRange, in_options
from missions.errors import MissionError, PlanError, VehicleTimeout

if TYPE_CHECKING:
    from autopilot_bridge.links import Address
    from missions.vehicle_client.client import VehicleClient

T = TypeVar("T")
FAILED: Final = 1
_LISTEN_S: Final = 2.0

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


def address(text: str) -> "Address":
    """Parse a connection string of the command line."""
    from autopilot_bridge.links import VEHICLE_FORMS, parse_address

    try:
        return parse_address(text, VEHICLE_FORMS)
    except AddressError as error:
        raise click.UsageError(in_options(error)) from error


def run(work: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine to its end. An error is printed as one line, and the exit code gives its class."""
    try:
        return asyncio.run(work)
    except (PlanError, ParameterError) as error:
        raise click.UsageError(in_options(error)) from error
    except (MissionError, BridgeError) as error:
        raise click.ClickException(in_options(error)) from error


def with_client(
    given: Mapping[str, Any], work: "Callable[[VehicleClient], Coroutine[Any, Any, T]]", *, asks: bool = True
) -> T:
    """Run `work` with the vehicle that the options name; with `asks`, only if the vehicle answers."""
    link = address(given["connect"])
    from missions.vehicle_client.client import open_client
    from missions.vehicle_client.listening import SIGNED, listen

    async def whole() -> T:
        answered = False
        try:
            async with open_client(link, timeout_s=given["timeout"], system_id=given["system_id"]) as client:
                answered = True
                if asks:
                    await client.require_answers()
                return await work(client)
        except VehicleTimeout as error:
            if answered and (await listen(link, _LISTEN_S, given["system_id"])).signed:
                raise VehicleTimeout(f"{error}; {SIGNED}") from error
            raise
        raise AssertionError("not reached")

    return run(whole())


def print_json(value: Any, *, one_line: bool = False) -> None:
    """Print plain values as JSON; NaN and infinity become null."""
    click.echo(json.dumps(_finite(value), indent=None if one_line else 2, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if value == value and abs(value) != float("inf") else None
    if isinstance(value, Mapping):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return value


async def confirm(question: str, yes: bool) -> None:
    """Ask the user for a yes; without a terminal, --yes must be specified."""
    if yes:
        return
    if not can_ask():
        raise click.UsageError(f"{question}: not confirmed; there is no terminal to ask on: give --yes")
    if not is_yes(await ask(f"{question}? Type {YES_WORDS}")):
        raise click.ClickException("not confirmed, nothing was done")
