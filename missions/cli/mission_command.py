"""Declaration of the command-line options of a mission."""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, TypeVar, get_args, get_origin

import click

from flightsim.foundation.options import OptionError, Options, declared
from flightsim.foundation.user_options import UserOption, choices_of, user_options, written
from missions.cli.later import named
from missions.cli.options import DeclaredType, in_options
from missions.errors import PlanError

if TYPE_CHECKING:
    from flightsim.world_spec import WorldSpec
    from missions.base.options import MissionOptions

T = TypeVar("T")

Given = Mapping[str, Any]
"""Values of the command line's options by name, with _ in place of -."""
_NONE: Final = ("none",)  # of an option that may be repeated: not even one of the default

MISSION_GROUP: Final = "The mission's own"
"""Heading of a mission's own options in the help."""


class Scope(StrEnum):
    """The flights on which an option has an effect."""

    ANY = "any"
    EMBEDDED = "embedded"
    CONNECTED = "connected"


class FlightOption(click.Option):
    """An option of `flightstack fly`.

    Args:
        group: heading under which the help lists it.
        scope: the flights it has an effect on; it is refused for the others.
        replaces: names of options that have no effect beside it; they are refused beside it.
        needs: name of an option without which it has no effect, and the values of that option with which it
            has one; without values, every value.
        sets: the field of the mission's options that it sets, where it is not a field itself.
    """

    def __init__(
        self,
        *arguments: Any,
        group: str,
        scope: Scope = Scope.ANY,
        replaces: tuple[str, ...] = (),
        needs: tuple[str, tuple[str, ...]] | None = None,
        sets: str | None = None,
        **attributes: Any,
    ) -> None:
        super().__init__(*arguments, **attributes)
        self.group = group
        self.scope = scope
        self.replaces = replaces
        self.needs = needs
        self.sets = sets


class DeclaredOption(FlightOption):
    """The option of a field that declares itself (`flightsim.foundation.options`).

    Args:
        user: the option as users see it.
        scope: the flights it has an effect on.
    """

    def __init__(self, user: UserOption, scope: Scope = Scope.ANY) -> None:
        kind, declared = user.declared.kind, user.option
        self.user = user
        name = f"no-{user.name}" if user.default is True and not user.name.startswith("no-") else user.name
        default = f" [default: {user.default_text}]" if user.default_text and kind is not bool else ""
        texts = get_origin(kind) is tuple and get_args(kind)[-1] is Ellipsis
        valued: dict[str, Any] = {"metavar": user.placeholder, "type": DeclaredType(user)}
        if kind is bool:
            valued = {"is_flag": True}
        elif texts and (choices := choices_of(get_args(kind)[0])):
            valued = {"multiple": True, "type": click.Choice(choices)}
        elif texts:
            valued = {"multiple": True, "metavar": user.placeholder}
        elif choices := choices_of(kind):
            valued = {"type": click.Choice(choices), "default": written(user.default) or None}
        super().__init__(
            [f"--{name}"],
            group=MISSION_GROUP,
            scope=scope,
            needs=declared.needs,
            replaces=declared.replaces,
            help=in_options(f"{user.option.help}{default}"),
            show_default=False,
            **valued,
        )

    def values(self, given: Any) -> dict[str, Any]:
        """The values of its fields that a value of the command line makes."""
        if self.user.declared.kind is bool:
            given = not self.user.default
        if given == _NONE and self.multiple:
            given = ()
        names = [field.name for field in self.user.fields]
        parts = given if self.user.together else (given,) * len(names)
        return dict(zip(names, parts, strict=True))


def declared_options(
    kind: type, *, without: Collection[str] = (), scope: Scope = Scope.ANY
) -> tuple[DeclaredOption, ...]:
    """The options of the fields of a class.

    Args:
        kind: the class, on `Options`.
        without: names of options that are left out.
        scope: the flights they have an effect on.
    """
    return tuple(DeclaredOption(user, scope) for user in user_options(kind) if user.name not in without)


