"""`flightstack fly`: flies a mission with one command."""

import math
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from autopilot_bridge.errors import AddressError, BridgeError
from estimators.names import ESTIMATORS
from missions.catalogue import NAMES
from missions.cli.confirm import confirmation
from missions.cli.fly_command import FlyCommand, chosen_names, flight_option, refuse_idle_options
from missions.cli.fly_report import KILLED, ProgressLine, leave_closed_terminal, print_result
from missions.cli.mission_command import FlightOption, Scope
from missions.cli.options import SECONDS, SPEEDUP, FiniteRange, in_options, report
from missions.cli.params import STRICT_HELP, known_to_all
from missions.cli.signing import key_from, key_option, warn_if_open
from missions.cli.world import FIRMWARE_HELP, WORLD_HELP, firmware_of, world_of
from missions.errors import MissionError, PlanError

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec
    from missions.base.mission import Mission
    from missions.base.request import RunRequest
    from missions.cli.mission_command import MissionCommand

_link = partial(flight_option, group="Vehicles")
_embedded = partial(flight_option, group="The embedded SITL", scope=Scope.EMBEDDED)
_elsewhere = partial(flight_option, group="Vehicles elsewhere (--connect)", scope=Scope.CONNECTED)
_flight = partial(flight_option, group="The flight")
_estimator = partial(flight_option, group="An estimator beside it")
_results = partial(flight_option, group="Results")

_HELP: Final = f"""Fly MISSION: {", ".join(NAMES)}, a mission file (.plan, .waypoints), or a Python file of
your own.

`flightstack fly MISSION --help` lists a mission's own options. Your own file has `async def fly(vehicle,
options)`. The run folder gets flight.tlog, summary.json and track.png.
"""
_NAMES_SHOWN: Final = 20  # names of parameters that were left out; the summary has all
_FORECAST_HEIGHT_M: Final = 100.0  # lower limit; above it the wind of a profile increases little


@click.command(cls=FlyCommand, help=_HELP, context_settings={"show_default": True})
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
@key_option(cls=FlightOption, group="Vehicles elsewhere (--connect)", scope=Scope.CONNECTED)
def fly(**given: Any) -> int:
    from missions.process.ending import signal_of

    try:
        return _fly(given)
    except PlanError as error:
        raise click.UsageError(in_options(error, own=True)) from error
    except KeyboardInterrupt as interrupt:
        click.echo("interrupted", err=True)
        return KILLED + signal_of(interrupt)


def _world(given: dict[str, Any], mission: "Mission[Any]", chosen: frozenset[str]) -> "WorldSpec | None":
    """The embedded world without what the mission adds to it; None: the vehicles are connected by links."""
    if given["connect"]:
        return None
    try:
        return world_of(given, chosen, count=given["vehicles"], defaults=mission.world_defaults)
    except ValueError as error:
        raise click.UsageError(in_options(error)) from error


def _export(mission: "Mission[Any]", request: "RunRequest", path: Path) -> int:
    """Write the mission's file instead of flying it."""
    from missions.runs.plan_export import export_plan

    count = export_plan(mission, request, path)
    click.echo(f"{count} items: {path}")
    return 0


