"""`flightstack fly`: flies a mission with one command."""

from functools import partial
from pathlib import Path
from typing import Final

import click

from estimators.names import ESTIMATORS
from missions.base.run_options import RunOptions, TeamOptions, WorldOptions
from missions.catalogue import NAMES
from missions.cli.declared_options import FlightOption, Scope, declared_options
from missions.cli.fly_command import (
    ELSEWHERE,
    EMBEDDED,
    ESTIMATOR,
    FLIGHT,
    RESULTS,
    VEHICLES,
    FlyCommand,
    flight_option,
)
from missions.cli.later import body_in
from missions.cli.options import FIRMWARE_HELP, STRICT_HELP, WORLD_HELP
from missions.cli.signing import key_option
from missions.cli.view_option import view_option

_BODIES: Final = "missions.cli.bodies.fly"
_link = partial(flight_option, group=VEHICLES)
_embedded = partial(flight_option, group=EMBEDDED, scope=Scope.EMBEDDED)
_elsewhere = partial(flight_option, group=ELSEWHERE, scope=Scope.CONNECTED)
_flight = partial(flight_option, group=FLIGHT)
_estimator = partial(flight_option, group=ESTIMATOR)
_results = partial(flight_option, group=RESULTS)
_DECLARED: Final = (
    *declared_options(TeamOptions, group=VEHICLES),
    *declared_options(RunOptions, only=("system-id",), group=VEHICLES),
    *declared_options(WorldOptions, group=EMBEDDED, scope=Scope.EMBEDDED),
    *declared_options(RunOptions, only=("speedup",), group=EMBEDDED, scope=Scope.EMBEDDED),
    *declared_options(RunOptions, only=("regain",), group=ELSEWHERE, scope=Scope.CONNECTED),
    *declared_options(RunOptions, without=("system-id", "speedup", "regain"), group=FLIGHT),
)
_HELP: Final = f"""Fly MISSION: {", ".join(NAMES)}, a mission file (.plan, .waypoints), or a Python file of
your own.

`flightstack fly MISSION --help` lists a mission's own options. Your own file has `async def fly(vehicle,
options)`. The run folder gets flight.tlog, summary.json and track.png.
"""


@click.command(
    cls=FlyCommand,
    help=_HELP,
    context_settings={"show_default": True},
    params=[*_DECLARED, key_option(FlightOption, group=ELSEWHERE, scope=Scope.CONNECTED)],
)
@click.argument("mission")
@_link("--connect", multiple=True, metavar="URL", help="Vehicle elsewhere: udpin:0.0.0.0:14550, serial:...")
@_embedded("--world", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE", help=WORLD_HELP)
@_embedded("--firmware", metavar="NAME[=BUILD]", help=FIRMWARE_HELP)
@_flight("--params", metavar="FILE", help="Autopilot parameters to set (NAME VALUE lines, .parm, .params).")
@_flight("--strict-params", is_flag=True, needs=("params", ()), help=STRICT_HELP)
@_results("--out", type=click.Path(path_type=Path), help="Run folder. [default: runs/MISSION-N]")
@_elsewhere(
    "--yes",
    is_flag=True,
    help="Flight of a vehicle that may be real without a question, when nothing is found against it.",
)
@_elsewhere(
    "--check",
    is_flag=True,
    help="Checks and a question before the flight, also if the vehicle proves to be a simulation.",
)
@_link("--onboard", is_flag=True, help="Messages as the vehicle's companion computer (191), not as a GCS.")
@_estimator(
    "--estimator", metavar="NAME|FILE.py", help=f"Estimator beside the flight: {', '.join(ESTIMATORS)}."
)
@_estimator(
    "--set", "settings", multiple=True, metavar="NAME=VALUE", help="Parameter of the estimator; repeat."
)
@_results(
    "--export-plan",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="File for the mission that would be uploaded (.plan, .waypoints), in place of a flight.",
)
@view_option(_results)
@_results("--vector", is_flag=True, help="Pictures also as SVG and PDF.")
@_results("--no-picture", is_flag=True, help="No picture track.png, and no page.")
@_results(
    "--no-report",
    is_flag=True,
    envvar="FLIGHTSTACK_NO_REPORT",
    help="No page report.html. [default: one, where Bokeh is installed]",
)
@body_in(_BODIES)
def fly() -> None: ...
