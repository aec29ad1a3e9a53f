"""`flightstack fly`: a mission from one command."""

import importlib
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli_types import SPEEDUP

if TYPE_CHECKING:
    from missions.mission import Mission
    from missions.mission_command import MissionCommand
    from missions.session import Flight, RunResult

_FAILED, _INTERRUPTED = 1, 130

_PATTERNS: Final = "missions.pattern_command"
_COMMANDS: Final = {
    "lissajous": _PATTERNS,
    "sector": _PATTERNS,
    "parallel-sweep": _PATTERNS,
    "expanding-square": _PATTERNS,
    "orbit": "missions.orbit.command",
    "occupancy": "missions.occupancy.command",
}
"""Where each mission declares its options."""

_EMBEDDED_ONLY: Final = (
    "autopilot",
    "model",
    "launch",
    "home",
    "seed",
    "wind",
    "turbulence",
    "speedup",
)


class _Line:
    """The progress line on a terminal; nothing in a pipe."""

    def __init__(self) -> None:
        self._shown = False
        self._last_wall_s = -math.inf

    def __call__(self, flight: "Flight") -> None:
        from autopilot_bridge.clock.pacing import wall_time_s
        from missions.telemetry import Position

        now_s = wall_time_s()
        if now_s - self._last_wall_s < 0.1 or flight.clock is None:
            return
        self._last_wall_s = now_s
        time_s = flight.clock.time_us * 1e-6
        factor = time_s / max(now_s - flight.started_wall_s, 1e-3)
        heard = [vehicle for vehicle in flight.vehicles if vehicle.notes.system_id]
        mode, height, progress = "waiting", "", 0.0
        if heard:
            mode = "/".join(dict.fromkeys(vehicle.mode for vehicle in heard))
            positions = [vehicle.latest(Position) for vehicle in heard]
            height = "/".join(f"{p.height_m:.1f}" for p in positions if p) + " m"
            progress = sum(vehicle.notes.progress for vehicle in heard) / len(heard)
        text = f"{time_s:8.1f} s  x{factor:<6.1f} {mode:<10} {height:>8}  {100.0 * progress:3.0f} %"
        click.echo(f"\r{text:<72}", nl=False, err=True)
        self._shown = True

    def end(self) -> None:
        """Leave the line."""
        if self._shown:
            click.echo("", err=True)


def _command_of(module: str) -> "MissionCommand":
    command: MissionCommand = importlib.import_module(module).COMMAND
    return command


