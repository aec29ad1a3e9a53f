"""`flightstack fly`: a mission from one command."""

import importlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli_confirm import confirmation
from missions.cli_fly_report import KILLED, ProgressLine, leave_closed_terminal, tell
from missions.cli_signing import key_from, key_option, warn_if_open
from missions.cli_types import SECONDS, SPEEDUP
from missions.plan_files.suffixes import SUFFIXES as MISSION_FILES

if TYPE_CHECKING:
    from missions.mission import Mission
    from missions.mission_command import MissionCommand
    from missions.session import RunRequest

_PATTERNS: Final = "missions.pattern_command"
_OWN: Final = "missions.own_command"
_FILE: Final = "missions.plan_files.command"
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
    "wind_profile",
    "turbulence",
    "speedup",
)


_FORECAST_HEIGHT_M: Final = 100.0  # at least; the wind of a profile grows little above it
_CONNECTED_ONLY: Final = ("yes", "check", "regain", "signing_key")


def _command_of(module: str) -> "MissionCommand":
    command: MissionCommand = importlib.import_module(module).COMMAND
    return command


class FlyCommand(click.Command):
    """`fly MISSION`: the options are those of every flight, and those the mission declares."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        named = self._mission_named(args)
        if named is not None:
            other = _OWN if named.endswith(".py") else _FILE
            ctx.meta["mission command"] = _command_of(_COMMANDS.get(named, other))
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            owners = _owners(error.option_name)
            if owners and named is not None:
                raise click.UsageError(
                    f"{error.option_name} is for {', '.join(owners)}, not for {named}"
                ) from None
            raise

    def _mission_named(self, args: list[str]) -> str | None:
        """The mission among the arguments, which is no option's value."""
        valued = {
            name
            for parameter in self.params
            if isinstance(parameter, click.Option) and not parameter.is_flag
            for name in parameter.opts
        }
        words = [a for a, before in zip(args, ["", *args], strict=False) if before not in valued]
        return next((a for a in words if a in _COMMANDS or _is_file(a)), None)

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


def _is_file(name: str) -> bool:
    return name.endswith(".py") or name.lower().endswith(MISSION_FILES)


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
    "--system-id",
    multiple=True,
    type=click.IntRange(1, 255),
    metavar="ID",
    help="Of the vehicle, where several are on its link; one for each --connect. [default: the first heard]",
)
@click.option(
    "--autopilot",
    type=click.Choice(["px4", "ardupilot"]),
    help="Of the embedded SITL. [default: px4, or what a mission file is for]",
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
    "--wind",
    metavar="SPEED[@FROM]",
    help="Wind of the day in the embedded SITL, m/s at 10 m above ground, and degrees it comes from; turns "
    "are planned for it, unless --expect-wind says otherwise. "
    "[default: 0; orbit: 4 from north; occupancy: 5 from west]",
)
@click.option(
    "--wind-profile",
    type=click.Choice(["log", "power", "uniform"]),
    default="log",
    help="Wind over height: logarithmic over open ground, power law of 1/7, or the same everywhere. "
    "[default: log]",
)
@click.option(
    "--turbulence",
    type=click.Choice(["none", "light", "moderate", "severe"]),
    help="[default: none; orbit, occupancy: light]",
)
@click.option(
    "--expect-wind",
    type=float,
    help="Forecast: wind to plan turns for, m/s, at the height of the flight. [default: --wind where it is "
    "given, as it is at 100 m or the mission's altitude, else 5]",
)
@click.option("--speedup", type=SPEEDUP, help="At most this fast. [default: no limit]")
@click.option(
    "--params", metavar="FILE", help="Autopilot parameters to set (NAME VALUE lines, .parm, .params)."
)
@click.option("--out", type=click.Path(path_type=Path), help="Run folder. [default: runs/MISSION-N]")
@click.option(
    "--on-failure",
    type=click.Choice(["return", "land", "hold"]),
    default="return",
    help="Or on Ctrl-C, SIGTERM, SIGHUP.",
)
@click.option(
    "--yes", is_flag=True, help="With a real vehicle: fly without asking, when nothing is found against it."
)
@click.option(
    "--check",
    is_flag=True,
    help="Look at the vehicle and ask before the flight, on links of this machine too.",
)
@click.option(
    "--regain",
    type=SECONDS,
    help="So long a lost link may take to come back, s. [default: 60]",
)
@click.option(
    "--max-error",
    type=float,
    metavar="M",
    help="Fail when the path error exceeds it anywhere in a pattern, m.",
)
@click.option(
    "--onboard", is_flag=True, help="Speak as the vehicle's companion computer (191), not as a GCS."
)
@click.option(
    "--estimator", metavar="NAME|FILE.py", help="Run beside the flight: attitude, lissajous, target-fusion."
)
@click.option(
    "--set", "settings", multiple=True, metavar="NAME=VALUE", help="Parameter of the estimator; repeat."
)
@click.option(
    "--export-plan",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Don't fly: write the mission that would be uploaded (.plan, .waypoints).",
)
@click.option("--no-picture", is_flag=True, help="Don't draw track.png.")
@click.option("--arg", multiple=True, metavar="NAME=VALUE", help="For a mission of your own.")
@key_option
def fly(**given: Any) -> int:
    """Fly MISSION: lissajous, sector, parallel-sweep, expanding-square, orbit, occupancy, a mission
    file (.plan, .waypoints), or a Python file of your own.

    `flightstack fly MISSION --help` tells a mission's own options. Your own file has
    `async def fly(vehicle, options)`.
    The run folder gets flight.tlog, summary.json and track.png.
    """
    from missions.ending import signal_of
    from missions.errors import PlanError

    _refuse_options_of_the_other(click.get_current_context(), connected=bool(given["connect"]))
    try:
        return _fly(given)
    except PlanError as error:
        raise click.UsageError(str(error)) from error
    except KeyboardInterrupt as interrupt:
        click.echo("interrupted", err=True)
        return KILLED + signal_of(interrupt)


