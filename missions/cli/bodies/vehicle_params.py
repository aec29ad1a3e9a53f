"""What `flightstack vehicle params` does."""

import fnmatch
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.parameter_files import read_untyped_parameter_file
from estimators.errors import LogError
from estimators.logs.new_file import new_file
from flightsim.airframe import AirframeKind
from flightsim.foundation.plain_text import plain_text
from missions.cli.bodies.vehicle_link import confirm, print_json, with_client
from missions.cli.exit_codes import FAILED
from missions.cli.options import in_options, report
from missions.errors import PlanError
from missions.vehicle_client import parameters as client_parameters
from missions.vehicle_client.client import VehicleClient
from missions.vehicle_client.parameters import (
    Difference,
    Value,
    differences,
    format_values,
    read_all,
    read_one,
    write_one,
)


def list_(pattern: str, **given: Any) -> int:
    """`flightstack vehicle params list`."""
    values = with_client(given, read_all)
    kept = {name: value for name, value in values.items() if fnmatch.fnmatchcase(name, pattern.upper())}
    _print_values(kept, as_json=given["as_json"])
    if not kept:
        report(f"no parameter matches {pattern!r} among {len(values)}")
    return 0 if kept else FAILED


def _print_values(values: Mapping[str, Value], *, as_json: bool) -> None:
    if as_json:
        print_json({name: {"value": value.number, "type": value.type} for name, value in values.items()})
        return
    for name, value in values.items():
        click.echo(f"{plain_text(name):<16} {value}")


def get(names: tuple[str, ...], **given: Any) -> int:
    """`flightstack vehicle params get`."""

    async def work(client: VehicleClient) -> dict[str, Value]:
        return {name.upper(): await read_one(client, name.upper()) for name in names}

    _print_values(with_client(given, work), as_json=given["as_json"])
    return 0


def set_(name: str, value: float, **given: Any) -> int:
    """`flightstack vehicle params set`."""
    name = name.upper()

    async def work(client: VehicleClient) -> tuple[Value, Value]:
        before = await read_one(client, name)
        return before, await write_one(client, name, value, before.type)

    before, kept = with_client(given, work)
    if given["as_json"]:
        print_json({name: {"before": before.number, "value": kept.number, "type": kept.type}})
    else:
        click.echo(f"{name}: {before} -> {kept}")
    return 0


def save(file: Path, **given: Any) -> int:
    """`flightstack vehicle params save`."""
    if file.exists():
        raise click.UsageError(f"{file} is there already, and nothing is overwritten; choose another name")
    if not file.parent.is_dir():
        raise click.UsageError(f"{file}: there is no folder {file.parent}")

    async def work(client: VehicleClient) -> tuple[int, str]:
        format_values(file, {}, client.system_id)  # reports an unknown suffix before any parameter is read
        values = await read_all(client)
        return len(values), format_values(file, values, client.system_id)

    count, text = with_client(given, work)
    try:
        with new_file(file) as part:
            part.write_text(text, encoding="utf-8")
    except LogError as error:
        raise click.UsageError(in_options(error)) from error
    if given["as_json"]:
        print_json({"file": str(file), "parameters": count})
    else:
        click.echo(f"{count} parameters saved to {file}")
    return 0


def load(file: Path, yes: bool, **given: Any) -> int:
    """`flightstack vehicle params load`."""

    async def work(client: VehicleClient) -> tuple[list[Difference], list[str]]:
        wanted = read_untyped_parameter_file(file)
        changes = client_parameters.differences(await client_parameters.read_all(client), wanted)
        settable = [change for change in changes if change.vehicle is not None]
        if settable:
            if not given["as_json"]:
                _print_differences(settable)
            noun = "parameter" if len(settable) == 1 else "parameters"
            await confirm(f"set {len(settable)} {noun} of vehicle {client.system_id}", yes)
        return changes, await client_parameters.load(client, settable, lambda line: None)

    changes, refused = with_client(given, work)
    unknown = [change.name for change in changes if change.vehicle is None]
    done = len(changes) - len(unknown) - len(refused)
    if given["as_json"]:
        print_json({"set": done, "refused": refused, "unknown": unknown})
    else:
        click.echo(f"{done} {'parameter' if done == 1 else 'parameters'} set")
    for text in refused:
        report(text)
    if unknown:
        report(f"the vehicle has no {', '.join(unknown)}")
    return FAILED if refused or unknown else 0


def compare(other: str, **given: Any) -> int:
    """`flightstack vehicle params compare`."""

    async def work(client: VehicleClient) -> list[Difference]:
        if other != "defaults":
            return differences(await read_all(client), read_untyped_parameter_file(Path(other)))
        found = differences(await read_all(client), _defaults(client), rounded=True)
        # our tables may contain parameters that the vehicle lacks
        return [d for d in found if d.vehicle is not None]

    found = with_client(given, work)
    if given["as_json"]:
        print_json(
            [{"name": d.name, "vehicle": d.vehicle and d.vehicle.number, "other": d.other} for d in found]
        )
    else:
        if found:
            _print_differences(found)
        click.echo(f"{len(found)} differ" if found else "no difference")
    return FAILED if found else 0


def _print_differences(found: list[Difference]) -> None:
    click.echo(f"{'name':<16} {'vehicle':>16} {'other':>16}")
    for d in found:
        other = "-" if d.other is None else str(Value(number=d.other, type=9))
        if d.other is not None and d.vehicle is not None and isinstance(d.vehicle.number, int):
            other = f"{d.other:.0f}" if d.other == int(d.other) else other
        click.echo(
            f"{plain_text(d.name):<16} {'none' if d.vehicle is None else str(d.vehicle):>16} {other:>16}"
        )


def _defaults(client: VehicleClient) -> dict[str, float]:
    if not client.flavour or client.kind is None:
        raise PlanError("defaults are known of PX4 and ArduPilot, for multicopters and aircraft; give a file")
    definitions = get_flavour(client.flavour, AirframeKind(str(client.kind))).parameter_definitions()
    return {definition.name: definition.convert(definition.default) for definition in definitions}