class FlyCommand(click.Command):
    """`fly MISSION`: the options are those of every flight, and those the mission declares."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        named = next((a for a in args if a in _COMMANDS or a.endswith(".py")), None)
        if named is not None:
            ctx.meta["mission command"] = _command_of(_COMMANDS.get(named, _PATTERNS))
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            owners = _owners(error.option_name)
            if owners and named is not None:
                raise click.UsageError(
                    f"{error.option_name} is for {', '.join(owners)}, not for {named}"
                ) from None
            raise

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        declared = ctx.meta.get("mission command")
        own = [] if declared is None else list(declared.options)
        common = super().get_params(ctx)
        return [common[0], *own, *common[1:]]

    def format_help_text(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        declared = ctx.meta.get("mission command")
        if declared is None:
            super().format_help_text(ctx, formatter)
            return
        formatter.write_paragraph()
        with formatter.indentation():
            for paragraph in declared.help.split("\n\n"):
                formatter.write_text(paragraph)
                formatter.write_paragraph()


def _owners(option_name: str) -> list[str]:
    """The missions that have an option."""
    return [
        name
        for name, module in _COMMANDS.items()
        if any(option_name in option.opts for option in _command_of(module).options)
    ]


@click.command(cls=FlyCommand, context_settings={"show_default": True})
@click.argument("mission")
@click.option("--vehicles", type=click.IntRange(1, 250), help="Team size. [default: 1, or one per --connect]")
@click.option(
    "--connect", multiple=True, metavar="URL", help="A vehicle elsewhere: udpin:0.0.0.0:14550, serial:..."
)
@click.option(
    "--autopilot", type=click.Choice(["px4", "ardupilot"]), default="px4", help="Of the embedded SITL."
)
@click.option(
    "--model",
    multiple=True,
    metavar="NAME|PATH",
    help="Vehicle of the embedded SITL; one for all of a team, or one for each (repeat, or A,B,C). "
    "[default: iris, or an aircraft where the mission needs one]",
)
@click.option(
    "--launch",
    type=click.Choice(["runway", "catapult", "hand"]),
    help="How aircraft get into the air. [default: as described with the model]",
)
@click.option("--home", help="lat,lon,alt[,heading] of the embedded SITL. [default: the firmware's own]")
@click.option("--seed", type=click.IntRange(min=0), default=0, help="One seed makes one flight.")
@click.option(
    "--wind", metavar="SPEED[@FROM]", help="m/s, and degrees it comes from. [default: 0; orbit: 4 from north]"
)
@click.option(
    "--turbulence",
    type=click.Choice(["none", "light", "moderate", "severe"]),
    help="[default: none; orbit: light]",
)
@click.option("--expect-wind", type=float, help="Wind to plan turns for, m/s. [default: --wind; elsewhere 5]")
@click.option("--speedup", type=SPEEDUP, help="At most this fast. [default: no limit]")
@click.option(
    "--params", metavar="FILE", help="Autopilot parameters to set (NAME VALUE lines, .parm, .params)."
)
@click.option("--out", type=click.Path(path_type=Path), help="Run folder. [default: runs/MISSION-N]")
@click.option(
    "--on-failure", type=click.Choice(["return", "land", "hold"]), default="return", help="Or on Ctrl-C."
)
@click.option(
    "--onboard", is_flag=True, help="Speak as the vehicle's companion computer (191), not as a GCS."
)
@click.option("--no-picture", is_flag=True, help="Don't draw track.png.")
@click.option("--arg", multiple=True, metavar="NAME=VALUE", help="For a mission of your own.")
def fly(**given: Any) -> int:
    """Fly MISSION: lissajous, sector, parallel-sweep, expanding-square, orbit, occupancy, or a
    Python file of your own.

    `flightstack fly MISSION --help` tells a mission's own options. Your own file has
    `async def fly(vehicle, options)`.
    The run folder gets flight.tlog, summary.json and track.png.
    """
    from missions.errors import PlanError

    if given["connect"]:
        _refuse_embedded_options(click.get_current_context())
    try:
        return _fly(given)
    except PlanError as error:
        raise click.UsageError(str(error)) from error


def _chosen(context: click.Context) -> frozenset[str]:
    """Options that stand on the command line."""
    return frozenset(
        name
        for name in context.params
        if context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE
    )


def _refuse_embedded_options(context: click.Context) -> None:
    """A vehicle elsewhere has its own wind: an option that would do nothing is not passed over in silence."""
    chosen = _chosen(context)
    given = [f"--{name}" for name in _EMBEDDED_ONLY if name in chosen]
    if given:
        raise click.UsageError(
            f"{', '.join(given)}: of the embedded SITL only, has no effect with --connect; leave it out"
        )


def _arguments(pairs: tuple[str, ...]) -> dict[str, str]:
    from missions.errors import PlanError

    values = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not (name and equals):
            raise PlanError(f"--arg {pair!r} is not NAME=VALUE")
        values[name] = value
    return values


def _models(
    given: tuple[str, ...], mission: "Mission[Any]", vehicles: int | None, connections: int
) -> list[str]:
    """A model for each vehicle."""
    models = [name for text in given for name in text.split(",") if name] or [mission.world_defaults.model]
    count = vehicles or max(1, connections, len(models))
    return models * count if len(models) == 1 else models


def _fly(given: dict[str, Any]) -> int:
    from missions.library import find_mission
    from missions.options import check_positive, parameters_from_file, parse_wind

    mission = find_mission(given["mission"])
    context = click.get_current_context()
    declared: MissionCommand = context.meta["mission command"]
    models = _models(given["model"], mission, given["vehicles"], len(given["connect"]))
    common = {
        "vehicles": given["vehicles"] or max(1, len(given["connect"]), len(models)),
        "arguments": _arguments(given["arg"]),
        "given": declared.chosen_fields(_chosen(context)),
    }
    options = declared.build(given, common)
    world = mission.world_defaults
    wind_speed_m_s, wind_from_deg = parse_wind(world.wind if given["wind"] is None else given["wind"])
    check_positive(expect_wind=given["expect_wind"] or None)
    parameters = {} if given["params"] is None else parameters_from_file(given["params"])
    if given["out"] is not None and given["out"].is_dir() and any(given["out"].iterdir()):
        raise click.UsageError(
            f"{given['out']} is not empty, and nothing is overwritten; choose another --out"
        )

    terminal = sys.stderr.isatty()
    if terminal and not given["connect"]:
        click.echo("starting (the first start compiles the flight code, half a minute or so)", err=True)
    from autopilot_bridge.errors import AddressError, BridgeError
    from missions.connection import GROUND_STATION, ONBOARD_COMPUTER
    from missions.session import RunRequest
    from missions.session import fly as fly_mission
    from missions.vehicle.adapter import Mode

    line = _Line()
    try:
        result = fly_mission(
            mission,
            RunRequest(
                options=options,
                connect=given["connect"],
                autopilot=given["autopilot"],
                model=models,
                launch=given["launch"],
                seed=given["seed"],
                speedup=given["speedup"],
                wind_speed_m_s=wind_speed_m_s,
                wind_from_deg=wind_from_deg,
                turbulence=given["turbulence"] or world.turbulence,
                expected_wind_m_s=given["expect_wind"],
                home=given["home"],
                parameters=parameters,
                out=given["out"],
                picture=not given["no_picture"],
                identity=ONBOARD_COMPUTER if given["onboard"] else GROUND_STATION,
                on_failure=Mode(given["on_failure"]),
                command=" ".join(["flightstack", *sys.argv[1:]]),
            ),
            line if terminal else None,
        )
    except (AddressError, BridgeError) as error:
        raise click.UsageError(str(error)) from error
    finally:
        line.end()
    return _tell(result, mission)


def _tell(result: "RunResult", mission: "Mission[Any]") -> int:
    summary = result.summary
    if result.outcome == "interrupted":
        click.echo(f"flightstack: interrupted; the log is in {result.folder}", err=True)
        return _INTERRUPTED
    if result.outcome == "failed":
        click.echo(f"flightstack: mission {summary['mission']} failed: {result.reason}", err=True)
        click.echo(f"failed: see {result.folder}")
        return _FAILED
    click.echo(
        f"{result.outcome}: {summary['mission']} with {summary['autopilot']}, "
        f"{summary['distance_m']:.0f} m in {summary['sim_time_s']:.1f} s, "
        f"{summary['speedup']:.0f} times real time"
    )
    if summary["path_rms_error_m"] is not None:
        reference = summary["vehicles"][0]["error_reference"]
        click.echo(
            f"path error {summary['path_rms_error_m']:.2f} m RMS, "
            f"{summary['path_max_error_m']:.2f} m at most ({reference})"
        )
    for block in summary["vehicles"]:
        if "waypoints" in block:
            w = block["waypoints"]
            click.echo(f"waypoints passed within {w['acceptance_m']:g} m: {w['passed']} of {w['count']}")
    for told in mission.said(summary):
        click.echo(told)
    click.echo(f"run: {result.folder}")
    return 0
