"""What `flightstack vehicle` does."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import click

from autopilot_bridge.clock import unix_time_us
from autopilot_bridge.clock.pacing import wall_time_s
from missions.cli.bodies.status_line import StatusLine
from missions.cli.bodies.vehicle_link import address, confirm, print_json, run, with_client
from missions.cli.declared_options import specified
from missions.cli.exit_codes import FAILED
from missions.preflight.finding import Finding, Level
from missions.vehicle_client import logs as client_logs
from missions.vehicle_client.client import VehicleClient
from missions.vehicle_client.doctor import examine
from missions.vehicle_client.information import information
from missions.vehicle_client.logs import VehicleLogs
from missions.vehicle_client.options import ConnectionOptions

_SHOWN_EVERY_S: Final = 0.2


def info(**given: Any) -> int:
    """`flightstack vehicle info`."""
    found = with_client(given, information, asks=False)
    if given["as_json"]:
        print_json(found)
        return 0
    for key, value in found.items():
        click.echo(f"{key.replace('_', ' '):<14} {_shown(value)}")
    return 0


def _shown(value: Any) -> str:
    if value is None:
        return "not reported"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_shown(v)}" for key, v in value.items())
    if isinstance(value, list):
        return ", ".join(f"{v['id']} {v['name']}" if isinstance(v, Mapping) else _shown(v) for v in value)
    return f"{value:.7g}" if isinstance(value, float) and abs(value) < 1000 else str(value)


def list_logs(**given: Any) -> int:
    """`flightstack vehicle logs list`."""
    found = with_client(given, lambda client: VehicleLogs(client).entries())
    if given["as_json"]:
        print_json([{"id": e.id, "date": e.date, "size_bytes": e.size_bytes} for e in found])
        return 0
    for e in found:
        click.echo(f"{e.id:>5}  {e.date:<24} {e.size_bytes:>12} bytes")
    if not found:
        click.echo("no logs")
    return 0


def download(which: str, folder: Path, **given: Any) -> int:
    """`flightstack vehicle logs download`."""

    async def work(client: VehicleClient) -> list[dict[str, Any]]:
        got = []
        shelf = client_logs.VehicleLogs(client)
        for entry in client_logs.chosen(await shelf.entries(), which):
            there = client_logs.fetched(folder, entry)
            line = DownloadLine(entry.id, entry.size_bytes, wall_time_s)
            try:
                path = there or await shelf.download(entry, folder, line)
            finally:
                line.end()
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


class DownloadLine:
    """Shows the progress, speed and remaining time of a log download on one line of a terminal.

    Args:
        number: number of the log.
        size_bytes: size of the log.
        monotonic: wall clock in seconds.
    """

    def __init__(self, number: int, size_bytes: int, monotonic: Callable[[], float]) -> None:
        self._number, self._size_bytes = number, size_bytes
        self._monotonic = monotonic
        self._line = StatusLine()
        self._begun_s: float | None = None
        self._shown_s = -math.inf

    def __call__(self, done: float) -> None:
        """Show the progress, at most five times a second.

        Args:
            done: received share, 0..1; NaN while it is not known.
        """
        if not math.isfinite(done):
            return
        now_s = self._monotonic()
        if self._begun_s is None:
            self._begun_s = now_s
        if now_s - self._shown_s < _SHOWN_EVERY_S and done < 1.0:
            return
        self._shown_s = now_s
        passed_s = now_s - self._begun_s
        text = f"log {self._number}: {100.0 * done:3.0f} % of {self._size_bytes * 1e-6:.1f} MB"
        if passed_s > 1.0 and done > 0.0:
            left_s = passed_s * (1.0 - done) / done
            text += f", {1e-3 * done * self._size_bytes / passed_s:.0f} kB/s, {_duration(left_s)} left"
        self._line.show(text)

    def end(self) -> None:
        """End the progress line."""
        self._line.end()


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100.0 else f"{seconds / 60.0:.0f} min"


def erase(yes: bool, **given: Any) -> int:
    """`flightstack vehicle logs erase`."""

    async def work(client: VehicleClient) -> int:
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


def doctor(**given: Any) -> int:
    """`flightstack vehicle doctor`."""
    findings: list[Finding] = run(
        examine(address(given["connect"]), specified(ConnectionOptions), unix_time_us=unix_time_us())
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
    """The last line that the doctor prints."""
    if not problems:
        return "it would arm; no problems"
    noun = "1 problem" if problems == 1 else f"{problems} problems"
    if would_arm:
        return f"{noun}: don't fly it so, although its own pre-arm checks are passed"
    return f"it would not arm; {noun}"
