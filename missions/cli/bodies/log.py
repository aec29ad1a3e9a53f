"""What `flightstack log` does."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from autopilot_bridge.errors import BridgeError
from autopilot_bridge.links import open_link, parse_address
from estimators.errors import EstimatorError, NothingThere
from estimators.exports.map_files import MAP_FORMATS, export_map
from estimators.logs import Log, open_log, report_of
from estimators.logs.condition import Condition
from estimators.logs.dialect import load_dialect
from estimators.logs.export import export as write
from estimators.logs.faults import parse_fault
from estimators.logs.iterate import Selection
from estimators.logs.mutate import mutated_records
from estimators.logs.raw_records import positions, read_records, window, write_records
from missions.base.options import SeedOptions
from missions.cli.bodies.log_text import report_lines
from missions.cli.bodies.signing import key_from, warn_if_open
from missions.cli.bodies.status_line import StatusLine
from missions.cli.declared_options import chosen_names, specified
from missions.cli.options import in_options
from missions.errors import PlanError
from missions.estimation.coverage import assess_coverage
from missions.estimation.log_options import CoverageOptions, ExportOptions, LogSelection, PlayOptions
from missions.runs.log_play import MIN_SPEED, Played
from missions.runs.log_play import play as send
from missions.vehicle.signing import client_signing


def _open(path: Path, dialect: str | None) -> Log:
    """Open the log. A wrong path is a usage error; an error in the file's content is not."""
    if path.is_dir():
        raise click.UsageError(f"{path} is a directory; give the path of a log")
    if not path.exists():
        raise click.UsageError(f"{path} does not exist; give the path of a log")

    try:
        load_dialect(dialect)
    except BridgeError as error:
        raise click.UsageError(in_options(error)) from error
    return open_log(path, dialect=dialect)


def _select(log: Log) -> list[Selection]:
    chosen = specified(LogSelection)
    names = [name.strip() for group in chosen.types for name in group.split(",") if name.strip()]
    if chosen.types and not names:
        raise click.UsageError("--types names no message; give names such as ATTITUDE,GLOBAL_POSITION_INT")
    try:
        condition = None if chosen.condition is None else Condition(chosen.condition)
        selections = log.select(
            names or None,
            system_id=chosen.source_system or None,
            component_id=chosen.source_component or None,
            condition=condition,
        )
        there = {stream.name for stream, _ in selections}
        missing = [name for name in names if name.upper() not in {key.name.upper() for key in log.keys}]
        if there and missing:
            click.echo(f"{log.path} has no {', '.join(missing)}", err=True)
        timed = chosen.from_s is not None or chosen.to_s is not None
        if timed and chosen.boot is None and len(boots := log.boots_at(chosen.from_s, chosen.to_s)) > 1:
            several = ", ".join(map(str, boots))
            click.echo(f"the times fit to boots {several}; all count, --boot chooses one", err=True)
        return window(log, selections, chosen.from_s, chosen.to_s, chosen.boot)
    except NothingThere:
        raise  # an error about the content of the log, not about the arguments
    except BridgeError as error:
        raise click.UsageError(in_options(error)) from error


def info(path: Path, dialect: str | None, as_json: bool) -> None:
    """`flightstack log info`."""
    report = report_of(_open(path, dialect))
    if as_json:
        click.echo(json.dumps(report.to_dict(), indent=2))
        return
    for line in report_lines(report):
        click.echo(line)


def export(path: Path, dialect: str | None, si: bool, out: Path | None, **_declared: Any) -> None:
    """`flightstack log export`."""
    form = specified(ExportOptions).format
    opened = _open(path, dialect)
    if form in MAP_FORMATS:
        _export_map(opened, si, out, form)
        return
    target = out or path.with_name(
        f"{path.stem}-{form}" if form in ("csv", "parquet") else f"{path.stem}.{form}"
    )
    written = write(opened, _select(opened), target, form, si=si)
    what = f"{len(written)} files in {target}" if len(written) > 1 else str(written[0])
    click.echo(f"written: {what}")


def coverage(
    paths: Sequence[Path],
    dialect: str | None,
    camera: Path | None,
    area: Path | None,
    out: Path | None,
    **_declared: Any,
) -> None:
    """`flightstack log coverage`."""
    try:
        made = assess_coverage(
            [_open(path, dialect) for path in paths],
            specified(CoverageOptions),
            camera=camera,
            area=area,
            out=out,
        )
    except (EstimatorError, PlanError) as error:
        raise click.UsageError(in_options(error)) from error
    figures = made.coverage.figures
    click.echo(
        f"{figures['swept_share']:.1%} of {figures['area_m2']:.0f} m2 swept, POD {figures['pod']:.1%}, "
        f"track of {figures['track_m']:.0f} m over the area ({figures['track_by']})"
    )
    if figures["coverage"] is not None:
        click.echo(f"coverage {figures['coverage']:.3g} with a sweep width of {figures['sweep_width_m']:g} m")
    for remark in made.remarks:
        click.echo(remark, err=True)
    click.echo(f"written: {', '.join(made.written)} in {made.folder}")


def _export_map(log: Log, si: bool, out: Path | None, form: str) -> None:
    """Write the tracks and places of a whole log."""
    chosen = sorted(chosen_names(click.get_current_context()) & {"si", *LogSelection.__dataclass_fields__})
    if chosen:
        option = chosen[0].removesuffix("_s").replace("_", "-")
        raise click.UsageError(
            f"--format {form} has whole tracks and takes no --{option}; log cut makes a part"
        )
    target = out or log.path.with_suffix(f".{form}")
    try:
        counts = export_map(log, target, form)
    except EstimatorError as error:
        raise click.ClickException(in_options(error)) from error
    words = ", ".join(f"{count} {kind}{'s' if count > 1 else ''}" for kind, count in counts.items())
    click.echo(f"written: {target}: {words}")


def cut(path: Path, out: Path, dialect: str | None, **_declared: Any) -> None:
    """`flightstack log cut`."""
    opened = _open(path, dialect)
    count = write_records(out, read_records(opened, positions(_select(opened))))
    click.echo(f"written: {out}, {count} of {len(opened)} messages")


def mutate(path: Path, out: Path, dialect: str | None, faults: Sequence[str], **_declared: Any) -> None:
    """`flightstack log mutate`."""
    try:
        parsed = [parse_fault(text) for text in faults]
    except BridgeError as error:
        raise click.UsageError(in_options(error)) from error
    opened = _open(path, dialect)
    records = mutated_records(opened, _select(opened), parsed, seed=specified(SeedOptions).seed)
    click.echo(f"written: {out}, {write_records(out, records)} of {len(opened)} messages")


def play(
    path: Path, dialect: str | None, link: str, loop: bool, signing_key: Path | None, **_declared: Any
) -> None:
    """`flightstack log play`."""
    speed = specified(PlayOptions).speed
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
    selections = _select(opened)
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
