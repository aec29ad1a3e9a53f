"""`flightstack log`: inspects logs, and makes other logs from them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar

import click

from autopilot_bridge.errors import BridgeError
from missions.base.options import SeedOptions
from missions.cli.declared_options import declared_options
from missions.cli.later import body_in
from missions.cli.options import in_options
from missions.cli.signing import key_option
from missions.estimation.log_options import CoverageOptions, ExportOptions, LogSelection, PlayOptions

_BODIES: Final = "missions.cli.bodies.log"
_SELECTION: Final = declared_options(LogSelection)
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
@body_in(_BODIES)
def info() -> None:
    """Duration, boots, flights, vehicles, modes, rates, gaps, loss; where every byte went."""


@log.command(params=[*_SELECTION, *declared_options(ExportOptions)])
@_log_argument
@_dialect_option
@click.option("--si", is_flag=True, help="SI units and radians in place of wire values (degE7, mG, ...).")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Folder (csv, parquet: a file for each message) or file. [default: beside the log]",
)
@body_in(_BODIES)
def export() -> None:
    """Write messages to other tools' formats, or tracks, areas and targets to maps (kml, gpx, geojson)."""


@log.command(params=[*declared_options(CoverageOptions)])
@click.argument("paths", nargs=-1, required=True, metavar="LOG...", type=click.Path(path_type=Path))
@_dialect_option
@click.option(
    "--camera",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Description of the camera (docs/vision.md), or a calibration of one that looks down.",
)
@click.option(
    "--area",
    type=click.Path(path_type=Path),
    metavar="FILE.geojson",
    help="Polygon of the searched area. [default: the rectangle that was seen]",
)
@click.option(
    "--out", type=click.Path(path_type=Path), metavar="FOLDER", help="New folder. [default: runs/coverage-N]"
)
@body_in(_BODIES)
def coverage() -> None:
    """Swept area and probability of detection of flights with a camera or a sensor of a sweep width.

    The flights of all logs count together. FOLDER gets coverage.json, coverage.png and coverage.tif.
    """


@log.command(params=[*_SELECTION])
@_log_argument
@click.argument("out", type=click.Path(path_type=Path))
@_dialect_option
@body_in(_BODIES)
def cut() -> None:
    """Write a part of a telemetry log to OUT, its records as they are."""


@log.command(params=[*_SELECTION, *declared_options(SeedOptions)])
@_log_argument
@click.argument("out", type=click.Path(path_type=Path))
@_dialect_option
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
@body_in(_BODIES)
def mutate() -> None:
    """Write a telemetry log with faults to OUT: GPS off, spikes, noise, delays, lost messages, ..."""


@log.command(params=[*_SELECTION, *declared_options(PlayOptions), key_option()])
@_log_argument
@_dialect_option
@click.option(
    "--link",
    required=True,
    metavar="URL",
    help="Link: udpout:127.0.0.1:14550, tcpin:127.0.0.1:5760, serial:/dev/ttyUSB0:57600, ...",
)
@click.option("--loop", is_flag=True, help="Begin again at the end, until Ctrl-C.")
@body_in(_BODIES)
def play() -> None:
    """Play a telemetry log to a link, as if the vehicle were there; --from seeks."""
