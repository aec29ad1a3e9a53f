"""`flightstack fly`: flies a mission with one command."""

from functools import partial
from pathlib import Path
from typing import Final

import click

from estimators.names import ESTIMATORS
from missions.catalogue import NAMES
from missions.cli.declared_options import FlightOption, Scope
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
from missions.cli.options import FIRMWARE_HELP, SECONDS, SPEEDUP, STRICT_HELP, WORLD_HELP, FiniteRange
from missions.cli.signing import key_option

_BODIES: Final = "missions.cli.bodies.fly"
_link = partial(flight_option, group=VEHICLES)
_embedded = partial(flight_option, group=EMBEDDED, scope=Scope.EMBEDDED)
_elsewhere = partial(flight_option, group=ELSEWHERE, scope=Scope.CONNECTED)
_flight = partial(flight_option, group=FLIGHT)
_estimator = partial(flight_option, group=ESTIMATOR)
_results = partial(flight_option, group=RESULTS)
_HELP: Final = f"""Fly MISSION: {", ".join(NAMES)}, a mission file (.plan, .waypoints), or a Python file of
your own.

`flightstack fly MISSION --help` lists a mission's own options. Your own file has `async def fly(vehicle,
options)`. The run folder gets flight.tlog, summary.json and track.png.
"""


@click.command(
    cls=FlyCommand,
    help=_HELP,
    context_settings={"show_default": True},
    params=[key_option(FlightOption, group=ELSEWHERE, scope=Scope.CONNECTED)],
)
@click.argument("mission")
@_link("--vehicles", type=click.IntRange(1, 250), help="Team size. [default: 1, or one per --connect]")
@_link("--connect", multiple=True, metavar="URL", help="Vehicle elsewhere: udpin:0.0.0.0:14550, serial:...")
@_link(
    "--system-id",
    multiple=True,
    type=click.IntRange(1, 255),
    metavar="ID",
    help="System id, where several vehicles are on a link; one for each --connect. [default: the first]",
)
@_embedded("--world", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE", help=WORLD_HELP)
@_embedded(
    "--autopilot",
    type=click.Choice(["px4", "ardupilot"]),
    help="Firmware whose ways the autopilot has. [default: px4, or what a mission file is for]",
)
@_embedded("--firmware", metavar="NAME[=BUILD]", help=FIRMWARE_HELP)
@_embedded(
    "--model",
    multiple=True,
    metavar="NAME|PATH",
    help="Model of the vehicle; one for all of a team, or one for each (repeat, or A,B,C). "
    "[default: iris, or an aircraft where the mission needs one]",
)
@_embedded(
    "--launch",
    type=click.Choice(["runway", "catapult", "hand"]),
    help="Launch of aircraft. [default: as described with the model]",
)
@_embedded("--home", help="Place of the home: lat,lon,alt[,heading]. [default: the firmware's own]")
@_embedded("--seed", type=click.IntRange(min=0), default=0, help="One seed makes one flight.")
@_embedded(
    "--wind",
    metavar="SPEED[@FROM]",
    help="Wind of the day, m/s at 10 m above ground, and degrees it comes from; turns are planned for it, "
    "unless --expect-wind says otherwise. [default: 0; orbit: 4, handoff: 3 from north; "
    "occupancy: 5 from west]",
)
@_embedded(
    "--wind-profile",
    type=click.Choice(["log", "power", "uniform"]),
    default="log",
    help="Wind over height: logarithmic over open ground, power law of 1/7, or the same everywhere.",
)
@_embedded(
    "--turbulence",
    type=click.Choice(["none", "light", "moderate", "severe"]),
    help="Turbulence of the air. [default: none; orbit, occupancy, handoff: light]",
)
@_embedded(
    "--gps",
    type=click.Choice(["differential", "standalone"]),
    help="Receiver: decimetres with corrections, or metres that wander without. [default: differential]",
)
@_flight(
    "--expect-wind",
    type=float,
    help="Forecast: wind to plan turns for, m/s, at the height of the flight. [default: --wind where it is "
    "given, as it is at 100 m or the mission's altitude, else 5]",
)
@_embedded("--speedup", type=SPEEDUP, help="Simulated seconds per second at most. [default: no limit]")
@_flight("--params", metavar="FILE", help="Autopilot parameters to set (NAME VALUE lines, .parm, .params).")
@_flight("--strict-params", is_flag=True, needs=("params", ()), help=STRICT_HELP)
@_results("--out", type=click.Path(path_type=Path), help="Run folder. [default: runs/MISSION-N]")
@_flight(
    "--on-failure",
    type=click.Choice(["return", "land", "hold"]),
    default="return",
    help="Command to the vehicle after a failure, or on Ctrl-C, SIGTERM, SIGHUP.",
)
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
@_elsewhere("--regain", type=SECONDS, help="Time in which a lost link may come back, s. [default: 60]")
@_flight(
    "--max-error",
    type=float,
    metavar="M",
    help="Fail when the path error exceeds it anywhere in a pattern, m.",
)
@_flight(
    "--endurance",
    type=FiniteRange(min=0.0, max=6000.0, min_open=True),
    metavar="MIN",
    help="Time that the battery lasts in flight, min: a longer mission is named before the takeoff, and "
    "refused on a vehicle that may be real. [default: as the vehicle reports it]",
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
@_results("--no-picture", is_flag=True, help="No picture track.png.")
@body_in(_BODIES)
def fly() -> None: ...
