"""Common parts of all `flightstack vehicle` commands: the link, one-line errors, JSON, the confirmation."""

import asyncio
import json
from collections.abc import Callable, Coroutine, Mapping
from typing import Any, Final, TypeVar

import click

from autopilot_bridge.errors import AddressError, BridgeError
from autopilot_bridge.links import VEHICLE_FORMS, Address, parse_address
from autopilot_bridge.parameters import ParameterError
from missions.cli.bodies.confirm import YES_WORDS, ask, can_ask, is_yes
from missions.cli.declared_options import specified
from missions.cli.options import in_options
from missions.errors import MissionError, PlanError, VehicleTimeout
from missions.vehicle_client.client import VehicleClient, open_client
from missions.vehicle_client.listening import SIGNED, listen
from missions.vehicle_client.options import ConnectionOptions

T = TypeVar("T")
_LISTEN_S: Final = 2.0


def address(text: str) -> Address:
    """Parse a connection string of the command line."""
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
    given: Mapping[str, Any], work: Callable[[VehicleClient], Coroutine[Any, Any, T]], *, asks: bool = True
) -> T:
    """Run `work` with the vehicle that the options name; with `asks`, only if the vehicle answers."""
    link, options = address(given["connect"]), specified(ConnectionOptions)

    async def whole() -> T:
        answered = False
        try:
            async with open_client(link, options) as client:
                answered = True
                if asks:
                    await client.require_answers()
                return await work(client)
        except VehicleTimeout as error:
            if answered and (await listen(link, _LISTEN_S, options.system_id)).signed:
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