def _chosen(context: click.Context) -> frozenset[str]:
    """Options that stand on the command line."""
    return frozenset(
        name
        for name in context.params
        if context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE
    )


def _refuse_options_of_the_other(context: click.Context, *, connected: bool) -> None:
    """A vehicle elsewhere has its own wind: an option that would do nothing is not passed over in silence."""
    chosen = _chosen(context)
    if not connected:
        given = [f"--{name.replace('_', '-')}" for name in _CONNECTED_ONLY if name in chosen]
        if given:
            raise click.UsageError(
                f"{', '.join(given)}: for vehicles elsewhere; give --connect too, or leave it out"
            )
        return
    given = [f"--{name.replace('_', '-')}" for name in _EMBEDDED_ONLY if name in chosen]
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
    models = [name.strip() for text in given for name in text.split(",")]
    if not all(models):
        raise click.UsageError(
            f"--model {','.join(given)!r} has a place without a name; give NAME, or NAME,NAME,... for a team"
        )
    models = models or [mission.world_defaults.model]
    count = vehicles or max(1, connections, len(models))
    return models * count if len(models) == 1 else models


def _export(mission: "Mission[Any]", request: "RunRequest", path: Path) -> int:
    """Write the mission's file instead of flying it."""
    from missions.plan_files.export import export_plan

    count = export_plan(mission, request, path)
    click.echo(f"{count} items: {path}")
    return 0


def _fly(given: dict[str, Any]) -> int:
    from flightsim.wind_profile import WindLaw, WindProfile
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
    check_positive(expect_wind=given["expect_wind"] or None, max_error=given["max_error"])
    if given["system_id"] and len(given["system_id"]) != len(given["connect"]):
        raise click.UsageError(
            f"{len(given['system_id'])} --system-id for {len(given['connect'])} --connect; give one for each"
        )
    forecast_m_s = given["expect_wind"]
    if forecast_m_s is None and given["wind"] is not None:
        profile = WindProfile(law=WindLaw(given["wind_profile"]))
        forecast_m_s = wind_speed_m_s * profile.factor(max(options.altitude_m, _FORECAST_HEIGHT_M))
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
    from missions.errors import MissionError
    from missions.request import REGAIN_S
    from missions.session import RunRequest as Request
    from missions.session import fly as fly_mission
    from missions.vehicle.adapter import Mode

    confirm = None
    if given["connect"]:
        try:
            if given["export_plan"] is None:
                confirm = confirmation(given["connect"], yes=given["yes"], check=given["check"])
        except AddressError as error:
            raise click.UsageError(str(error)) from error
    line = ProgressLine()
    try:
        key = key_from(given["signing_key"])
        request = Request(
            options=options,
            connect=given["connect"],
            system_ids=given["system_id"],
            autopilot=given["autopilot"] or world.autopilot or "px4",
            model=models,
            launch=given["launch"],
            seed=given["seed"],
            speedup=given["speedup"],
            wind_speed_m_s=wind_speed_m_s,
            wind_from_deg=wind_from_deg,
            wind_profile=given["wind_profile"],
            turbulence=given["turbulence"] or world.turbulence,
            expected_wind_m_s=forecast_m_s,
            home=given["home"] or (None if given["connect"] else world.home),
            parameters=parameters,
            out=given["out"],
            picture=not given["no_picture"],
            identity=ONBOARD_COMPUTER if given["onboard"] else GROUND_STATION,
            on_failure=Mode(given["on_failure"]),
            max_error_m=given["max_error"],
            confirm=confirm,
            on_open=lambda: warn_if_open(given["connect"], key),
            regain_s=REGAIN_S if given["regain"] is None else given["regain"],
            estimator=given["estimator"],
            estimator_settings=given["settings"],
            command=" ".join(["flightstack", *sys.argv[1:]]),
            signing_key=key,
        )
        if given["export_plan"] is not None:
            return _export(mission, request, given["export_plan"])
        result = fly_mission(mission, request, line if terminal else None)
    except (AddressError, BridgeError) as error:
        raise click.UsageError(str(error)) from error
    except MissionError as error:
        raise click.ClickException(str(error)) from error
    finally:
        leave_closed_terminal()
        line.end()
    return tell(result, mission)
