"""`flightstack vehicle`: what is connected, its parameters, its logs, its health."""

import asyncio
import fnmatch
import json
import sys
from collections.abc import Callable, Coroutine, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from autopilot_bridge.links import Address
    from missions.preflight.finding import Finding
    from missions.vehicle_client.client import VehicleClient
    from missions.vehicle_client.parameters import Difference, Value

T = TypeVar("T")
_FAILED = 1

_OPTIONS = (
    click.option(
        "--connect",
        required=True,
        metavar="URL",
        help="udpin:0.0.0.0:14550, tcp:HOST:5760, serial:DEVICE:BAUD",
    ),
    click.option("--system-id", type=click.IntRange(1, 255), help="Where several are on the link."),
    click.option(
        "--timeout", type=click.FloatRange(0.5, 600.0), default=10.0, show_default=True, help="To hear it, s."
    ),
    click.option("--json", "as_json", is_flag=True, help="Print JSON, for scripts."),
)


def _connected(command: Callable[..., Any]) -> Callable[..., Any]:
    for add in reversed(_OPTIONS):
        command = add(command)
    return command


@click.group()
def vehicle() -> None:
    """Talk to a vehicle: what it is, its parameters, its logs, its health (through MAVSDK)."""


def _address(text: str) -> "Address":
    from autopilot_bridge.errors import AddressError
    from autopilot_bridge.links import parse_address

    try:
        return parse_address(text)
    except AddressError as error:
        raise click.UsageError(str(error)) from error


def _run(work: Coroutine[Any, Any, T]) -> T:
    """Run to the end; what goes wrong is one line, and the exit code tells whose fault it was."""
    from autopilot_bridge.errors import BridgeError
    from autopilot_bridge.parameters import ParameterError
    from missions.errors import MissionError, PlanError

    try:
        return asyncio.run(work)
    except (PlanError, ParameterError) as error:
        raise click.UsageError(str(error)) from error
    except (MissionError, BridgeError) as error:
        raise click.ClickException(str(error)) from error


def _with_client(given: Mapping[str, Any], work: "Callable[[VehicleClient], Coroutine[Any, Any, T]]") -> T:
    address = _address(given["connect"])
    from missions.vehicle_client.client import open_client

    async def whole() -> T:
        async with open_client(address, timeout_s=given["timeout"], system_id=given["system_id"]) as client:
            return await work(client)
        raise AssertionError("not reached")

    return _run(whole())


