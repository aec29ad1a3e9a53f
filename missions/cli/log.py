"""`flightstack log`: inspects logs, and makes other logs from them."""

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click

from autopilot_bridge.errors import BridgeError
from estimators.errors import NothingThere
from missions.cli.options import FiniteRange, in_options
from missions.cli.signing import key_from, key_option, warn_if_open
from missions.cli.status_line import StatusLine

if TYPE_CHECKING:
    from estimators.logs import Log
    from estimators.logs.iterate import Selection

_FORMATS: Final = ("csv", "parquet", "npz", "mcap")
Command = TypeVar("Command", bound=Callable[..., Any])


class _Failed(click.ClickException):
    """The log can't be read, or does not contain the requested data."""

    exit_code = 1


def _log_argument(command: Command) -> Command:
    return click.argument("path", metavar="LOG", type=click.Path(path_type=Path))(command)


def _dialect_option(command: Command) -> Command:
    return click.option(
        "--dialect",
        metavar="NAME|FILE.xml",
        help="Dialect of a telemetry log. [default: all of MAVLink's messages]",
    )(command)


def _selection_options(command: Command) -> Command:
    for option in reversed(
        (
            click.option("--types", metavar="A,B", multiple=True, help="Messages. [default: all]"),
            click.option("--source-system", type=click.IntRange(0, 255), multiple=True, metavar="N"),
            click.option("--source-component", type=click.IntRange(0, 255), multiple=True, metavar="N"),
            click.option(
                "--condition",
                metavar="TEXT",
                help="Only messages for which it holds, by the newest values: 'HEARTBEAT.custom_mode == 4'.",
            ),
            click.option(
                "--from",
                "from_s",
                type=FiniteRange(min=0.0),
                metavar="S",
                help="Begin at this time, seconds since the vehicle's boot, as log info prints it.",
            ),
            click.option("--to", "to_s", type=FiniteRange(min=0.0), metavar="S", help="End at this time."),
            click.option(
                "--boot",
                type=click.IntRange(min=0),
                metavar="N",
                help="Boot of the vehicle, as log info numbers them. [default: all]",
            ),
        )
    ):
        command = option(command)
    return command


def _open(path: Path, dialect: str | None) -> "Log":
    """Open the log. A wrong path is a usage error; an error in the file's content is not."""
    if path.is_dir():
        raise click.UsageError(f"{path} is a directory; give the path of a log")
    if not path.exists():
        raise click.UsageError(f"{path} does not exist; give the path of a log")
    from estimators.logs import open_log
    from estimators.logs.dialect import load_dialect

    try:
        load_dialect(dialect)
    except BridgeError as error:
        raise click.UsageError(in_options(error)) from error
    return open_log(path, dialect=dialect)


def _select(log: "Log", given: dict[str, Any]) -> "list[Selection]":
    from estimators.logs.condition import Condition
    from estimators.logs.raw_records import window

    names = [name.strip() for group in given["types"] for name in group.split(",") if name.strip()]
    if given["types"] and not names:
        raise click.UsageError("--types names no message; give names such as ATTITUDE,GLOBAL_POSITION_INT")
    try:
        condition = None if given["condition"] is None else Condition(given["condition"])
        selections = log.select(
            names or None,
            system_id=given["source_system"] or None,
            component_id=given["source_component"] or None,
            condition=condition,
        )
        there = {stream.name for stream, _ in selections}
        missing = [name for name in names if name.upper() not in {key.name.upper() for key in log.keys}]
        if there and missing:
            click.echo(f"{log.path} has no {', '.join(missing)}", err=True)
        timed = given["from_s"] is not None or given["to_s"] is not None
        if timed and given["boot"] is None and len(boots := log.boots_at(given["from_s"], given["to_s"])) > 1:
            several = ", ".join(map(str, boots))
            click.echo(f"the times fit to boots {several}; all count, --boot chooses one", err=True)
        return window(log, selections, given["from_s"], given["to_s"], given["boot"])
    except NothingThere:
        raise  # an error about the content of the log, not about the arguments
    except BridgeError as error:
        raise click.UsageError(in_options(error)) from error