def flight_of(context: click.Context) -> "tuple[Mission[Any], RunRequest]":
    """The mission and the request that the options of a parsed command line `fly` make.

    Raises:
        click.UsageError, PlanError: a value is not accepted.
    """
    from missions.base.given_text import parameters_from_file
    from missions.library import find_mission

    given = context.params
    refuse_idle_options(context, connected=bool(given["connect"]))
    mission = find_mission(given["mission"])
    declared: MissionCommand = context.meta["mission command"]
    chosen = chosen_names(context)
    world = _world(given, mission, chosen)
    count = len(given["connect"]) if world is None else len(world.vehicles)
    options = declared.build(given, chosen, vehicles=given["vehicles"] or count)
    if world is not None:
        world = declared.with_world(given, chosen, options, world)
    for name in ("expect_wind", "max_error"):
        value = given[name]
        zero = name == "expect_wind" and value == 0.0
        if value is not None and not zero and not (math.isfinite(value) and value > 0.0):
            raise click.UsageError(
                f"--{name.replace('_', '-')} {value:g} is not possible; ask for more than 0"
            )
    if given["system_id"] and len(given["system_id"]) != len(given["connect"]):
        raise click.UsageError(
            f"{len(given['system_id'])} --system-id for {len(given['connect'])} --connect; give one for each"
        )
    forecast_m_s = given["expect_wind"]
    if forecast_m_s is None and given["wind"] is not None and world is not None:
        height_m = max(options.altitude_m, _FORECAST_HEIGHT_M)
        forecast_m_s = world.air.wind_speed_m_s * world.air.profile.factor(height_m)
    parameters = {} if given["params"] is None else parameters_from_file(given["params"])
    left_out_parameters: tuple[str, ...] = ()
    if parameters and world is not None and given["firmware"] is None:
        parameters, left_out_parameters = known_to_all(parameters, world, strict=given["strict_params"])
    from autopilot_bridge.mavlink.components import GROUND_STATION
    from missions.base.request import REGAIN_S, RunRequest
    from missions.vehicle.connection import ONBOARD_COMPUTER
    from missions.vehicle.firmware import Mode

    request = RunRequest(
        options=options,
        connect=given["connect"],
        system_ids=given["system_id"],
        world=world,
        firmware=firmware_of(given),
        speedup=given["speedup"],
        forecast_wind_m_s=forecast_m_s,
        parameters=parameters,
        strict_parameters=given["strict_params"],
        left_out_parameters=left_out_parameters,
        out=given["out"],
        picture=not given["no_picture"],
        identity=ONBOARD_COMPUTER if given["onboard"] else GROUND_STATION,
        on_failure=Mode(given["on_failure"]),
        max_error_m=given["max_error"],
        regain_s=REGAIN_S if given["regain"] is None else given["regain"],
        endurance_s=None if given["endurance"] is None else 60.0 * given["endurance"],
        estimator=given["estimator"],
        estimator_settings=given["settings"],
    )
    return mission, request


def _fly(given: dict[str, Any]) -> int:
    mission, request = flight_of(click.get_current_context())
    if given["out"] is not None and given["out"].is_dir() and any(given["out"].iterdir()):
        raise click.UsageError(
            f"{given['out']} is not empty, and nothing is overwritten; choose another --out"
        )

    if request.left_out_parameters:
        from autopilot_bridge.parameter_files import left_out

        report(f"--params: {left_out(request.left_out_parameters, _NAMES_SHOWN)}")
    from missions.runs.session import fly as fly_mission

    line = ProgressLine()
    if given["export_plan"] is None:
        line.start(mission.name, given["connect"])
    confirm = None
    if given["connect"]:
        try:
            if given["export_plan"] is None:
                confirm = confirmation(
                    given["connect"], yes=given["yes"], check=given["check"], screen=line.held
                )
        except AddressError as error:
            raise click.UsageError(in_options(error)) from error
    try:
        key = key_from(given["signing_key"])

        def opened() -> None:
            line.opened()
            warn_if_open(given["connect"], key)

        request = replace(
            request,
            confirm=confirm,
            on_remark=line.say,
            confirm_simulations=given["check"],
            on_open=opened,
            command=" ".join(["flightstack", *sys.argv[1:]]),
            signing_key=key,
        )
        if given["export_plan"] is not None:
            return _export(mission, request, given["export_plan"])
        with line.running():
            result = fly_mission(mission, request, line)
    except (AddressError, BridgeError) as error:
        raise click.UsageError(in_options(error)) from error
    except MissionError as error:
        raise click.ClickException(in_options(error)) from error
    finally:
        leave_closed_terminal()
        line.end()
    line.finish(result)
    return print_result(result)