def _print_json(value: Any) -> None:
    click.echo(json.dumps(_finite(value), indent=2, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if value == value and abs(value) != float("inf") else None
    if isinstance(value, Mapping):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return value


def _confirm(question: str, yes: bool) -> None:
    """Ask for a typed yes; without a terminal, --yes must be given."""
    if yes:
        return
    if not sys.stdin.isatty():
        raise click.UsageError(f"{question}: not confirmed; give --yes where nobody can be asked")
    if (
        click.prompt(f"{question}: type yes", default="", show_default=False, err=True).strip().lower()
        != "yes"
    ):
        raise click.ClickException("not confirmed, nothing was done")


# info


@vehicle.command()
@_connected
def info(**given: Any) -> int:
    """What is connected: autopilot, versions, capabilities, components, position, battery, mode."""
    from missions.vehicle_client.information import information

    found = _with_client(given, information)
    if given["as_json"]:
        _print_json(found)
        return 0
    for key, value in found.items():
        click.echo(f"{key.replace('_', ' '):<14} {_shown(value)}")
    return 0


def _shown(value: Any) -> str:
    if value is None:
        return "not told"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_shown(v)}" for key, v in value.items())
    if isinstance(value, list):
        return ", ".join(f"{v['id']} {v['name']}" if isinstance(v, Mapping) else _shown(v) for v in value)
    return f"{value:.7g}" if isinstance(value, float) and abs(value) < 1000 else str(value)


# params


@vehicle.group()
def params() -> None:
    """Parameters: list, get, set, save, load, compare."""


@params.command("list")
@click.argument("pattern", default="*")
@_connected
def list_(pattern: str, **given: Any) -> int:
    """All parameters, or those whose names match PATTERN (as MPC_*)."""
    from missions.vehicle_client.parameters import read_all

    values = _with_client(given, read_all)
    kept = {name: value for name, value in values.items() if fnmatch.fnmatchcase(name, pattern.upper())}
    _tell_values(kept, as_json=given["as_json"])
    if not kept:
        click.echo(f"flightstack: no parameter matches {pattern!r} among {len(values)}", err=True)
    return 0 if kept else _FAILED


def _tell_values(values: "Mapping[str, Value]", *, as_json: bool) -> None:
    if as_json:
        _print_json({name: {"value": value.number, "type": value.type} for name, value in values.items()})
        return
    for name, value in values.items():
        click.echo(f"{name:<16} {value}")


@params.command()
@click.argument("names", nargs=-1, required=True)
@_connected
def get(names: tuple[str, ...], **given: Any) -> int:
    """Read parameters by name."""
    from missions.vehicle_client.parameters import read_one

    async def work(client: "VehicleClient") -> "dict[str, Value]":
        return {name.upper(): await read_one(client, name.upper()) for name in names}

    _tell_values(_with_client(given, work), as_json=given["as_json"])
    return 0


@params.command("set")
@click.argument("name")
@click.argument("value", type=float)
@_connected
def set_(name: str, value: float, **given: Any) -> int:
    """Set a parameter, and read it back. (A negative value: put -- before it.)"""
    from missions.vehicle_client.parameters import read_one, write_one

    name = name.upper()

    async def work(client: "VehicleClient") -> "tuple[Value, Value]":
        before = await read_one(client, name)
        return before, await write_one(client, name, value, before.type)

    before, kept = _with_client(given, work)
    if given["as_json"]:
        _print_json({name: {"before": before.number, "value": kept.number, "type": kept.type}})
    else:
        click.echo(f"{name}: {before} -> {kept}")
    return 0


@params.command()
@click.argument("file", type=click.Path(path_type=Path))
@_connected
def save(file: Path, **given: Any) -> int:
    """Save all parameters to FILE: .params (QGroundControl), .parm or .param (ArduPilot, MAVProxy)."""
    from missions.vehicle_client.parameters import format_values, read_all

    if file.exists():
        raise click.UsageError(f"{file} is there already, and nothing is overwritten; choose another name")
    if not file.parent.is_dir():
        raise click.UsageError(f"{file}: there is no folder {file.parent}")

    async def work(client: "VehicleClient") -> tuple[int, str]:
        format_values(file, {}, client.system_id)  # an unknown suffix is told before anything is read
        values = await read_all(client)
        return len(values), format_values(file, values, client.system_id)

    count, text = _with_client(given, work)
    try:
        with file.open("x", encoding="utf-8") as opened:
            opened.write(text)
    except OSError as error:
        raise click.UsageError(f"{file} can't be written: {error.strerror}") from error
    if given["as_json"]:
        _print_json({"file": str(file), "parameters": count})
    else:
        click.echo(f"{count} parameters saved to {file}")
    return 0


@params.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--yes", is_flag=True, help="Don't ask.")
@_connected
def load(file: Path, yes: bool, **given: Any) -> int:
    """Set the parameters in FILE that differ on the vehicle, after asking; each is read back."""
    from autopilot_bridge.parameter_files import read_untyped_parameter_file
    from missions.vehicle_client import parameters as client_parameters

    async def work(client: "VehicleClient") -> "tuple[list[Difference], list[str]]":
        wanted = read_untyped_parameter_file(file)
        changes = client_parameters.differences(await client_parameters.read_all(client), wanted)
        settable = [change for change in changes if change.vehicle is not None]
        if settable:
            if not given["as_json"]:
                _tell_differences(settable)
            _confirm(f"set {len(settable)} parameters of vehicle {client.system_id}", yes)
        return changes, await client_parameters.load(client, settable, lambda line: None)

    changes, refused = _with_client(given, work)
    unknown = [change.name for change in changes if change.vehicle is None]
    done = len(changes) - len(unknown) - len(refused)
    if given["as_json"]:
        _print_json({"set": done, "refused": refused, "unknown": unknown})
    else:
        click.echo(f"{done} parameters set")
    for text in refused:
        click.echo(f"flightstack: {text}", err=True)
    if unknown:
        click.echo(f"flightstack: the vehicle has no {', '.join(unknown)}", err=True)
    return _FAILED if refused else 0


@params.command()
@click.argument("other", metavar="FILE|defaults")
@_connected
def compare(other: str, **given: Any) -> int:
    """What differs from FILE, or from the firmware's defaults as PX4 1.16 and ArduPilot 4.6 have them.

    Exit code 1 when something does.
    """
    from autopilot_bridge.parameter_files import read_untyped_parameter_file
    from missions.vehicle_client.parameters import differences, read_all

    async def work(client: "VehicleClient") -> "list[Difference]":
        wanted = _defaults(client) if other == "defaults" else read_untyped_parameter_file(Path(other))
        found = differences(await read_all(client), wanted)
        if other == "defaults":  # our tables need not be the vehicle's
            return [difference for difference in found if difference.vehicle is not None]
        return found

    found = _with_client(given, work)
    if given["as_json"]:
        _print_json(
            [{"name": d.name, "vehicle": d.vehicle and d.vehicle.number, "other": d.other} for d in found]
        )
    else:
        if found:
            _tell_differences(found)
        click.echo(f"{len(found)} differ" if found else "no difference")
    return _FAILED if found else 0


def _tell_differences(found: "list[Difference]") -> None:
    from missions.vehicle_client.parameters import Value

    click.echo(f"{'name':<16} {'vehicle':>16} {'other':>16}")
    for d in found:
        other = "-" if d.other is None else str(Value(number=d.other, type=9))
        if d.other is not None and d.vehicle is not None and isinstance(d.vehicle.number, int):
            other = f"{d.other:.0f}" if d.other == int(d.other) else other
        click.echo(f"{d.name:<16} {'none' if d.vehicle is None else str(d.vehicle):>16} {other:>16}")


def _defaults(client: "VehicleClient") -> dict[str, float]:
    from autopilot_bridge.flavours import get_flavour
    from flightsim.airframe import AirframeKind
    from missions.errors import PlanError

    if not client.flavour or client.kind is None:
        raise PlanError("defaults are known of PX4 and ArduPilot, for multicopters and aircraft; give a file")
    definitions = get_flavour(client.flavour, AirframeKind(str(client.kind))).parameter_definitions()
    return {definition.name: definition.convert(definition.default) for definition in definitions}


# logs


@vehicle.group()
def logs() -> None:
    """Logs on the vehicle: list, download, erase."""


@logs.command("list")
@_connected
def list_logs(**given: Any) -> int:
    """The logs that are there."""
    from missions.vehicle_client.logs import VehicleLogs

    found = _with_client(given, lambda client: VehicleLogs(client).entries())
    if given["as_json"]:
        _print_json([{"id": e.id, "date": e.date, "size_bytes": e.size_bytes} for e in found])
        return 0
    for e in found:
        click.echo(f"{e.id:>5}  {e.date:<24} {e.size_bytes:>12} bytes")
    if not found:
        click.echo("no logs")
    return 0


@logs.command()
@click.argument("which", metavar="NUMBER|newest|all", default="newest")
@click.option(
    "--to", "folder", type=click.Path(path_type=Path), default=Path("."), show_default=True, help="Folder."
)
@_connected
def download(which: str, folder: Path, **given: Any) -> int:
    """Fetch logs. Those that are in the folder already, whole, are not fetched again."""
    from missions.vehicle_client import logs as client_logs

    terminal = sys.stderr.isatty()

    def progress_of(number: int) -> Callable[[float], None]:
        def tell(done: float) -> None:
            if terminal and done == done:
                click.echo(f"\rlog {number}: {100.0 * done:3.0f} %", nl=False, err=True)

        return tell

    async def work(client: "VehicleClient") -> list[dict[str, Any]]:
        got = []
        shelf = client_logs.VehicleLogs(client)
        for entry in client_logs.chosen(await shelf.entries(), which):
            there = client_logs.fetched(folder, entry)
            path = there or await shelf.download(entry, folder, progress_of(entry.id))
            if terminal and there is None:
                click.echo("", err=True)
            got.append(
                {"id": entry.id, "file": str(path), "bytes": entry.size_bytes, "fetched": there is None}
            )
            if not given["as_json"]:
                click.echo(f"{path}  {entry.size_bytes} bytes{'' if there is None else ' (was there)'}")
        return got

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise click.UsageError(f"folder {folder} can't be made: {error.strerror}") from error
    got = _with_client(given, work)
    if given["as_json"]:
        _print_json(got)
    return 0


@logs.command()
@click.option("--yes", is_flag=True, help="Don't ask.")
@_connected
def erase(yes: bool, **given: Any) -> int:
    """Delete all logs of the vehicle, after asking."""
    from missions.vehicle_client.logs import VehicleLogs

    async def work(client: "VehicleClient") -> int:
        shelf = VehicleLogs(client)
        count = len(await shelf.entries())
        if count:
            _confirm(f"delete all {count} logs of vehicle {client.system_id}", yes)
            await shelf.erase()
        return count

    count = _with_client(given, work)
    if given["as_json"]:
        _print_json({"erased": count})
    else:
        click.echo(f"{count} logs erased" if count else "no logs")
    return 0


# doctor


@vehicle.command()
@_connected
def doctor(**given: Any) -> int:
    """How it is, and what keeps it from arming. Exit code 1 when something stands against a flight."""
    from autopilot_bridge.clock import unix_time_us
    from missions.preflight.finding import Level
    from missions.vehicle_client.doctor import examine

    findings: list[Finding] = _run(
        examine(
            _address(given["connect"]),
            timeout_s=given["timeout"],
            system_id=given["system_id"],
            unix_time_us=unix_time_us(),
        )
    )
    problems = [finding for finding in findings if finding.level is Level.PROBLEM]
    would_arm = not any(finding.subject == "arming" for finding in problems)
    if given["as_json"]:
        _print_json(
            {
                "would_arm": would_arm,
                "problems": len(problems),
                "findings": [
                    {"level": str(f.level), "subject": f.subject, "text": f.text, "advice": f.advice}
                    for f in findings
                ],
            }
        )
    else:
        for finding in findings:
            click.echo(str(finding))
        against = f"; problems: {len(problems)}" if problems else ""
        click.echo(f"it would {'' if would_arm else 'not '}arm{against}")
    return _FAILED if problems else 0