class _LogCommands(click.Group):
    """Commands whose errors about the content of a log end them with exit code 1."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except BridgeError as error:
            raise _Failed(in_options(error)) from error


@click.group(cls=_LogCommands)
def log() -> None:
    """Look into logs, and make others of them: .tlog, ArduPilot .bin, PX4 .ulg."""


@log.command()
@_log_argument
@_dialect_option
@click.option("--json", "as_json", is_flag=True, help="All figures as JSON.")
def info(path: Path, dialect: str | None, as_json: bool) -> None:
    """Duration, boots, flights, vehicles, modes, rates, gaps, loss; where every byte went."""
    from estimators.logs import report_of
    from missions.cli.log_text import report_lines

    report = report_of(_open(path, dialect))
    if as_json:
        click.echo(json.dumps(report.to_dict(), indent=2))
        return
    for line in report_lines(report):
        click.echo(line)


@log.command()
@_log_argument
@_dialect_option
@_selection_options
@click.option("--format", "form", type=click.Choice(_FORMATS), default="csv", show_default=True)
@click.option("--si", is_flag=True, help="SI units and radians in place of wire values (degE7, mG, ...).")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Folder (csv, parquet: a file for each message) or file (npz, mcap). [default: beside the log]",
)
def export(path: Path, dialect: str | None, form: str, si: bool, out: Path | None, **given: Any) -> None:
    """Write messages to other tools' formats: Parquet, CSV, NumPy, MCAP."""
    from estimators.logs.export import export as write

    opened = _open(path, dialect)
    target = out or path.with_name(
        f"{path.stem}-{form}" if form in ("csv", "parquet") else f"{path.stem}.{form}"
    )
    written = write(opened, _select(opened, given), target, form, si=si)
    what = f"{len(written)} files in {target}" if len(written) > 1 else str(written[0])
    click.echo(f"written: {what}")


@log.command()
@_log_argument
@click.argument("out", type=click.Path(path_type=Path))
@_dialect_option
@_selection_options
def cut(path: Path, out: Path, dialect: str | None, **given: Any) -> None:
    """Write a part of a telemetry log to OUT, its records as they are."""
    from estimators.logs.raw_records import positions, read_records, write_records

    opened = _open(path, dialect)
    count = write_records(out, read_records(opened, positions(_select(opened, given))))
    click.echo(f"written: {out}, {count} of {len(opened)} messages")


@log.command()
@_log_argument
@click.argument("out", type=click.Path(path_type=Path))
@_dialect_option
@_selection_options
@click.option(
    "--fault",
    "faults",
    multiple=True,
    required=True,
    metavar="WHAT:KIND[=VALUE][@FROM-TO]",
    help="WHAT: gyro, accel, mag, baro, gps, airspeed, distance_sensor, battery, MESSAGE, or MESSAGE.field. "
    "KIND: off, stuck, garbage, wrong, drift, noise, spike, slow, delayed, drop, intermittent. "
    "VALUE in SI units; times as of --from. May be repeated.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
def mutate(
    path: Path, out: Path, dialect: str | None, faults: Sequence[str], seed: int, **given: Any
) -> None:
    """Write a telemetry log with faults to OUT: GPS off, spikes, noise, delays, lost messages, ..."""
    from estimators.logs.faults import parse_fault
    from estimators.logs.mutate import mutated_records
    from estimators.logs.raw_records import write_records

    try:
        parsed = [parse_fault(text) for text in faults]
    except BridgeError as error:
        raise click.UsageError(in_options(error)) from error
    opened = _open(path, dialect)
    records = mutated_records(opened, _select(opened, given), parsed, seed=seed)
    click.echo(f"written: {out}, {write_records(out, records)} of {len(opened)} messages")


@log.command()
@_log_argument
@_dialect_option
@_selection_options
@click.option(
    "--link",
    required=True,
    metavar="URL",
    help="Link: udpout:127.0.0.1:14550, tcpin:127.0.0.1:5760, serial:/dev/ttyUSB0:57600, ...",
)
@click.option(
    "--speed",
    default="1",
    show_default=True,
    metavar="X",
    help="Log seconds per wall second, from 0.1; or max.",
)
@click.option("--loop", is_flag=True, help="Begin again at the end, until Ctrl-C.")
@key_option()
def play(
    path: Path, dialect: str | None, link: str, speed: str, loop: bool, signing_key: Path | None, **given: Any
) -> None:
    """Play a telemetry log to a link, as if the vehicle were there; --from seeks."""
    from autopilot_bridge.links import open_link, parse_address
    from missions.runs.log_play import MIN_SPEED, Played
    from missions.runs.log_play import play as send
    from missions.vehicle.signing import client_signing

    try:
        factor = math.inf if speed == "max" else float(speed)
    except ValueError:
        factor = math.nan
    if not factor >= MIN_SPEED:
        raise click.UsageError(f"--speed {speed} is not accepted; give {MIN_SPEED:g} or more, or max")
    try:
        address = parse_address(link)
        key = key_from(signing_key)
    except BridgeError as error:
        raise click.UsageError(in_options(error)) from error
    opened = _open(path, dialect)
    selections = _select(opened, given)
    line = StatusLine()

    def show(played: Played) -> None:
        line.show(f"{played.log_s:8.1f} s  {played.frames} frames")

    signing = client_signing(key)
    connection = open_link(address)
    warn_if_open((link,), key)
    if not connection.peers:
        click.echo(f"waiting for a client on {connection.description}", err=True)
    try:
        played = send(
            opened,
            selections,
            connection,
            speed=factor,
            loop=loop,
            on_progress=show,
            sign=None if signing is None else signing.sign_again,
        )
    finally:
        connection.close()
        line.end()
    lost = connection.counters.dropped
    but = f" ({lost} dropped: no receiver, or a slow one)" if lost else ""
    click.echo(f"played: {played.frames} frames{but}, {played.log_s:.1f} s of the log, to {address}")
