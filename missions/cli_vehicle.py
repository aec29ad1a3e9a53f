"""`flightstack vehicle`: what is connected, its parameters, its logs, its health."""

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from missions.cli_vehicle_link import FAILED, address, confirm, connected, print_json, run, with_client
from missions.cli_vehicle_params import params

if TYPE_CHECKING:
    from missions.preflight.finding import Finding
    from missions.vehicle_client.client import VehicleClient


@click.group()
def vehicle() -> None:
    """Talk to a vehicle: what it is, its parameters, its logs, its health (through MAVSDK)."""


vehicle.add_command(params)


# info


@vehicle.command()
@connected
def info(**given: Any) -> int:
    """What is connected: autopilot, versions, capabilities, components, position, battery, mode."""
    from missions.vehicle_client.information import information

    found = with_client(given, information, asks=False)
    if given["as_json"]:
        print_json(found)
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


# logs


@vehicle.group()
def logs() -> None:
    """Logs on the vehicle: list, download, erase."""


@logs.command("list")
@connected
def list_logs(**given: Any) -> int:
    """The logs that are there."""
    from missions.vehicle_client.logs import VehicleLogs

    found = with_client(given, lambda client: VehicleLogs(client).entries())
    if given["as_json"]:
        print_json([{"id": e.id, "date": e.date, "size_bytes": e.size_bytes} for e in found])
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
@connected
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
    got = with_client(given, work)
    if given["as_json"]:
        print_json(got)
    return 0


@logs.command()
@click.option("--yes", is_flag=True, help="Don't ask.")
@connected
def erase(yes: bool, **given: Any) -> int:
    """Delete all logs of the vehicle, after asking."""
    from missions.vehicle_client.logs import VehicleLogs

    async def work(client: "VehicleClient") -> int:
        shelf = VehicleLogs(client)
        count = len(await shelf.entries())
        if count:
            await confirm(f"delete all logs ({count}) of vehicle {client.system_id}", yes)
            await shelf.erase()
        return count

    count = with_client(given, work)
    if given["as_json"]:
        print_json({"erased": count})
    else:
        click.echo(f"{count} logs erased" if count else "no logs")
    return 0


# doctor


@vehicle.command()
@connected
def doctor(**given: Any) -> int:
    """How it is, and what keeps it from arming. Exit code 1 when something stands against a flight."""
    from autopilot_bridge.clock import unix_time_us
    from missions.preflight.finding import Level
    from missions.vehicle_client.doctor import examine

    findings: list[Finding] = run(
        examine(
            address(given["connect"]),
            timeout_s=given["timeout"],
            system_id=given["system_id"],
            unix_time_us=unix_time_us(),
        )
    )
    problems = [finding for finding in findings if finding.level is Level.PROBLEM]
    would_arm = not any(finding.subject == "arming" for finding in problems)
    if given["as_json"]:
        print_json(
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
        click.echo(_verdict(len(problems), would_arm=would_arm))
    return FAILED if problems else 0


def _verdict(problems: int, *, would_arm: bool) -> str:
    """The last line of the doctor."""
    if not problems:
        return "it would arm; no problems"
    noun = "1 problem" if problems == 1 else f"{problems} problems"
    if would_arm:
        return f"{noun}: don't fly it so, although its own pre-arm checks are passed"
    return f"it would not arm; {noun}"
