"""`fly MISSION` as a command: the options of every flight, the mission's own, and their permitted
combinations.
"""

import inspect
from collections.abc import Callable, Mapping
from typing import Any, Final

import click

from flightsim.foundation.plug_ins import plug_ins
from missions.catalogue import GROUP
from missions.cli.declared_options import MISSION_GROUP, FlightOption, Scope, chosen_names
from missions.cli.mission_command import MissionCommand
from missions.cli.mission_commands import COMMANDS, FILE, OWN
from missions.errors import PlanError
from missions.plan_files.suffixes import SUFFIXES as MISSION_FILES

_OWN: Final = "a mission of your own"
_FILE: Final = "a mission file"
VEHICLES: Final = "Vehicles"
EMBEDDED: Final = "The embedded SITL"
FLIGHT: Final = "The flight"
RESULTS: Final = "Results"
ELSEWHERE: Final = "Vehicles elsewhere (--connect)"
ESTIMATOR: Final = "An estimator beside it"
_GROUPS: Final = (MISSION_GROUP, VEHICLES, EMBEDDED, FLIGHT, RESULTS, ELSEWHERE, ESTIMATOR)
"""The headings of the help, in their order."""
_COMMANDS: Final[Mapping[str, MissionCommand]] = {**COMMANDS, _OWN: OWN, _FILE: FILE}


def _command_of(mission: str) -> MissionCommand:
    """The command whose options apply, from the mission argument of the command line."""
    if mission in COMMANDS:
        return COMMANDS[mission]
    if _is_file(mission):
        return OWN if mission.endswith(".py") else FILE
    from missions.library import find_mission

    try:
        found = find_mission(mission)
    except PlanError as error:
        raise click.UsageError(str(error)) from error
    made = found.options_class
    return MissionCommand(help=inspect.getdoc(found) or mission, made=(made.__module__, made.__qualname__))


def _is_file(name: str) -> bool:
    return name.endswith(".py") or name.lower().endswith(MISSION_FILES)


def _owners(option_name: str) -> list[str]:
    """The missions that have an option."""
    return [
        mission
        for mission, command in _COMMANDS.items()
        if any(option_name in option.opts for option in command.options)
    ]


class FlyCommand(click.Command):
    """`fly MISSION`: its options are those of every flight and those that the mission declares."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        named = self._mission_named(args)
        if named is not None:
            ctx.meta["mission command"] = _command_of(named)
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
        """The mission among the arguments; values of options are skipped."""
        valued = {
            name
            for parameter in self.params
            if isinstance(parameter, click.Option) and not parameter.is_flag
            for name in parameter.opts
        }
        words = [a for a, before in zip(args, ["", *args], strict=False) if before not in valued]
        found = next((a for a in words if a in COMMANDS or _is_file(a)), None)
        return found or next((a for a in words if not a.startswith("-") and a in plug_ins(GROUP)), None)

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        declared = ctx.meta.get("mission command")
        own = [] if declared is None else list(declared.options)
        common = super().get_params(ctx)
        arguments = [each for each in common if isinstance(each, click.Argument)]
        return [*arguments, *own, *(each for each in common if each not in arguments)]

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

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options under the headings of their groups, the mission's own first."""
        groups: dict[str, list[tuple[str, str]]] = {name: [] for name in _GROUPS}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx) if isinstance(parameter, click.Option) else None
            if record is not None:
                group = parameter.group if isinstance(parameter, FlightOption) else "Other"
                groups.setdefault(group, []).append(record)
        for group, records in groups.items():
            if records:
                with formatter.section(group):
                    formatter.write_dl(records)


def flight_option(
    *declarations: str, **attributes: Any
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorator for an option of every flight."""
    return click.option(*declarations, cls=FlightOption, **attributes)


def refuse_idle_options(context: click.Context, *, connected: bool) -> None:
    """Refuse options on the command line that would have no effect on this flight.

    Options of other missions are refused by the parser. This function refuses options of the embedded SITL
    when vehicles are connected by links, options for connected vehicles with the embedded SITL, options that
    another option replaces, and options that need another one.

    Raises:
        click.UsageError: the message names the options and their use.
    """
    chosen = chosen_names(context)
    options = {
        p.name: p for p in context.command.get_params(context) if isinstance(p, FlightOption) and p.name
    }
    given = [options[name] for name in sorted(chosen & options.keys(), key=list(options).index)]
    idle = Scope.EMBEDDED if connected else Scope.CONNECTED
    names = ", ".join(option.opts[0] for option in given if option.scope is idle)
    if names and connected:
        raise click.UsageError(
            f"{names}: of the embedded SITL only, has no effect with --connect; leave it out"
        )
    if names:
        raise click.UsageError(f"{names}: for vehicles elsewhere; give --connect too, or leave it out")
    for option in given:
        if option.needs is not None:
            _refuse_without(option, options[option.needs[0]], context)
        for name in option.replaces:
            if name in chosen:
                replaced = options[name].opts[0]
                raise click.UsageError(
                    f"{replaced}: has no effect beside {option.opts[0]}, which replaces it; leave one of "
                    "them out"
                )


def _refuse_without(option: FlightOption, needed: FlightOption, context: click.Context) -> None:
    """Refuse an option without the other one that it needs."""
    assert option.needs is not None and needed.name is not None
    name, values = needed.opts[0], option.needs[1]
    value = context.params[needed.name]
    if value in values or (not values and value is not None):
        return
    missing = f"without {name}" if value is None else f"with {name} {value}"
    wanted = " or ".join(f"{name} {each}" for each in values) or name
    raise click.UsageError(f"{option.opts[0]}: has no effect {missing}; give {wanted}, or leave it out")
