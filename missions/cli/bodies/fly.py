"""What `flightstack fly` does."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import click

from autopilot_bridge.errors import AddressError, BridgeError
from autopilot_bridge.mavlink.components import GROUND_STATION
from autopilot_bridge.parameter_files import left_out
from estimators.reports.figure import vector_figures
from flightsim.world_spec import WorldSpec
from missions.base.given_text import parameters_from_file
from missions.base.mission import Mission
from missions.base.request import RunRequest
from missions.base.run_options import TeamOptions, WorldOptions
from missions.cli.bodies.confirm import confirmation
from missions.cli.bodies.fly_report import KILLED, ProgressLine, leave_closed_terminal, print_result
from missions.cli.bodies.params import known_to_all
from missions.cli.bodies.signing import key_from, warn_if_open
from missions.cli.bodies.viewing import viewing
from missions.cli.bodies.world import firmware_of, world_of
from missions.cli.declared_options import chosen_names, specified
from missions.cli.fly_command import refuse_idle_options
from missions.cli.mission_command import MissionCommand
from missions.cli.options import in_options, report
from missions.errors import MissionError, PlanError
from missions.library import find_mission
from missions.process.ending import signal_of
from missions.runs.plan_export import export_plan
from missions.runs.report_page import add_page
from missions.runs.session import fly as fly_mission
from missions.vehicle.connection import ONBOARD_COMPUTER
from missions.view.viewer import Viewer, ViewError

_NAMES_SHOWN: Final = 20  # names of parameters that were left out; the summary has all
_FORECAST_HEIGHT_M: Final = 100.0  # lower limit; above it the wind of a profile increases little


def fly(**given: Any) -> int:
    """`flightstack fly`."""
    try:
        return _fly(given)
    except PlanError as error:
        raise click.UsageError(in_options(error, own=True)) from error
    except KeyboardInterrupt as interrupt:
        click.echo("interrupted", err=True)
        return KILLED + signal_of(interrupt)


def _world(context: click.Context, mission: Mission[Any], chosen: frozenset[str]) -> WorldSpec | None:
    """The embedded world without what the mission adds to it; None: the vehicles are connected by links."""
    given = context.params
    if given["connect"]:
        return None
    try:
        return world_of(
            specified(WorldOptions, context),
            chosen,
            file=given["world"],
            firmware=firmware_of(given),
            count=specified(TeamOptions, context).vehicles,
            defaults=mission.world_defaults,
        )
    except ValueError as error:
        raise click.UsageError(in_options(error)) from error


def _export(mission: Mission[Any], request: RunRequest, path: Path) -> int:
    """Write the mission's file instead of flying it."""
    count = export_plan(mission, request, path)
    click.echo(f"{count} items: {path}")
    return 0


def flight_of(context: click.Context) -> tuple[Mission[Any], RunRequest]:
    """The mission and the request that the options of a parsed command line `fly` make.

    Raises:
        click.UsageError, PlanError: a value is not accepted.
    """
    given = context.params
    refuse_idle_options(context, connected=bool(given["connect"]))
    mission = find_mission(given["mission"])
    declared: MissionCommand = context.meta["mission command"]
    chosen = chosen_names(context)
    world = _world(context, mission, chosen)
    count = len(given["connect"]) if world is None else len(world.vehicles)
    options = declared.build(given, chosen, vehicles=specified(TeamOptions, context).vehicles or count)
    if world is not None:
        world = declared.with_world(given, chosen, options, world)
    if given["system_id"] and len(given["system_id"]) != len(given["connect"]):
        raise click.UsageError(
            f"{len(given['system_id'])} --system-id for {len(given['connect'])} --connect; give one for each"
        )
    parameters = {} if given["params"] is None else parameters_from_file(given["params"])
    left_out_parameters: tuple[str, ...] = ()
    if parameters and world is not None and given["firmware"] is None:
        parameters, left_out_parameters = known_to_all(parameters, world, strict=given["strict_params"])

    request = specified(
        RunRequest,
        context,
        options=options,
        connect=given["connect"],
        world=world,
        firmware=firmware_of(given),
        parameters=parameters,
        strict_parameters=given["strict_params"],
        left_out_parameters=left_out_parameters,
        out=given["out"],
        picture=not given["no_picture"],
        identity=ONBOARD_COMPUTER if given["onboard"] else GROUND_STATION,
        estimator=given["estimator"],
        estimator_settings=given["settings"],
    )
    if request.forecast_wind_m_s is None and given["wind"] is not None and world is not None:
        height_m = max(options.altitude_m, _FORECAST_HEIGHT_M)
        forecast_m_s = world.air.wind_speed_m_s * world.air.profile.factor(height_m)
        request = replace(request, forecast_wind_m_s=forecast_m_s)
    return mission, request


def _fly(given: dict[str, Any]) -> int:
    mission, request = flight_of(click.get_current_context())
    if given["out"] is not None and given["out"].is_dir() and any(given["out"].iterdir()):
        raise click.UsageError(
            f"{given['out']} is not empty, and nothing is overwritten; choose another --out"
        )

    if request.left_out_parameters:
        report(f"--params: {left_out(request.left_out_parameters, _NAMES_SHOWN)}")

    if given["export_plan"] is not None and given["view"] is not None:
        raise click.UsageError("--view: has no effect with --export-plan, which flies nothing; leave it out")
    try:
        with viewing(given["view"]) as view:
            return _fly_viewed(given, mission, request, view)
    except ViewError as error:
        raise click.ClickException(in_options(error)) from error


def _fly_viewed(
    given: dict[str, Any], mission: Mission[Any], request: RunRequest, view: Viewer | None
) -> int:
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
            view=view,
        )
        if given["export_plan"] is not None:
            return _export(mission, request, given["export_plan"])
        with line.running(), vector_figures(wanted=given["vector"]):
            result = fly_mission(mission, request, line)
    except (AddressError, BridgeError) as error:
        raise click.UsageError(in_options(error)) from error
    except MissionError as error:
        raise click.ClickException(in_options(error)) from error
    finally:
        leave_closed_terminal()
        line.end()
    line.finish(result)
    code = print_result(result)
    if request.picture and not given["no_report"] and (left_out_page := add_page(result.folder)):
        report(left_out_page)
    return code