def made(
    kind: type[T],
    options: Iterable[FlightOption],
    given: Given,
    chosen: Collection[str],
    further: Mapping[str, Any] = MappingProxyType({}),
) -> T:
    """An instance of a class on `Options` with the values that the user specified.

    Args:
        kind: the class.
        options: the options of its fields, and others, which are passed over.
        given: values of the command line's options.
        chosen: names of those that the user specified.
        further: values of other fields, by name.

    Raises:
        click.UsageError, PlanError: a value is not accepted.
    """
    values = dict(further)
    mine = [option for option in options if isinstance(option, DeclaredOption) and option.name in chosen]
    held: dict[str, dict[str, Any]] = {}
    for option in mine:
        values_of = held.setdefault(option.user.path, {}) if option.user.path else values
        values_of |= {
            name: v for name, v in option.values(given[option.name or ""]).items() if name not in further
        }
    try:
        defaults = {each.name: each.default for each in declared(kind)}
        for name, changes in held.items():
            values[name] = replace(defaults[name], **changes)
        return kind(**values)
    except ValueError as error:
        raise _in_option(error, mine) from error


def _in_option(error: ValueError, options: Iterable[DeclaredOption]) -> Exception:
    """An error of a field as one that names the option which sets it; another one as it is."""

    cause = error if isinstance(error, OptionError) else error.__cause__
    if isinstance(cause, OptionError):
        for option in options:
            if cause.field in (field.name for field in option.user.fields):
                return click.UsageError(f"{option.opts[0]} {cause.reason_for_users}")
    return error if isinstance(error, PlanError) else click.UsageError(in_options(error, own=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionCommand:
    """A mission on the command line.

    Attributes:
        help: first text of `flightstack fly NAME --help`.
        made: module and name of the class of the mission's options. Its fields are the mission's command-line
            options in addition to those of every mission.
        without: names of options that the mission does not have, of its class.
        further: options that are not fields of the class.
        world: module and name of a function that adds to an embedded world what the mission is for, such as
            targets and payload; None: nothing.
        part: module and name of a class whose fields say what that is; None: the mission's options do.
        values: values of fields that follow from several options.
    """

    help: str
    made: tuple[str, str]
    without: tuple[str, ...] = ()
    further: tuple[FlightOption, ...] = ()
    world: tuple[str, str] | None = None
    part: tuple[str, str] | None = None
    values: Callable[[Given, Collection[str]], Mapping[str, Any]] = lambda _given, _chosen: {}

    @property
    def options_class(self) -> type[Options]:
        """The class of the mission's options."""
        return named(self.made)

    @property
    def part_class(self) -> type[Options]:
        """The class of what is true in the embedded world; it must have one."""
        assert self.part is not None
        return named(self.part)

    @property
    def options(self) -> tuple[FlightOption, ...]:
        """The mission's own options. The mission accepts no others beside those of every mission."""
        return _options_of(self)

    def build(self, given: Given, chosen: frozenset[str], *, vehicles: int) -> "MissionOptions":
        """The mission's options.

        Args:
            given: values of the command line's options.
            chosen: names of the options that the user specified.
            vehicles: size of the team.

        Raises:
            click.UsageError, PlanError: a value is not accepted.
        """
        kind = named(self.made)
        own = declared_options(kind, without=self.without)
        values = dict(self.values(given, chosen))
        mine = [option for option in (*own, *self.further) if option.name in chosen]
        fields = (
            field.name
            for option in mine
            if isinstance(option, DeclaredOption)
            for field in option.user.fields
        )
        specified = frozenset(fields) | {option.sets for option in mine if option.sets is not None}
        values |= {"vehicles": vehicles, "given": specified}
        options: MissionOptions = made(kind, own, given, chosen, values)
        return options

    def with_world(
        self, given: Given, chosen: frozenset[str], options: "MissionOptions", world: "WorldSpec"
    ) -> "WorldSpec":
        """An embedded world with what the mission is for.

        Raises:
            click.UsageError, PlanError: a value is not accepted.
        """
        if self.world is None:
            return world
        parts = []
        if self.part is not None:
            kind = named(self.part)
            parts = [made(kind, declared_options(kind, scope=Scope.EMBEDDED), given, chosen)]
        found: WorldSpec = named(self.world)(world, options, *parts)
        return found


@cache
def _options_of(command: MissionCommand) -> tuple[FlightOption, ...]:
    own = declared_options(named(command.made), without=command.without)
    world = () if command.part is None else declared_options(named(command.part), scope=Scope.EMBEDDED)
    return (*own, *command.further, *world)


def option(*declarations: str, **attributes: Any) -> FlightOption:
    """An option of a mission that is not a field of its options."""
    return FlightOption(declarations, group=MISSION_GROUP, **attributes)
